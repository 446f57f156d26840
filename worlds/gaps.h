#pragma once

#include <cmath>

#include "worlds/poisson_disc.h"
#include "worlds/world.h"

namespace arex::worlds {

/// A wall of pillars across the way with one opening of an exact width, for planner experiments;
/// the other slots between the pillars are too narrow for any vehicle. Level ground, the start at
/// the origin, heading along x towards the wall.
struct GapsRecipe {
  double length_m = 30;
  double width_m = 20;
  double wall_distance_m = 10;
  double pillar_radius_m = 0.2;
  double pillar_height_m = 4;
  double slot_m = 0.08;
  double gap_m = 1.0;
  double gap_offset_m = 0;
  double field_density_per_m2 = 0;
  double field_radius_min_m = 0.1;
  double field_radius_max_m = 0.3;
  double field_spacing_m = 1.6;
  double start_radius_m = 2.0;

  /// The ground, along x and y from the start, m.
  [[nodiscard]] Eigen::AlignedBox2d extent() const {
    return {Vec2(-start_radius_m, -0.5 * width_m), Vec2(length_m - start_radius_m, 0.5 * width_m)};
  }
  /// Whether the gap can be passed is the experiment.
  void limit_reach(Bounds& region) const { region.high.x() = wall_distance_m; }

  void fields(auto& f) {
    f("length_m", length_m, "extent along x: from start_radius_m behind the start");
    f("width_m", width_m, "extent along y, the start in its middle; walled all round");
    f("wall_distance_m", wall_distance_m, "x of the pillars' axes");
    f("pillar_radius_m", pillar_radius_m, "of the pillars in the wall");
    f("pillar_height_m", pillar_height_m, "of every pillar");
    f("slot_m", slot_m, "between the surfaces of neighbouring pillars");
    f("gap_m", gap_m, "between the surfaces of the two pillars at the opening");
    f("gap_offset_m", gap_offset_m, "y of the middle of the opening");
    f("field_density_per_m2", field_density_per_m2, "random pillars between start and wall");
    f("field_radius_min_m", field_radius_min_m, "thinnest pillar of the field");
    f("field_radius_max_m", field_radius_max_m, "thickest pillar of the field");
    f("field_spacing_m", field_spacing_m, "least distance between the axes of those pillars");
    f("start_radius_m", start_radius_m, "no pillar stands nearer to the start");
    f.check(start_radius_m >= 0.5, "start_radius_m >= 0.5");
    f.check(wall_distance_m > start_radius_m + pillar_radius_m,
            "wall_distance_m > start_radius_m + pillar_radius_m");
    f.check(length_m > wall_distance_m + 2 * start_radius_m && length_m <= 500,
            "wall_distance_m + 2 start_radius_m < length_m <= 500");
    f.check(pillar_radius_m >= 0.02 && pillar_radius_m <= 2, "0.02 <= pillar_radius_m <= 2");
    f.check(pillar_height_m > 0 && pillar_height_m <= 50, "0 < pillar_height_m <= 50");
    f.check(slot_m >= 0 && slot_m <= 0.3, "0 <= slot_m <= 0.3");
    f.check(gap_m > 0, "gap_m > 0");
    f.check(width_m <= 500 && 2 * std::abs(gap_offset_m) + gap_m < width_m,
            "2 |gap_offset_m| + gap_m < width_m <= 500");
    f.check(field_radius_min_m > 0 && field_radius_min_m <= field_radius_max_m,
            "0 < field_radius_min_m <= field_radius_max_m");
    f.check(field_spacing_m > 2 * field_radius_max_m, "field_spacing_m > 2 field_radius_max_m");
    f.check(field_spacing_m >= 0.2 && field_spacing_m <= 100, "0.2 <= field_spacing_m <= 100");
    f.check(field_density_per_m2 * length_m * width_m <= 20000,
            "at most 20000 pillars (field_density_per_m2 length_m width_m)");
    f.check(field_density_per_m2 >= 0 && can_pack(field_density_per_m2, field_spacing_m),
            "0 <= field_density_per_m2 <= 0.637 / field_spacing_m^2 (denser cannot be packed)");
  }
};

World build(const GapsRecipe& recipe, std::uint64_t seed);

/// Level ground and nothing else, the start in its middle.
struct EmptyRecipe {
  Vec2 size_m = {60, 50};
  double height_m = 10;

  [[nodiscard]] Eigen::AlignedBox2d extent() const { return {-0.5 * size_m, 0.5 * size_m}; }

  void fields(auto& f) {
    f("size_m", size_m, "extent of the ground along x and y");
    f("height_m", height_m, "of the world's bounds above the ground");
    f.check(size_m.minCoeff() >= 5 && size_m.maxCoeff() <= 500, "5 <= size_m <= 500");
    f.check(height_m > 0 && height_m <= 100, "0 < height_m <= 100");
  }
};

World build(const EmptyRecipe& recipe, std::uint64_t seed);

}  // namespace arex::worlds
