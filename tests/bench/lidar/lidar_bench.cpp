// MID-360 on the default forest with leaves, one core: everything on, against a bare loop of
// rtcIntersect1 over the same rays in the same order. CPU time of this thread, best of several
// passes, all variants interleaved in each pass.
#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <functional>
#include <vector>

#include "messages/vehicle.h"
#include "physics/airframe.h"
#include "sensors/mid360.h"
#include "worlds/forest.h"

namespace {

using namespace arex;
using namespace arex::sim;

constexpr int kFrames = 10;
constexpr int kPasses = 9;

double cpu_seconds() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// A flight at 1.5 m/s on a circle of 4 m about the start, 1.5 m up, leaning 5 degrees.
std::vector<Truth> fly(const worlds::World& world) {
  std::vector<Truth> ticks(kFrames * 1000 + 1);
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    Truth& truth = ticks[i];
    truth.stamp = static_cast<Stamp>(i) * kNanosecondsPerTick;
    const double angle = 1.5 / 4 * to_seconds(truth.stamp);
    truth.X_WB.p = world.X_WS * Vec3(4 * std::sin(angle), 4 - 4 * std::cos(angle), 1.5);
    truth.X_WB.R = world.X_WS.R * so3::from_yaw(angle) * so3::Exp({0.087, 0, 0});
  }
  return ticks;
}

/// The yardstick: a scene as Embree's tutorial builds it, at the quality that Scene uses.
class BareEmbree {
 public:
  explicit BareEmbree(const worlds::Mesh& mesh)
      : device_(rtcNewDevice("isa=avx2,threads=1")), scene_(rtcNewScene(device_)) {
    rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_HIGH);
    const RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_HIGH);
    auto* vertices = static_cast<Vec3f*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                sizeof(Vec3f), mesh.vertices.size()));
    std::copy(mesh.vertices.begin(), mesh.vertices.end(), vertices);
    using Triangle = std::array<std::uint32_t, 3>;
    auto* triangles = static_cast<Triangle*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                sizeof(Triangle), mesh.triangles.size()));
    std::copy(mesh.triangles.begin(), mesh.triangles.end(), triangles);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene_);
  }
  ~BareEmbree() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  BareEmbree(const BareEmbree&) = delete;
  BareEmbree& operator=(const BareEmbree&) = delete;

  [[nodiscard]] std::size_t cast(const std::vector<Ray>& rays) const {
    std::size_t hits = 0;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    for (const Ray& ray : rays) {
      RTCRayHit query{};
      query.ray.org_x = ray.origin_W.x();
      query.ray.org_y = ray.origin_W.y();
      query.ray.org_z = ray.origin_W.z();
      query.ray.dir_x = ray.direction_W.x();
      query.ray.dir_y = ray.direction_W.y();
      query.ray.dir_z = ray.direction_W.z();
      query.ray.tfar = ray.max_distance_m;
      query.ray.mask = ~0U;
      query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
      rtcIntersect1(scene_, &context, &query);
      hits += query.hit.geomID != RTC_INVALID_GEOMETRY_ID;
    }
    return hits;
  }

 private:
  RTCDevice device_;
  RTCScene scene_;
};

struct Variant {
  const char* name;
  std::function<std::size_t(std::size_t frame)> run;  ///< returns its hits or points
  double best_s = 1e9;
  std::size_t results = 0;
};

}  // namespace

int main() {
  const worlds::World world = worlds::build(worlds::ForestRecipe{}, 1);
  const double before = cpu_seconds();
  const Scene scene(world);
  std::printf("%zu triangles, %.2f s to build the scene\n", world.mesh.triangles.size(),
              cpu_seconds() - before);
  const BareEmbree bare(world.mesh);
  const std::vector<Truth> ticks = fly(world);
  const auto frame_of = [&](std::size_t frame) {
    return std::span(ticks).subspan(frame * 1000, 101);
  };
  const Pose X_BL = VehicleConfig{}.X_BL();
  Mid360Config exact;
  exact.noise_free = true;
  Mid360Config narrow;
  narrow.beam_half_angle_deg = 0;
  // The vehicle's own, as the simulator hands it over; the LiDAR's housing holds its origin.
  const std::vector<worlds::CollisionShape> airframe = load_airframe().shapes;
  const Mid360 lidar({}, scene, X_BL, airframe, 1);
  const Mid360 lidar_exact(exact, scene, X_BL, airframe, 1);
  const Mid360 lidar_narrow(narrow, scene, X_BL, airframe, 1);
  std::vector<std::vector<Ray>> rays;
  for (std::size_t f = 0; f < kFrames; ++f) rays.push_back(lidar.beams(frame_of(f)));
  std::vector<RayHit> hits(rays[0].size());

  std::vector<Variant> variants{
      {"bare rtcIntersect1", [&](std::size_t f) { return bare.cast(rays[f]); }},
      {"Scene::cast, packets of 8",
       [&](std::size_t f) {
         scene.cast(rays[f], hits);
         return static_cast<std::size_t>(
             std::count_if(hits.begin(), hits.end(), [](const RayHit& h) { return h.valid(); }));
       }},
      {"only poses and directions", [&](std::size_t f) { return lidar.beams(frame_of(f)).size(); }},
      {"Mid360, noise free",
       [&](std::size_t f) { return lidar_exact.scan(frame_of(f)).points.size(); }},
      {"Mid360, no mixed pixels",
       [&](std::size_t f) { return lidar_narrow.scan(frame_of(f)).points.size(); }},
      {"Mid360, everything on",
       [&](std::size_t f) { return lidar.scan(frame_of(f)).points.size(); }},
  };
  for (int pass = 0; pass < kPasses; ++pass) {
    for (Variant& variant : variants) {
      const double start = cpu_seconds();
      variant.results = 0;
      for (std::size_t f = 0; f < kFrames; ++f) variant.results += variant.run(f);
      variant.best_s = std::min(variant.best_s, cpu_seconds() - start);
    }
  }
  const double firings = kFrames * static_cast<double>(rays[0].size());
  std::printf("%-28s %10s %10s %10s %14s\n", "", "Mrays/s", "ms/frame", "of bare", "results/frame");
  for (const Variant& variant : variants) {
    std::printf("%-28s %10.2f %10.2f %10.2f %14zu\n", variant.name, firings / variant.best_s / 1e6,
                1e3 * variant.best_s / kFrames, variants[0].best_s / variant.best_s,
                variant.results / kFrames);
  }
  return 0;
}
