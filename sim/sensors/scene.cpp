#include "sensors/scene.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <future>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "worlds/triangle.h"

namespace arex::sim {
namespace {

constexpr std::size_t kPacket = 8;
// Embree's distances and boxes are right to single precision: what they are widened by, so that
// nothing is missed that our own arithmetic may find nearer.
constexpr float kSlack = 1e-3F;  // m
constexpr float kRelativeSlack = 0x1p-9F;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

using Triangle = std::array<std::uint32_t, 3>;

/// A world of more triangles than this is kept small instead of fast.
constexpr std::size_t kLarge = 2'000'000;

/// All that a hit needs of its triangle, one cache line.
struct alignas(64) Facet {
  std::array<Vec3f, 3> corners_W;
  Vec3f normal_W = Vec3f::Zero();  ///< unit
  float reflectivity = 0;
  std::uint32_t object = Hit::kNone;
};

/// The triangles, and what there is to know of each.
struct Facets {
  const Vec3f* vertices = nullptr;
  std::vector<Triangle> triangles;
  std::vector<std::uint32_t> object_of_triangle;
  std::vector<worlds::Object> objects;
  std::vector<Facet> lines;  ///< one per triangle; of a large world none

  [[nodiscard]] std::array<Vec3f, 3> corners(std::uint32_t triangle) const {
    if (!lines.empty()) return lines[triangle].corners_W;
    const auto& [a, b, c] = triangles[triangle];
    return {vertices[a], vertices[b], vertices[c]};
  }
  [[nodiscard]] Facet at(std::uint32_t triangle) const {
    return lines.empty() ? make(triangle) : lines[triangle];
  }
  [[nodiscard]] Facet make(std::uint32_t triangle) const {
    const auto& [ia, ib, ic] = triangles[triangle];
    const Vec3 a = vertices[ia].cast<double>();
    const Vec3 b = vertices[ib].cast<double>();
    const Vec3 c = vertices[ic].cast<double>();
    Facet facet;
    facet.corners_W = {vertices[ia], vertices[ib], vertices[ic]};
    facet.normal_W = (b - a).cross(c - a).normalized().cast<float>();
    facet.object = object_of_triangle[triangle];
    facet.reflectivity = objects[facet.object].reflectivity;
    return facet;
  }
  void prefetch(std::uint32_t triangle) const {
    if (!lines.empty()) __builtin_prefetch(&lines[triangle]);
  }
};

/// By how much Embree may be wrong about a distance.
float widening(float t) { return kSlack + kRelativeSlack * t; }

/// The triangle that a ray meets first.
struct Meeting {
  double distance = kInfinity;
  std::uint32_t triangle = Hit::kNone;
  auto operator<=>(const Meeting&) const = default;
};

/// A ray on its way through the tree, and the triangles that may be the first it meets.
struct Search {
  Vec3 o, d;
  double from = 0, to = 0;
  float nearest = std::numeric_limits<float>::infinity();  ///< by Embree's distance
  std::size_t count = 0;
  std::array<std::uint32_t, 4> candidates{};

  [[nodiscard]] Meeting at(std::uint32_t triangle, const Facets& facets) const {
    return {distance_along(o, d, facets.corners(triangle)), triangle};
  }
  /// The first of the candidates, from the start of the ray to its end.
  [[nodiscard]] Meeting first(const Facets& facets) const {
    Meeting best{to, Hit::kNone};
    for (std::size_t i = 0; i < count; ++i) {
      const Meeting meeting = at(candidates[i], facets);
      if (meeting.distance >= from) best = std::min(best, meeting);
    }
    return best;
  }
  /// Takes a triangle that the ray meets at Embree's distance t. @return whether it is the nearest
  bool note(std::uint32_t triangle, float t, const Facets& facets) {
    const bool at_start = t <= static_cast<float>(from) + widening(t);
    if (at_start && at(triangle, facets).distance < from) return false;
    if (t + widening(t) < nearest) count = 0;  // all others lie behind it
    if (count == candidates.size()) {
      const Meeting best = first(facets);
      count = 0;
      if (best.triangle != Hit::kNone) candidates[count++] = best.triangle;
    }
    candidates[count++] = triangle;
    if (t >= nearest) return false;
    nearest = t;
    return true;
  }
};

struct Packet {
  RTCIntersectContext context{};  ///< the first member: what Embree hands to note_all()
  const Facets* facets = nullptr;
  std::array<Search, kPacket> searches{};
};

/// Embree calls this for every triangle that a ray meets.
void note_all(const RTCFilterFunctionNArguments* args) {
  auto& packet = *reinterpret_cast<Packet*>(args->context);
  for (unsigned i = 0; i < args->N; ++i) {
    if (args->valid[i] == 0) continue;
    Search& search = packet.searches[RTCRayN_id(args->ray, args->N, i)];
    float& t = RTCRayN_tfar(args->ray, args->N, i);
    const bool nearest = search.note(RTCHitN_primID(args->hit, args->N, i), t, *packet.facets);
    args->valid[i] = nearest ? -1 : 0;
    if (nearest) t += widening(t);  // Embree goes on up to here
  }
}

struct NearestQuery {
  Vec3 p_W;
  double best_m;
  worlds::ClassSet classes;
  const Facets* facets;
};

/// Embree calls this for every triangle whose bounds reach into the query's sphere.
bool visit_triangle(RTCPointQueryFunctionArguments* args) {
  auto& nearest = *static_cast<NearestQuery*>(args->userPtr);
  const Facets& facets = *nearest.facets;
  const std::uint32_t object = facets.object_of_triangle[args->primID];
  if (!nearest.classes.contains(facets.objects[object].surface_class)) return false;
  const std::array<Vec3f, 3> corners = facets.corners(args->primID);
  const Vec3 a = corners[0].cast<double>();
  const Vec3 b = corners[1].cast<double>();
  const Vec3 c = corners[2].cast<double>();
  const double distance = (worlds::nearest_on_triangle(nearest.p_W, a, b, c) - nearest.p_W).norm();
  if (distance >= nearest.best_m) return false;
  nearest.best_m = distance;
  args->query->radius = static_cast<float>(distance) + widening(static_cast<float>(distance));
  return true;
}

void fail_loudly(void*, RTCError, const char* message) {
  throw std::runtime_error(std::string("embree: ") + message);
}

}  // namespace

struct Scene::Embree {
  RTCDevice device = nullptr;
  RTCBuffer vertex_buffer = nullptr;
  Facets facets;
  RTCScene scene = nullptr;
  std::shared_future<void> built;

