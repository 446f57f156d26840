#pragma once

#include <limits>
#include <span>

#include "math/pose.h"
#include "scoring/figures.h"
#include "scoring/reachable_space.h"
#include "sensors/scene.h"
#include "worlds/world.h"

namespace arex::sim {

struct WorldComplexityConfig {
  double spacing_m = 1.0;
  int directions = 32;
  double range_m = 20.0;

  void fields(auto& f) {
    f("spacing_m", spacing_m, "between the places in the area that one looks from");
    f("directions", directions, "that one looks in from each");
    f("range_m", range_m, "and how far");
    f.check(spacing_m >= 0.1 && spacing_m <= 100, "0.1 <= spacing_m <= 100");
    f.check(directions >= 4 && directions <= 3600, "4 <= directions <= 3600");
    f.check(range_m >= 0.5 && range_m <= 200, "0.5 <= range_m <= 200");
  }
};

/// How hard a world is to see through and to fly through. Not a number: there is nothing to measure
/// it by.
struct WorldComplexity {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  double stems_per_m2 = kUnknown;      ///< trunks with their foot in the region
  double mean_free_path_m = kUnknown;  ///< of a horizontal line of sight
  double traversability = kUnknown;    ///< mean straight flight, in radii of the vehicle
};

/// Looks around horizontally from places of the area, at the height of its cells.
///
/// Both means are the way covered in all directions over the number of times it ended at something,
/// as a mean free path is; so neither the range, nor the rim of what is explored, where a way ends
/// without an obstacle, makes the world look harder than it is. A line of sight ends at surfaces
/// other than leaves and terrain (the height follows the terrain, the line does not); a straight
/// flight where the vehicle does not fit any more, that is, where the area ends.
/// Source: Nous et al., Performance evaluation in obstacle avoidance, IROS 2016 (traversability:
/// mean straight way to a collision over the radius of the vehicle, from places and in directions
/// drawn at random; here they are on a lattice).
///
/// @param scene of `world`; @param X_WO O in W; level
/// @param area_cells_W middles of the area's square cells of side cell_m, as CoverageScorer counts
WorldComplexity measure_complexity(const WorldComplexityConfig& config, const worlds::World& world,
                                   const Scene& scene, const Pose& X_WO, const ScoredRegion& region,
                                   std::span<const Vec3f> area_cells_W, double cell_m,
                                   double vehicle_radius_m);

/// Sets the figures `world.*`.
void add_figures(const WorldComplexity& complexity, Figures& figures);

}  // namespace arex::sim
