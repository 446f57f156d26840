#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "semantics/working_cloud.h"

namespace arex {

/// From above: each cell holds the set of layers above the ground that have points.
class LayerRaster {
 public:
  static constexpr double kLayer = 0.1;   ///< m
  static constexpr double kLowest = 0.2;  ///< m above the ground, first layer
  static constexpr int kLayers = 64;

  LayerRaster(const WorkingCloud& cloud, const std::vector<float>& heights) : low_(cloud.low) {
    const double area = static_cast<double>(cloud.high.x() - cloud.low.x()) *
                        static_cast<double>(cloud.high.y() - cloud.low.y());
    cell_ = static_cast<float>(std::max(kCell, std::sqrt(area / kMostCells)));
    columns_ = 1 + static_cast<int>((cloud.high.x() - low_.x()) / cell_);
    rows_ = 1 + static_cast<int>((cloud.high.y() - low_.y()) / cell_);
    masks_.resize(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), 0);
    for (std::size_t i = 0; i < cloud.points.size(); ++i) {
      const double layer = (static_cast<double>(heights[i]) - kLowest) / kLayer;
      if (!(layer >= 0 && layer < kLayers)) continue;
      const int c =
          std::min(columns_ - 1, static_cast<int>((cloud.points[i].x() - low_.x()) / cell_));
      const int r = std::min(rows_ - 1, static_cast<int>((cloud.points[i].y() - low_.y()) / cell_));
      masks_[at(c, r)] |= std::uint64_t{1} << static_cast<int>(layer);
    }
  }
  [[nodiscard]] int columns() const { return columns_; }
  [[nodiscard]] int rows() const { return rows_; }
  [[nodiscard]] bool empty(int c, int r) const { return masks_[at(c, r)] == 0; }
  [[nodiscard]] std::uint64_t around(int c, int r) const {
    std::uint64_t mask = 0;
    for (int j = std::max(0, r - 1); j <= std::min(rows_ - 1, r + 1); ++j) {
      for (int i = std::max(0, c - 1); i <= std::min(columns_ - 1, c + 1); ++i) {
        mask |= masks_[at(i, j)];
      }
    }
    return mask;
  }
  [[nodiscard]] Vec2 centre(int c, int r) const {
    return {static_cast<double>(low_.x()) + static_cast<double>(cell_) * (c + 0.5),
            static_cast<double>(low_.y()) + static_cast<double>(cell_) * (r + 0.5)};
  }
  [[nodiscard]] std::size_t cells() const { return masks_.size(); }
  /// Calls visit(cell) for the cells whose middles are within `radius` of a place.
  template <class Visit>
  void visit(const Vec2& place, double radius, Visit visit) const {
    const int reach = static_cast<int>(std::ceil(radius / static_cast<double>(cell_)));
    const int c0 =
        static_cast<int>((place.x() - static_cast<double>(low_.x())) / static_cast<double>(cell_));
    const int r0 =
        static_cast<int>((place.y() - static_cast<double>(low_.y())) / static_cast<double>(cell_));
    for (int r = std::max(0, r0 - reach); r <= std::min(rows_ - 1, r0 + reach); ++r) {
      for (int c = std::max(0, c0 - reach); c <= std::min(columns_ - 1, c0 + reach); ++c) {
        if ((centre(c, r) - place).norm() < radius) visit(at(c, r));
      }
    }
  }
  [[nodiscard]] std::size_t at(int c, int r) const {
    return static_cast<std::size_t>(r) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(c);
  }

 private:
  static constexpr double kCell = 0.1;  // m
  static constexpr double kMostCells = 4e7;

  Vec3f low_;
  float cell_ = 0;
  int columns_ = 0, rows_ = 0;
  std::vector<std::uint64_t> masks_;
};

}  // namespace arex