  Embree(const worlds::World& world, Build build) {
    // One instruction set and one thread: the same tree, hence the same ties, on every host.
    device = rtcNewDevice("isa=avx2,threads=1,set_affinity=0");
    if (device == nullptr) fail_loudly(nullptr, rtcGetDeviceError(nullptr), "no device");
    rtcSetDeviceErrorFunction(device, fail_loudly, nullptr);
    const std::vector<Vec3f>& source = world.mesh.vertices;
    // Embree reads vertices 16 bytes at a time, so the last one needs padding.
    vertex_buffer = rtcNewBuffer(device, (source.size() + 2) * sizeof(Vec3f));
    auto* copied = static_cast<Vec3f*>(rtcGetBufferData(vertex_buffer));
    std::copy(source.begin(), source.end(), copied);
    facets.vertices = copied;
    facets.triangles = world.mesh.triangles;
    facets.object_of_triangle = world.mesh.object_of_triangle;
    facets.objects = world.objects;
    if (facets.triangles.size() <= kLarge) {
      facets.lines.resize(facets.triangles.size());
      for (std::uint32_t t = 0; t < facets.lines.size(); ++t) facets.lines[t] = facets.make(t);
    }
    attach(source.size());
    const bool beside = build == Build::kBeside;
    built = std::async(beside ? std::launch::async : std::launch::deferred,
                       [this] { rtcCommitScene(scene); });
    if (!beside) built.get();
  }
  ~Embree() {
    built.wait();
    rtcReleaseScene(scene);
    rtcReleaseBuffer(vertex_buffer);
    rtcReleaseDevice(device);
  }
  Embree(const Embree&) = delete;
  Embree& operator=(const Embree&) = delete;

  /// The scene, its tree built.
  [[nodiscard]] RTCScene tree() const {
    built.get();
    return scene;
  }

