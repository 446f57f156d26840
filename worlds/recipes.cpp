#include "worlds/recipes.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "config/config.h"
#include "worlds/occupancy.h"

namespace arex::worlds {
namespace {

constexpr double kProbeHeight = 1.0;     // where the flood starts above the pad, m
constexpr double kCheckedHeight = 3.0;   // the flood's ceiling above the pad, m
constexpr double kResolution = 0.2;      // m; conservative cells make every gap narrower by this
constexpr double kReachableShare = 0.5;  // of the free space, at least

/// What the start must give access to.
Bounds region_to_reach(const WorldConfig& config, const World& world,
                       const std::optional<Eigen::AlignedBox2d>& flown) {
  Bounds region = world.bounds;
  region.high.z() = std::min(region.high.z(), world.X_WS.p.z() + kCheckedHeight);
  with_recipe(config, [&](const auto& recipe) {
    if constexpr (requires { recipe.limit_reach(region); }) recipe.limit_reach(region);
    if constexpr (requires { recipe.detailed(flown); }) {
      const Eigen::AlignedBox2d near = recipe.detailed(flown);
      region.low.head<2>() = region.low.head<2>().cwiseMax(near.min());
      region.high.head<2>() = region.high.head<2>().cwiseMin(near.max());
    }
  });
  return region;
}

/// The ground is a surface; what is below it is not free.
void fill_below(const HeightField& terrain, OccupancyGrid& occupancy) {
  if (terrain.columns == 0) return;
  const Eigen::Vector3i& size = occupancy.grid.size;
  for (int j = 0; j < size.y(); ++j) {
    for (int i = 0; i < size.x(); ++i) {
      for (int k = 0; k < size.z(); ++k) {
        const Vec3 p = occupancy.grid.centre({i, j, k});
        if (p.z() > terrain.at(p.x(), p.y())) break;
        occupancy.occupied[occupancy.grid.index({i, j, k})] = 1;
      }
    }
  }
}

/// The share of the region's free cells that a sphere of this radius can reach from above the pad.
double reachable_share(const World& world, const Bounds& region, double radius_m) {
  // The way to the region may lead outside it: the garage's ramp starts above the storey.
  Bounds flooded = region;
  flooded.high.z() = std::max(region.high.z(), world.X_WS.p.z() + kCheckedHeight);
  OccupancyGrid occupancy = voxelize(world, make_grid(flooded, kResolution), ClassSet::all());
  fill_below(world.terrain, occupancy);
  const Vec3 probe = world.X_WS.p + kProbeHeight * Vec3::UnitZ();
  const FreeSpace space = flood_free_space(occupancy, probe, radius_m);
  std::size_t passable = 0, reachable = 0;
  const Eigen::Vector3i& size = space.grid.size;
  for (int k = 0; k < size.z(); ++k) {
    if (space.grid.centre({0, 0, k}).z() > region.high.z()) break;
    const std::size_t first = space.grid.index({0, 0, k});
    const std::size_t count =
        static_cast<std::size_t>(size.x()) * static_cast<std::size_t>(size.y());
    for (std::size_t i = first; i < first + count; ++i) {
      passable += space.passable[i];
      reachable += space.reachable[i];
    }
  }
  return passable == 0 ? 0.0 : static_cast<double>(reachable) / static_cast<double>(passable);
}

}  // namespace

World build_world(const WorldConfig& config, std::uint64_t seed, double vehicle_radius_m,
                  const std::optional<Eigen::AlignedBox2d>& flown) {
  if (config.kind == WorldKind::kFile) {
    return load_file_world(config.file, vehicle_radius_m).world;
  }
  World world = with_recipe(config, [&](const auto& recipe) {
    if constexpr (requires { build(recipe, seed, flown); }) return build(recipe, seed, flown);
    return build(recipe, seed);
  });
  const Bounds region = region_to_reach(config, world, flown);
  const double share = reachable_share(world, region, vehicle_radius_m);
  if (share < kReachableShare) {
    const std::string name(enum_names(config.kind)[static_cast<std::size_t>(config.kind)]);
    throw ConfigError("the " + name + " recipe with seed " + std::to_string(seed) +
                      " leaves no free start: only " +
                      std::to_string(static_cast<int>(std::floor(100 * share))) +
                      " % of the free space can be reached from it, expected at least " +
                      std::to_string(static_cast<int>(100 * kReachableShare)) + " %");
  }
  return world;
}

Eigen::AlignedBox2d extent_of(const FileWorld& loaded) {
  const Pose X_SW = loaded.world.X_WS.inverse();
  Eigen::AlignedBox2d box;
  for (const double x : {loaded.reachable.low.x(), loaded.reachable.high.x()}) {
    for (const double y : {loaded.reachable.low.y(), loaded.reachable.high.y()}) {
      box.extend((X_SW * Vec3(x, y, loaded.world.X_WS.p.z())).head<2>());
    }
  }
  return box;
}

std::optional<Eigen::AlignedBox2d> extent_of(const WorldConfig& config) {
  if (config.kind == WorldKind::kFile) return {};
  return with_recipe(config, [](const auto& recipe) { return recipe.extent(); });
}

}  // namespace arex::worlds
