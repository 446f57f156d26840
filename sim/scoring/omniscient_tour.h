#pragma once

#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "math/pose.h"
#include "scoring/figures.h"
#include "scoring/reachable_space.h"
#include "worlds/world.h"

namespace arex::sim {

struct OmniscientTourConfig {
  bool enabled = true;
  double area_share = 0.99;
  double range_m = 20.0;
  double slab_m = 0.5;
  double viewpoint_spacing_m = 2.0;
  double sight_step_m = 1.0;
  double resolution_m = 0.2;
  double max_area_m2 = 10000;
  double corner_cut_m = 0.2;
  int looks = 2500;
  int perturbations = 200;

  void fields(auto& f) {
    f("enabled", enabled,
      "explorations are compared with the tour of somebody who knows the world");
    f("area_share", area_share, "the tour sees this share of what all viewpoints together see");
    f("range_m", range_m, "it sees this far (the map's ray length)");
    f("slab_m", slab_m, "height of the slab that must be half full of surface to block its view");
    f("viewpoint_spacing_m", viewpoint_spacing_m, "one place to see from in each square this wide");
    f("sight_step_m", sight_step_m, "on its way it looks around this often");
    f("resolution_m", resolution_m, "cells of the space that it flies through");
    f("max_area_m2", max_area_m2,
      "there is no tour where the box around the area is larger: time and memory grow faster than "
      "it");
    f("corner_cut_m", corner_cut_m, "how far it leaves a corner to round it");
    f("looks", looks,
      "it begins anew with other viewpoints, for the shortest of the tours, until it has looked "
      "around from so many places");
    f("perturbations", perturbations, "of the order of its viewpoints, each improved again");
    f.check(area_share > 0 && area_share <= 1, "0 < area_share <= 1");
    f.check(range_m >= 0.5 && range_m <= 100, "0.5 <= range_m <= 100");
    f.check(slab_m >= 0.1 && slab_m <= 5, "0.1 <= slab_m <= 5");
    f.check(viewpoint_spacing_m >= 0.5 && viewpoint_spacing_m <= 100,
            "0.5 <= viewpoint_spacing_m <= 100");
    f.check(sight_step_m >= 0.2 && sight_step_m <= 100, "0.2 <= sight_step_m <= 100");
    f.check(resolution_m >= 0.05 && resolution_m <= 2, "0.05 <= resolution_m <= 2");
    f.check(max_area_m2 >= 0, "max_area_m2 >= 0");
    f.check(corner_cut_m >= 0.01 && corner_cut_m <= 2, "0.01 <= corner_cut_m <= 2");
    f.check(looks >= 0 && looks <= 1000000, "0 <= looks <= 1000000");
    f.check(perturbations >= 0 && perturbations <= 100000, "0 <= perturbations <= 100000");
  }
};

/// How the vehicle moves, as its own planner is told.
struct TourMotion {
  double max_speed_mps = 2.0;
  double max_acceleration_mps2 = 3.0;
  double climb_speed_mps = 0.8;
  double landing_speed_mps = 0.4;
};

/// What the mission prescribes and the tour cannot choose.
struct TourMission {
  double takeoff_height_m = 1.5;
  std::vector<Vec3> entry_O;  ///< flown after take-off, before exploring
  bool returns = true;        ///< it lands where it started
  TourMotion motion;
};

/// The tour of somebody who knows the world.
struct OmniscientTour {
  std::vector<Vec3> path_W;        ///< corners, from the ground to the ground, m
  std::vector<Vec3> viewpoints_W;  ///< that it is led through, in their order
  double path_m = 0;
  double time_s = 0;
  double area_fraction = 0;  ///< share of the area that it sees
};

/// The path and the time that covering this world takes whoever knows it: what an exploration is to
/// be measured by.
///
/// Viewpoints on a lattice of places that can be flown to, each with the patches of the area that
/// are in sight from there (SightMap); greedily those that show most, until area_share of what all
/// of them show is covered; a short tour through these (FlightWays, order_tour). What is seen on
/// the way between them counts as well. So viewpoints that the rest of the tour makes needless are
/// dropped, and the others moved to where the way is shorter, as long as the tour still sees its
/// share; all that from several covers, and the shortest tour counts. Start, entry and landing are
/// the mission's. Time is that of flight_time.
///
/// Cover, tour and moves are heuristic: the tour is one that can be flown, an upper bound of the
/// shortest, not a lower bound of all. On the other hand its sensor misses nothing in range and
/// line of sight. It is a measure to hold flights against, not a proof that none does better.
/// Source: Gonzalez-Banos and Latombe, A randomized art-gallery algorithm for sensor placement,
/// 2001 (viewpoints by greedy cover); Cao et al., TARE, RSS 2021 (a tour through viewpoints).
///
/// @param X_WO O in W; level
/// @param area_cells_W what CoverageScorer counts the area by
/// @return nothing if there is no area, too much of it, or no room where it starts
std::optional<OmniscientTour> plan_omniscient_tour(const OmniscientTourConfig& config,
                                                   const worlds::World& world, const Pose& X_WO,
                                                   const ScoredRegion& region,
                                                   double vehicle_radius_m,
                                                   std::span<const Vec3f> area_cells_W,
                                                   const TourMission& mission);

/// Shortest time along a polyline from rest to rest: the speed is limited everywhere, at a corner
/// also by the acceleration across the arc that rounds it and leaves it by corner_cut_m, and the
/// acceleration along.
/// Source: Jeon, Improving Grbl: cornering algorithm, 2011 (the arc).
double flight_time(std::span<const Vec3> path_W, double max_speed_mps, double max_acceleration_mps2,
                   double corner_cut_m);

/// Sets the figures `tour.*`. @param flown_m, flown_s path and time of a flight that ended well;
/// not a number: it did not, and has no ratio
void add_figures(const OmniscientTour& tour, double flown_m, double flown_s, Figures& figures);

}  // namespace arex::sim
