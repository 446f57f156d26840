#pragma once

#include <vector>

#include "exploration/exploration_space.h"

namespace arex {

/// A point of the border between known-free and unknown space.
struct FrontierPoint {
  Vec2 point = Vec2::Zero();      ///< CG: centre of an unknown cell beside a known-free one, in O
  Vec2 seen_from = Vec2::Zero();  ///< a known-free point from which a free line leads there, in O
};

/// One connected piece of that border.
struct Frontier {
  std::vector<Eigen::Vector2i> cells;  ///< known free, 8-connected, ascending map index
  double length_m = 0;                 ///< cells times resolution
  double unknown_area_m2 = 0;          ///< the largest f_I of its cells' unknown neighbours
  /// Places to fly to: the one with the largest f_I first, then each the next best outside the
  /// information radius of those before, until the whole frontier is within that of one.
  std::vector<FrontierPoint> points;
};

/// All frontiers that the vehicle can reach: the connected components of known-free cells that
/// border unknown cells inside the bounds and to which known-free cells at the travel radius lead.
/// Exhaustive: the detector's oracle, and the final word before 'no candidates left'.
[[nodiscard]] std::vector<Frontier> find_frontiers(const ExplorationSpace& space);

}  // namespace arex
