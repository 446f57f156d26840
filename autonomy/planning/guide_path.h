#pragma once

#include <array>
#include <span>
#include <string_view>
#include <vector>

#include "mapping/occupancy_map_2d.h"
#include "math/types.h"

namespace arex {

enum class GuideMode { kStraight, kAstar };
inline const std::array<std::string_view, 2>& enum_names(GuideMode) {
  static const std::array<std::string_view, 2> names{"straight", "astar"};
  return names;
}

struct GuideConfig {
  GuideMode mode = GuideMode::kAstar;
  double margin_m = 0.1;             ///< beyond the inflation: a cell
  double obstacle_distance_m = 0.6;  ///< handed down: planning.inflation_m + margin_m
  double comfort_distance_m = 1.5;   ///< nearer than this costs more, linearly
  double comfort_weight = 2.0;       ///< at obstacle_distance_m, per metre flown
  double unknown_weight = 2.0;       ///< extra cost of a metre through the unknown
  bool follow_ground = false;        ///< handed down from exploration.follow_ground
  int max_expansions = 2'000'000;

  void fields(auto& f) {
    f("mode", mode, "global guide: straight line, or A* over the 2D map");
    f("margin_m", margin_m, "kept from occupied cells beyond planning.inflation_m");
    f("comfort_distance_m", comfort_distance_m, "distance below which flying costs more");
    f("comfort_weight", comfort_weight, "extra cost of a metre at the obstacle distance");
    f("unknown_weight", unknown_weight, "extra cost of a metre through unknown cells");
    f("max_expansions", max_expansions, "A* expansions");
    f.check(margin_m >= 0 && margin_m <= 10, "0 <= margin_m <= 10");
    f.check(max_expansions >= 1, "max_expansions >= 1");
    f.check(comfort_distance_m >= 0 && comfort_distance_m <= 20, "0 <= comfort_distance_m <= 20");
    f.check(unknown_weight >= 0, "unknown_weight >= 0");
  }
};

enum class GuideStatus {
  kFound,
  kPartial,  ///< the target cannot be reached: the path ends where it comes nearest
};

struct GuidePath {
  GuideStatus status = GuideStatus::kPartial;
  std::vector<Vec2> points;  ///< polyline in O from the start, m
  double cost = 0;
  int expansions = 0;
};

/// The guide for goals further than the local grid: an 8-connected A* over the 2D occupancy map,
/// corners not cut, then pulled straight where that is no dearer. Outside the map everything is
/// unknown, and unknown cells may be crossed at a cost. Start and goal may lie too close to
/// obstacles: the cells within obstacle_distance_m of either may be crossed unless occupied. Cells
/// that were flown through may always be crossed. Known-free cells that are nearer to obstacles by
/// a cell may be where there is no other way: what the explorer calls reachable is not closed here.
/// A target that cannot be reached may be as near from several places: the two sides of a wall, of
/// which now one, now the other is nearer by a cell as scans come in. The path ends on the side
/// that costs least to get to, which the way there only makes cheaper.
[[nodiscard]] GuidePath plan_guide(const OccupancyMap2D& map, const Vec2& from, const Vec2& to,
                                   const GuideConfig& config);

/// Gives a 2D polyline heights, linear in its length.
[[nodiscard]] std::vector<Vec3> lift_path(std::span<const Vec2> path, double from_z, double to_z);

/// The same over mapped ground: what is linear in the length is the height above it, so that the
/// path follows slopes, with a point each half metre. Where no ground is known it stays level.
[[nodiscard]] std::vector<Vec3> lift_path(std::span<const Vec2> path, double from_z, double to_z,
                                          const GroundHeights& ground);

/// From p to the nearest point of a polyline and along it to its end, m.
[[nodiscard]] double length_ahead(std::span<const Vec3> path, const Vec3& p);

/// The point of a polyline `ahead_m` further on than its point nearest to p; its end if shorter.
[[nodiscard]] Vec3 point_ahead(std::span<const Vec3> path, const Vec3& p, double ahead_m);

}  // namespace arex
