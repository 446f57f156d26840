#include "support/mapped_cloud.h"

#include <cmath>
#include <numbers>

#include "mapping/point_cloud_map.h"
#include "math/random.h"
#include "messages/vehicle.h"
#include "sensors/mid360.h"
#include "sensors/scene.h"
#include "worlds/occupancy.h"

namespace arex::support {
namespace {

/// Places of a lattice that the vehicle can reach, at the asked-for height, row by row.
std::vector<Vec3> lattice(const worlds::World& world, const sim::Scene& scene,
                          const MappedCloudOptions& options) {
  constexpr double kCell = 0.2, kRadius = 0.3, kMost = 30.0;  // m
  worlds::Bounds bounds = world.bounds;
  bounds.low.head<2>() = bounds.low.head<2>().cwiseMax(options.low_m);
  bounds.high.head<2>() = bounds.high.head<2>().cwiseMin(options.high_m);
  bounds.high.z() = std::min(bounds.high.z(), world.X_WS.p.z() + 4.0);
  const auto occupancy =
      worlds::voxelize(world, worlds::make_grid(bounds, kCell),
                       worlds::ClassSet::all().without(worlds::SurfaceClass::kLeaf));
  const Vec3 start = world.X_WS.p + Vec3(0, 0, options.height_m);
  const worlds::FreeSpace free = worlds::flood_free_space(occupancy, start, kRadius);
  std::vector<Vec3> places;
  int row = 0;
  for (double y = bounds.low.y(); y < bounds.high.y(); y += options.spacing_m, ++row) {
    std::vector<Vec3> line;
    for (double x = bounds.low.x(); x < bounds.high.x(); x += options.spacing_m) {
      // From the top down; what stands over something at the height, once for each storey.
      double last = bounds.high.z() + kMost;
      for (double z = bounds.high.z(); z > bounds.low.z(); z -= kCell) {
        if (!free.at({x, y, z}) || last - z < options.height_m) continue;
        const sim::Hit below = scene.cast({x, y, z}, -Vec3::UnitZ(), kMost);
        if (!below.valid() || std::abs(below.distance_m - options.height_m) > 0.5 * kCell + 1e-6)
          continue;
        line.emplace_back(x, y, z);
        last = z;
      }
    }
    if (row % 2 == 1) std::reverse(line.begin(), line.end());
    places.insert(places.end(), line.begin(), line.end());
  }
  return places;
}

/// A value that wanders about zero from place to place.
class Drift {
 public:
  Drift(RandomStream& random, double sigma) : random_(random), sigma_(sigma) {}
  double next() {
    constexpr double kKept = 0.95;
    value_ = first_ ? sigma_ * random_.normal()
                    : kKept * value_ + std::sqrt(1 - kKept * kKept) * sigma_ * random_.normal();
    first_ = false;
    return value_;
  }

 private:
  RandomStream& random_;
  double sigma_;
  double value_ = 0;
  bool first_ = true;
};

}  // namespace

MappedCloud map_world(const worlds::World& world, const MappedCloudOptions& options,
                      std::uint64_t seed) {
  const sim::Scene scene(world);
  const VehicleConfig vehicle;
  const sim::Mid360Config config;
  const sim::Mid360 lidar(config, scene, vehicle.X_BL(), {}, seed);
  RandomStream random(seed, "support/mapped_cloud");
  Drift x(random, options.position_sigma_m), y(random, options.position_sigma_m),
      z(random, options.position_sigma_m), yaw(random, options.yaw_sigma_rad);

  MappedCloud mapped;
  mapped.X_WO = {world.X_WS.R, world.X_WS.p + Vec3(0, 0, vehicle.ground_offset_m)};
  const Pose X_OW = mapped.X_WO.inverse();
  PointCloudMapConfig map_config;
  map_config.voxel_m = options.voxel_m;
  map_config.max_points = 100'000'000;
  PointCloudMap map(map_config);
  std::vector<sim::Truth> ticks(101);
  std::int64_t frame = 0;
  for (const Vec3& place : lattice(world, scene, options)) {
    // The vehicle looks where it likes, and leans a little.
    const Pose X_WB{so3::from_yaw(random.uniform(-std::numbers::pi, std::numbers::pi)) *
                        so3::Exp(0.05 * random.normal3()),
                    place};
    for (std::size_t i = 0; i < ticks.size(); ++i) {
      ticks[i].stamp = (100 * frame + static_cast<std::int64_t>(i)) * kNanosecondsPerTick;
      ticks[i].X_WB = X_WB;
    }
    ++frame;
    const Pose error{so3::from_yaw(yaw.next()), Vec3(x.next(), y.next(), z.next())};
    // The error turns about the vehicle, not about the world's origin.
    const Pose X_OB_true = X_OW * X_WB;
    const Pose X_OL = Pose{error.R * X_OB_true.R, X_OB_true.p + error.p} * vehicle.X_BL();
    std::vector<Vec3f> points;
    for (const LidarPoint& point : lidar.scan(ticks).points) {
      const double range = static_cast<double>(point.p_L.norm());
      if (range < vehicle.own_returns_m() || range > options.range_m) continue;
      points.push_back((X_OL * point.p_L.cast<double>()).cast<float>());
    }
    map.insert(points);
    mapped.path_O.push_back(X_OL.p);
  }
  mapped.points_O = map.points();
  return mapped;
}

}  // namespace arex::support
