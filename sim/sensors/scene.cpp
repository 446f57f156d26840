#include "sensors/scene.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <future>
#include <stdexcept>
#include <string>
#include <vector>

namespace arex::sim {
namespace {

constexpr std::size_t kPacket = 8;
// Below this cosine the plane's distance is ill-conditioned and Embree's own is kept.
constexpr float kGrazing = 1e-4F;

using Triangle = std::array<std::uint32_t, 3>;

/// All that a hit needs of its triangle, half a cache line.
struct alignas(32) Facet {
  Vec3f corner_W = Vec3f::Zero();
  Vec3f normal_W = Vec3f::Zero();  ///< unit
  float reflectivity = 0;
  std::uint32_t object = Hit::kNone;
};

template <class Scalar>
Scalar plane_distance(const Facet& facet, const Eigen::Matrix<Scalar, 3, 1>& origin,
                      const Eigen::Matrix<Scalar, 3, 1>& direction, Scalar fallback) {
  const Eigen::Matrix<Scalar, 3, 1> normal = facet.normal_W.template cast<Scalar>();
  const Scalar rate = normal.dot(direction);
  if (std::abs(rate) < Scalar(kGrazing)) return fallback;
  return normal.dot(facet.corner_W.template cast<Scalar>() - origin) / rate;
}

/// Nearest point of triangle (a, b, c) to p.
/// Source: Ericson, Real-Time Collision Detection, 2005, section 5.1.5.
Vec3 nearest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a, ap = p - a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return a;
  const Vec3 bp = p - b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return b;
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + d1 / (d1 - d3) * ab;
  const Vec3 cp = p - c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return c;
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + d2 / (d2 - d6) * ac;
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b);
  }
  const double scale = 1 / (va + vb + vc);
  return a + vb * scale * ab + vc * scale * ac;
}

struct NearestQuery {
  Vec3 p_W;
  double best_m;
  worlds::ClassSet classes;
  const worlds::SurfaceClass* class_of_triangle;
  const Vec3f* vertices;
  const Triangle* triangles;
};

/// Embree calls this for every triangle whose bounds reach into the query's sphere.
bool visit_triangle(RTCPointQueryFunctionArguments* args) {
  auto& nearest = *static_cast<NearestQuery*>(args->userPtr);
  if (!nearest.classes.contains(nearest.class_of_triangle[args->primID])) return false;
  const Triangle& t = nearest.triangles[args->primID];
  const Vec3 a = nearest.vertices[t[0]].cast<double>();
  const Vec3 b = nearest.vertices[t[1]].cast<double>();
  const Vec3 c = nearest.vertices[t[2]].cast<double>();
  const double distance = (nearest_on_triangle(nearest.p_W, a, b, c) - nearest.p_W).norm();
  if (distance >= nearest.best_m) return false;
  nearest.best_m = distance;
  // Rounded up, so that the sphere of the search never cuts off a nearer triangle.
  args->query->radius = std::nextafter(static_cast<float>(distance) * 1.000001F, 1e30F);
  return true;
}

void fail_loudly(void*, RTCError, const char* message) {
  throw std::runtime_error(std::string("embree: ") + message);
}

}  // namespace

