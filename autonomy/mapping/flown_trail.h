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
  /// Two places further apart than this were not flown between: the pose has jumped, or somebody
  /// else flew in the meantime. Far more than the 2 cm between two control steps.
  static constexpr double kLongestStep_m = 1.0;

  /// @param geometry origin, resolution and size of the map; its cells are not read
  explicit FlownTrail(OccupancyMap2D geometry)
      : geometry_(std::move(geometry)),
        seen_(static_cast<std::size_t>(geometry_.width) *
              static_cast<std::size_t>(geometry_.height)) {}

  /// The vehicle's next place, in O: all cells from the one before are part of the trail.
  void add(const Vec3& p_O);

  /// Indices of the cells, each once, in the order in which it came there.
  [[nodiscard]] const std::vector<std::uint32_t>& cells() const { return cells_; }
  /// How high it was in each of them when it first came there, m in O.
  [[nodiscard]] const std::vector<float>& heights_m() const { return heights_m_; }

 private:
  OccupancyMap2D geometry_;
  std::vector<bool> seen_;
  std::vector<std::uint32_t> cells_;
  std::vector<float> heights_m_;
  Vec2 last_ = Vec2::Zero();
  bool began_ = false;
};

}  // namespace arex
