#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "semantics/level_surfaces.h"

namespace arex {

/// What of a cloud lies in the band, and which of its points that are.
struct Band {
  std::vector<Vec3f> points;
  std::vector<std::uint32_t> of_cloud;
};

/// The heights above each floor at which nothing but walls and pillars is looked for.
class BandHeights {
 public:
  static constexpr double kLow = 2.05;  ///< m above the floor: cars and cabinets end below

  explicit BandHeights(const Clearances& clearances) : clearances_(clearances) {
    std::vector<std::vector<float>> rooms;
    for (std::size_t i = 0; i < clearances.room.size(); ++i) {
      if (clearances.floor_of[i] < 0 || !std::isfinite(clearances.room[i])) continue;
      const auto floor = static_cast<std::size_t>(clearances.floor_of[i]);
      if (floor >= rooms.size()) rooms.resize(floor + 1);
      rooms[floor].push_back(clearances.room[i]);
    }
    for (std::vector<float>& room : rooms) {
      const auto mid = room.begin() + static_cast<std::ptrdiff_t>(room.size() / 2);
      if (!room.empty()) std::nth_element(room.begin(), mid, room.end());
      low_.push_back(room.empty() ? kLow : low_of(static_cast<double>(*mid)));
    }
  }
  /// Over a point's floor: where the storey as a whole is low, and not below a lone duct, the band
  /// begins lower.
  [[nodiscard]] double low(std::uint32_t point) const {
    const auto floor = static_cast<std::size_t>(clearances_.floor_of[point]);
    return floor < low_.size() ? low_[floor] : kLow;
  }
  /// Below a duct, or pipes side by side, which nothing hangs from, it is as high as it must be.
  [[nodiscard]] double high(std::uint32_t point) const {
    return std::max(high_of(static_cast<double>(clearances_.room[point])), low(point) + kLeastBand);
  }
  [[nodiscard]] bool has(std::uint32_t point) const {
    const auto above = static_cast<double>(clearances_.above_floor[point]);
    return clearances_.floor_of[point] >= 0 && above >= low(point) && above <= high(point);
  }

 private:
  static constexpr double kBandHigh = 2.75;      // m above the floor
  static constexpr double kBelowCeiling = 0.55;  // m: beams and pipes hang lower
  static constexpr double kLeastBand = 0.4;      // m

  static double high_of(double room) { return std::min(kBandHigh, room - kBelowCeiling); }
  static double low_of(double room) { return std::min(kLow, high_of(room) - kLeastBand); }
  const Clearances& clearances_;
  std::vector<double> low_;  ///< of each floor
};

inline Band band_of(const WorkingCloud& cloud, const BandHeights& heights) {
  Band band;
  for (std::uint32_t i = 0; i < cloud.points.size(); ++i) {
    if (!heights.has(i)) continue;
    band.points.push_back(cloud.points[i]);
    band.of_cloud.push_back(i);
  }
  return band;
}

}  // namespace arex