struct Scene::Embree {
  RTCDevice device = nullptr;
  RTCBuffer vertex_buffer = nullptr;
  std::vector<Facet> facets;  ///< one per triangle of the mesh
  const Vec3f* vertices = nullptr;
  std::vector<Triangle> triangles;
  std::vector<worlds::SurfaceClass> class_of_triangle;
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
    vertices = copied;
    triangles = world.mesh.triangles;
    make_facets(world);
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
    // Not robust: a ray may slip through a seam between triangles (never seen in 1e7), casts are 40
    // % faster, and only without it does the high-quality build split triangles.
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);
    if (triangles.empty()) return;
    const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_HIGH);
    rtcSetGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, vertex_buffer, 0,
                         sizeof(Vec3f), vertex_count);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                               triangles.data(), 0, sizeof(Triangle), triangles.size());
    rtcSetGeometryPointQueryFunction(geometry, visit_triangle);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
  }

  void make_facets(const worlds::World& world) {
    facets.resize(triangles.size());
    class_of_triangle.resize(triangles.size());
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      const Triangle& t = triangles[i];
      const Vec3 a = vertices[t[0]].cast<double>();
      const Vec3 b = vertices[t[1]].cast<double>();
      const Vec3 c = vertices[t[2]].cast<double>();
      Facet& facet = facets[i];
      facet.corner_W = vertices[t[0]];
      facet.normal_W = (b - a).cross(c - a).normalized().cast<float>();
      facet.object = world.mesh.object_of_triangle[i];
      class_of_triangle[i] = world.class_of_triangle(i);
      facet.reflectivity = world.objects[facet.object].reflectivity;
    }
  }

  void cast_packet(RTCScene tree, std::span<const Ray> rays, std::span<RayHit> hits) const {
    alignas(32) std::array<int, kPacket> active{};
    RTCRayHit8 packet;
    for (std::size_t i = 0; i < kPacket; ++i) {
      const Ray& ray = rays[std::min(i, rays.size() - 1)];
      active[i] = i < rays.size() ? -1 : 0;
      packet.ray.org_x[i] = ray.origin_W.x();
      packet.ray.org_y[i] = ray.origin_W.y();
      packet.ray.org_z[i] = ray.origin_W.z();
      packet.ray.dir_x[i] = ray.direction_W.x();
      packet.ray.dir_y[i] = ray.direction_W.y();
      packet.ray.dir_z[i] = ray.direction_W.z();
      packet.ray.tnear[i] = ray.min_distance_m;
      packet.ray.tfar[i] = ray.max_distance_m;
      packet.ray.time[i] = 0;
      packet.ray.mask[i] = ~0U;
      packet.ray.flags[i] = 0;
      packet.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
      packet.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
    }
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect8(active.data(), tree, &context, &packet);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      // A miss leaves geometry and primitive invalid alike.
      const bool missed = packet.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID;
      hits[i].object = missed ? Hit::kNone : packet.hit.primID[i];
      hits[i].distance_m = packet.ray.tfar[i];
      if (!missed) __builtin_prefetch(&facets[packet.hit.primID[i]]);
    }
  }

  /// Turns the triangle and Embree's distance, as cast_packet leaves them, into the full answer.
  void finish(const Ray& ray, RayHit& hit) const {
    if (!hit.valid()) {
      hit = {};
      return;
    }
    const Facet& facet = facets[hit.object];
    hit = {plane_distance<float>(facet, ray.origin_W, ray.direction_W, hit.distance_m),
           facet.normal_W, facet.reflectivity, facet.object};
  }
};

Scene::Scene(const worlds::World& world, Build build)
    : embree_(std::make_unique<Embree>(world, build)) {}
Scene::~Scene() = default;

Hit Scene::cast(const Vec3& origin_W, const Vec3& direction_W, double max_distance_m) const {
  RTCRayHit query{};
  query.ray.org_x = static_cast<float>(origin_W.x());
  query.ray.org_y = static_cast<float>(origin_W.y());
  query.ray.org_z = static_cast<float>(origin_W.z());
  query.ray.dir_x = static_cast<float>(direction_W.x());
  query.ray.dir_y = static_cast<float>(direction_W.y());
  query.ray.dir_z = static_cast<float>(direction_W.z());
  query.ray.tfar = static_cast<float>(max_distance_m);
  query.ray.mask = ~0U;
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(embree_->tree(), &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
  const Facet& facet = embree_->facets[query.hit.primID];
  Hit hit;
  hit.distance_m =
      plane_distance<double>(facet, origin_W, direction_W, static_cast<double>(query.ray.tfar));
  hit.normal_W = facet.normal_W.cast<double>().normalized();
  if (hit.normal_W.dot(direction_W) > 0) hit.normal_W = -hit.normal_W;
  hit.triangle = query.hit.primID;
  hit.object = facet.object;
  return hit;
}

void Scene::cast(std::span<const Ray> rays, std::span<RayHit> hits) const {
  const RTCScene tree = embree_->tree();
  for (std::size_t i = 0; i < rays.size(); i += kPacket) {
    const std::size_t count = std::min(kPacket, rays.size() - i);
    embree_->cast_packet(tree, rays.subspan(i, count), hits.subspan(i, count));
  }
  // In a second pass, when the facets have arrived in the cache.
  for (std::size_t i = 0; i < rays.size(); ++i) embree_->finish(rays[i], hits[i]);
}

double Scene::distance_to_surface(const Vec3& p_W, double max_distance_m,
                                  worlds::ClassSet classes) const {
  NearestQuery nearest{p_W,
                       max_distance_m,
                       classes,
                       embree_->class_of_triangle.data(),
                       embree_->vertices,
                       embree_->triangles.data()};
  RTCPointQuery query;
  query.x = static_cast<float>(p_W.x());
  query.y = static_cast<float>(p_W.y());
  query.z = static_cast<float>(p_W.z());
  query.time = 0;
  // Widened by the rounding of the centre to float.
  query.radius = static_cast<float>(max_distance_m) * 1.000001F + 1e-5F;
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(embree_->tree(), &query, &context, nullptr, &nearest);
  return nearest.best_m;
}

}  // namespace arex::sim
