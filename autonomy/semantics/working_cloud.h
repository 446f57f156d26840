#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "math/types.h"

namespace arex {

/// The point seen from above.
inline Vec2 flat(const Vec3f& p) { return p.head<2>().cast<double>(); }

/// A cloud as the detectors want it: numbers only, thinned to a mean per voxel, in an order that is
/// a function of the set of points alone. Points that lie kilometres off are left out.
struct WorkingCloud {
  static constexpr std::uint32_t kNone = 0xffffffffU;
  /// More cells of kCell than this are too many for a picture from above.
  static constexpr double kMostCells = 3.2e7;
  static constexpr double kCell = 0.2;  ///< m

  std::vector<Vec3f> points;
  std::vector<std::uint32_t> of_input;              ///< per input point: its point here, or kNone
  Vec3f low = Vec3f::Zero(), high = Vec3f::Zero();  ///< the box around the points

  /// @throws ConfigError if the cloud spans more than can be mapped at once.
  WorkingCloud(std::span<const Vec3f> input, double voxel_m);
};

/// Points by square columns: those of one cell lie side by side, from the lowest to the highest.
class ColumnIndex {
 public:
  ColumnIndex(const std::vector<Vec3f>& points, const Vec3f& low, const Vec3f& high, double cell_m);

  [[nodiscard]] int columns() const { return columns_; }
  [[nodiscard]] int rows() const { return rows_; }
  [[nodiscard]] float cell_m() const { return cell_; }
  [[nodiscard]] int column_of(float x) const { return clamped(x - low_.x(), columns_); }
  [[nodiscard]] int row_of(float y) const { return clamped(y - low_.y(), rows_); }
  /// Indices of the points in a cell, by height.
  [[nodiscard]] std::span<const std::uint32_t> at(int column, int row) const {
    const std::size_t i = static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
                          static_cast<std::size_t>(column);
    return {order_.data() + start_[i], start_[i + 1] - start_[i]};
  }

  /// Calls visit(index) for every point whose x, y are within `radius` of (x, y).
  template <class Visit>
  void within(float x, float y, float radius, Visit visit) const {
    constexpr float kAny = std::numeric_limits<float>::infinity();
    within(x, y, radius, -kAny, kAny, visit);
  }
  /// Of these, those from z_low up to z_high.
  template <class Visit>
  void within(float x, float y, float radius, float z_low, float z_high, Visit visit) const {
    const int c0 = column_of(x - radius), c1 = column_of(x + radius);
    const int r0 = row_of(y - radius), r1 = row_of(y + radius);
    for (int r = r0; r <= r1; ++r) {
      for (int c = c0; c <= c1; ++c) {
        const std::span<const std::uint32_t> cell = at(c, r);
        const auto first = std::partition_point(
            cell.begin(), cell.end(), [&](std::uint32_t i) { return (*points_)[i].z() < z_low; });
        for (auto it = first; it != cell.end() && (*points_)[*it].z() <= z_high; ++it) {
          const std::uint32_t i = *it;
          const float dx = (*points_)[i].x() - x, dy = (*points_)[i].y() - y;
          if (dx * dx + dy * dy <= radius * radius) visit(i);
        }
      }
    }
  }

 private:
  [[nodiscard]] int clamped(float offset, int count) const {
    const float cell = offset / cell_;
    return cell <= 0 ? 0 : cell >= static_cast<float>(count) ? count - 1 : static_cast<int>(cell);
  }

  const std::vector<Vec3f>* points_;
  Vec3f low_;
  float cell_;
  int columns_, rows_;
  std::vector<std::uint32_t> start_, order_;
};

}  // namespace arex