  void attach(std::size_t vertex_count) {
    scene = rtcNewScene(device);
    // Robust: a box or a triangle that a ray grazes is searched, not missed.
    const bool large = facets.triangles.size() > kLarge;
    rtcSetSceneFlags(
        scene, large ? RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_COMPACT : RTC_SCENE_FLAG_ROBUST);
    const RTCBuildQuality quality = large ? RTC_BUILD_QUALITY_MEDIUM : RTC_BUILD_QUALITY_HIGH;
    rtcSetSceneBuildQuality(scene, quality);
    if (facets.triangles.empty()) return;
    const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetGeometryBuildQuality(geometry, quality);
    rtcSetGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, vertex_buffer, 0,
                         sizeof(Vec3f), vertex_count);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                               facets.triangles.data(), 0, sizeof(Triangle),
                               facets.triangles.size());
    rtcSetGeometryPointQueryFunction(geometry, visit_triangle);
    rtcSetGeometryIntersectFilterFunction(geometry, note_all);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
  }

  /// The nearest triangle of each of at most kPacket rays, kNone where there is none, and how far
  /// away it is.
  void cast_packet(RTCScene tree, std::span<const Ray> rays, std::span<Meeting> found) const {
    alignas(32) std::array<int, kPacket> active{};
    RTCRayHit8 query;
    Packet packet;
    packet.facets = &facets;
    for (std::size_t i = 0; i < kPacket; ++i) {
      const Ray& ray = rays[std::min(i, rays.size() - 1)];
      active[i] = i < rays.size() && ray.max_distance_m >= 0 ? -1 : 0;
      Search& search = packet.searches[i];
      search.o = ray.origin_W.cast<double>();
      search.d = ray.direction_W.cast<double>();
      search.from = static_cast<double>(ray.min_distance_m);
      search.to = static_cast<double>(ray.max_distance_m);
      query.ray.org_x[i] = ray.origin_W.x();
      query.ray.org_y[i] = ray.origin_W.y();
      query.ray.org_z[i] = ray.origin_W.z();
      query.ray.dir_x[i] = ray.direction_W.x();
      query.ray.dir_y[i] = ray.direction_W.y();
      query.ray.dir_z[i] = ray.direction_W.z();
      query.ray.tnear[i] = std::max(0.0F, ray.min_distance_m - widening(ray.min_distance_m));
      query.ray.tfar[i] = ray.max_distance_m + widening(ray.max_distance_m);
      query.ray.time[i] = 0;
      query.ray.mask[i] = ~0U;
      query.ray.id[i] = static_cast<unsigned>(i);
      query.ray.flags[i] = 0;
      query.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
      query.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
    }
    rtcInitIntersectContext(&packet.context);
    rtcIntersect8(active.data(), tree, &packet.context, &query);
    for (const Search& search : packet.searches) {
      if (search.count > 0) facets.prefetch(search.candidates[0]);
    }
    for (std::size_t i = 0; i < rays.size(); ++i) found[i] = packet.searches[i].first(facets);
  }
};

double distance_along(const Vec3& o, const Vec3& d, const std::array<Vec3f, 3>& corners) {
  const Vec3 a = corners[0].cast<double>() - o;
  const Vec3 b = corners[1].cast<double>() - o;
  const Vec3 c = corners[2].cast<double>() - o;
  const Vec3 normal = (b - a).cross(c - a);
  const Vec3 extent = Vec3(d.dot(a), d.dot(b), d.dot(c)) / d.squaredNorm();
  const double t = normal.dot(a) / normal.dot(d);
  // Edge-on, where the plane's distance has no digits, it still lies between the corners.
  return std::min(extent.maxCoeff(), std::max(extent.minCoeff(), t));
}

Scene::Scene(const worlds::World& world, Build build)
    : embree_(std::make_unique<Embree>(world, build)) {}
Scene::~Scene() = default;

Hit Scene::cast(const Vec3& origin_W, const Vec3& direction_W, double max_distance_m) const {
  const Ray ray{origin_W.cast<float>(), direction_W.cast<float>(), 0,
                static_cast<float>(max_distance_m)};
  Meeting meeting;
  embree_->cast_packet(embree_->tree(), {&ray, 1}, {&meeting, 1});
  if (meeting.triangle == Hit::kNone) return {};
  const Facet facet = embree_->facets.at(meeting.triangle);
  Hit hit;
  hit.distance_m = meeting.distance;
  hit.normal_W = facet.normal_W.cast<double>().normalized();
  if (hit.normal_W.dot(direction_W) > 0) hit.normal_W = -hit.normal_W;
  hit.triangle = meeting.triangle;
  hit.object = facet.object;
  return hit;
}

void Scene::cast(std::span<const Ray> rays, std::span<RayHit> hits) const {
  const RTCScene tree = embree_->tree();
  std::array<Meeting, kPacket> met;
  for (std::size_t first = 0; first < rays.size(); first += kPacket) {
    const std::size_t count = std::min(kPacket, rays.size() - first);
    embree_->cast_packet(tree, rays.subspan(first, count), std::span(met).first(count));
    for (std::size_t i = 0; i < count; ++i) {
      RayHit& hit = hits[first + i];
      hit = {};
      if (met[i].triangle == Hit::kNone) continue;
      const Facet facet = embree_->facets.at(met[i].triangle);
      hit = {static_cast<float>(met[i].distance), facet.normal_W, facet.reflectivity, facet.object};
    }
  }
}

double Scene::distance_to_surface(const Vec3& p_W, double max_distance_m,
                                  worlds::ClassSet classes) const {
  NearestQuery nearest{p_W, max_distance_m, classes, &embree_->facets};
  RTCPointQuery query;
  query.x = static_cast<float>(p_W.x());
  query.y = static_cast<float>(p_W.y());
  query.z = static_cast<float>(p_W.z());
  query.time = 0;
  query.radius = static_cast<float>(max_distance_m) + widening(static_cast<float>(max_distance_m));
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(embree_->tree(), &query, &context, nullptr, &nearest);
  return nearest.best_m;
}

}  // namespace arex::sim
