#include "worlds/gaps.h"

#include <cmath>
#include <numbers>
#include <vector>

#include "worlds/level_ground.h"
#include "worlds/mesh_builder.h"
#include "worlds/poisson_disc.h"
#include "worlds/reflectivity.h"

namespace arex::worlds {
namespace {

/// A pillar whose drawn surface touches its round solid at y = +-radius exactly, where gaps are
/// measured, and lies within it elsewhere.
void add_round_pillar(MeshBuilder& builder, const Vec2& p, double radius, double height,
                      RandomStream& random) {
  constexpr int kSides = 24;
  const std::uint32_t object =
      builder.add_object(SurfaceClass::kPillar, kConcreteReflectivity.draw(random));
  std::vector<Vec2> outline;
  for (int k = 0; k < kSides; ++k) {
    const double angle = 2 * std::numbers::pi * k / kSides;
    outline.emplace_back(radius * std::sin(angle), radius * std::cos(angle));
  }
  const Pose X_WP{Mat3::Identity(), {p.x(), p.y(), 0}};
  builder.add_prism(object, X_WP, outline, 0, height);
  builder.add_collision_cylinder(object, {Mat3::Identity(), {p.x(), p.y(), height / 2}}, radius,
                                 height / 2);
}

}  // namespace

World build(const GapsRecipe& recipe, std::uint64_t seed) {
  constexpr double kWallThickness = 0.2;
  MeshBuilder builder;
  RandomStream random(seed, "worlds/gaps");
  const Vec2 low(-recipe.start_radius_m, -recipe.width_m / 2);
  const Vec2 high(recipe.length_m - recipe.start_radius_m, recipe.width_m / 2);
  builder.add_height_field(
      builder.add_object(SurfaceClass::kGround, kConcreteReflectivity.draw(random)),
      level_ground(low, high));

  // The row starts at both lips of the opening and runs outwards to the side walls.
  const double radius = recipe.pillar_radius_m;
  for (const double side : {-1.0, 1.0}) {
    double y = recipe.gap_offset_m + side * (recipe.gap_m / 2 + radius);
    while (std::abs(y) - radius < recipe.width_m / 2) {
      add_round_pillar(builder, {recipe.wall_distance_m, y}, radius, recipe.pillar_height_m,
                       random);
      y += side * (2 * radius + recipe.slot_m);
    }
    builder.add_solid_box(
        builder.add_object(SurfaceClass::kWall, kConcreteReflectivity.draw(random)),
        {Mat3::Identity(),
         {(low.x() + high.x()) / 2, side * (recipe.width_m + kWallThickness) / 2,
          recipe.pillar_height_m / 2}},
        {recipe.length_m / 2, kWallThickness / 2, recipe.pillar_height_m / 2});
  }

  // Where nothing returns a ray, nothing shows that the space before it is free: the ends are
  // walled too.
  for (const double x : {low.x() - kWallThickness / 2, high.x() + kWallThickness / 2}) {
    builder.add_solid_box(
        builder.add_object(SurfaceClass::kWall, kConcreteReflectivity.draw(random)),
        {Mat3::Identity(), {x, 0, recipe.pillar_height_m / 2}},
        {kWallThickness / 2, recipe.width_m / 2, recipe.pillar_height_m / 2});
  }

  // The field ends a vehicle's length before the wall, so that the gap alone decides there.
  constexpr double kApproach = 1.5;
  const double margin = recipe.field_radius_max_m;
  const Vec2 field_high(recipe.wall_distance_m - radius - kApproach, recipe.width_m / 2 - margin);
  const Vec2 field_low(low.x() + margin, low.y() + margin);
  for (const Vec2& p : scatter_discs(field_low, field_high, recipe.field_density_per_m2,
                                     recipe.field_spacing_m, random.fork(0))) {
    const double r = random.uniform(recipe.field_radius_min_m, recipe.field_radius_max_m);
    if (p.norm() < recipe.start_radius_m + r) continue;
    add_round_pillar(builder, p, r, recipe.pillar_height_m, random);
  }
  return builder.finish();
}

World build(const EmptyRecipe& recipe, std::uint64_t seed) {
  MeshBuilder builder;
  RandomStream random(seed, "worlds/empty");
  builder.add_height_field(
      builder.add_object(SurfaceClass::kGround, kForestFloorReflectivity.draw(random)),
      level_ground(-0.5 * recipe.size_m, 0.5 * recipe.size_m));
  World world = builder.finish();
  world.bounds.high.z() = recipe.height_m;
  return world;
}

}  // namespace arex::worlds
