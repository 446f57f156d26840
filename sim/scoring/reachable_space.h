#pragma once

#include <cstdint>
#include <vector>

#include "exploration/exploration_bounds.h"
#include "math/pose.h"
#include "worlds/occupancy.h"

namespace arex::sim {

/// What an exploration is scored over, in O: the region that the explorer is told to explore,
/// between two heights, as far as it can be reached from where exploring begins.
struct ScoredRegion {
  ExplorationBounds bounds;
  double low_m = 0;
  double high_m = 0;
  Vec3 start_O = Vec3::Zero();

  /// The box in O that holds it.
  [[nodiscard]] worlds::Bounds extent() const {
    const Eigen::AlignedBox2d area = bounds.extent();
    return {{area.min().x(), area.min().y(), low_m}, {area.max().x(), area.max().y(), high_m}};
  }
};

/// Where the vehicle's centre can get to from its start without leaving the exploration bounds.
struct ReachableSpace {
  worlds::GridGeometry grid;            ///< in W
  std::vector<std::uint8_t> reachable;  ///< one per cell, 1 where it can
  std::size_t count = 0;                ///< of those cells

  [[nodiscard]] bool at(const Vec3& p_W) const {
    const Eigen::Vector3i cell = grid.cell_of(p_W);
    return grid.contains(cell) && reachable[grid.index(cell)] != 0;
  }
  [[nodiscard]] double volume_m3() const {
    return static_cast<double>(count) * grid.resolution_m * grid.resolution_m * grid.resolution_m;
  }
};

struct ReachableSpaceConfig {
  double resolution_m = 0.1;
  double start_search_m = 1.5;
  double margin_m = 0.5;

  void fields(auto& f) {
    f("resolution_m", resolution_m, "cells of the true free space (the map's resolution)");
    f("start_search_m", start_search_m, "how far above the start the vehicle first has room");
    f("margin_m", margin_m, "surfaces this far outside the bounds still belong to them");
    f.check(resolution_m >= 0.05 && resolution_m <= 2, "0.05 <= resolution_m <= 2");
    f.check(start_search_m >= 0 && start_search_m <= 100, "0 <= start_search_m <= 100");
    f.check(margin_m >= 0 && margin_m <= 100, "0 <= margin_m <= 100");
  }
};

/// Flood fill over face neighbours, leaves left out (they give way), from the first cell at or
/// above the region's start where a sphere of the vehicle's radius fits. It neither passes nor ends
/// outside the region, nor outside the world.
/// @param X_WO O in W; level, as O is gravity-aligned
/// @throws std::invalid_argument if the vehicle does not fit at its start
ReachableSpace find_reachable_space(const worlds::World& world, const Pose& X_WO,
                                    const ScoredRegion& region, double vehicle_radius_m,
                                    const ReachableSpaceConfig& config = {});

}  // namespace arex::sim
