#pragma once

#include <numbers>
#include <vector>

#include "math/pose.h"
#include "math/random.h"
#include "messages/vehicle.h"
#include "worlds/forest.h"
#include "worlds/mesh_builder.h"
#include "worlds/world.h"

namespace arex::sim {

/// A camera at the origin of B, z along B's x.
inline Pose forward_camera() { return {VehicleConfig{}.X_BC().R, Vec3::Zero()}; }

/// One quad of half side `half_side_m` through `point` with normal `normal`.
inline worlds::World plane_world(const Vec3& point, const Vec3& normal, double half_side_m) {
  worlds::MeshBuilder builder;
  const auto wall = builder.add_object(worlds::SurfaceClass::kWall, 0.5);
  const Vec3 x = normal.unitOrthogonal() * half_side_m;
  const Vec3 y = normal.normalized().cross(x);
  builder.add_quad(wall, point - x - y, point + x - y, point + x + y, point - x + y);
  return builder.finish();
}

/// Twenty tilted boxes and a floor, 2 to 9 m ahead along x.
inline worlds::World box_world(std::uint64_t seed) {
  RandomStream random(seed, "boxes");
  worlds::MeshBuilder builder;
  const auto floor = builder.add_object(worlds::SurfaceClass::kFloor, 0.5);
  builder.add_box(floor, {Mat3::Identity(), Vec3(8, 0, -1.5)}, {12, 12, 0.1});
  for (int i = 0; i < 20; ++i) {
    const auto box = builder.add_object(worlds::SurfaceClass::kCar, 0.5);
    const Vec3 centre(random.uniform(2, 9), random.uniform(-4, 4), random.uniform(-1, 2));
    const Vec3 half(random.uniform(0.1, 0.5), random.uniform(0.1, 0.5), random.uniform(0.1, 0.5));
    builder.add_box(box, {so3::Exp(random.normal3()), centre}, half);
  }
  return builder.finish();
}

/// A forest small enough for unit tests.
inline worlds::World small_forest(std::uint64_t seed) {
  worlds::ForestRecipe recipe;
  recipe.size_m = {24, 20};
  recipe.edge_m = 1;
  return worlds::build(recipe, seed);
}

/// A pose of B in flight over `world`'s terrain: any heading, tilted by up to 20 degrees.
inline Pose flying_pose(const worlds::World& world, RandomStream& random) {
  const double x = random.uniform(-9, 9), y = random.uniform(-7, 7);
  const Vec3 tilt(random.uniform(-0.35, 0.35), random.uniform(-0.35, 0.35), 0);
  return {so3::from_yaw(random.uniform(-std::numbers::pi, std::numbers::pi)) * so3::Exp(tilt),
          Vec3(x, y, world.terrain.at(x, y) + random.uniform(0.5, 3))};
}

}  // namespace arex::sim
