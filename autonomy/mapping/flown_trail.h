#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "mapping/occupancy_map_2d.h"

namespace arex {

/// The cells of a 2D map that the vehicle's centre went through: what OccupancyMap2D::flown holds.
/// Single-threaded.
class FlownTrail {
 public:
  /// @param geometry origin, resolution and size of the map; its cells are not read
  explicit FlownTrail(OccupancyMap2D geometry)
      : geometry_(std::move(geometry)),
        seen_(static_cast<std::size_t>(geometry_.width) *
              static_cast<std::size_t>(geometry_.height)) {}

  /// The vehicle's next place, in O: all cells from the one before are part of the trail.
  void add(const Vec2& p);

  /// Indices of the cells, each once, in the order in which it came there.
  [[nodiscard]] const std::vector<std::uint32_t>& cells() const { return cells_; }

 private:
  OccupancyMap2D geometry_;
  std::vector<bool> seen_;
  std::vector<std::uint32_t> cells_;
  Vec2 last_ = Vec2::Zero();
  bool began_ = false;
};

}  // namespace arex
