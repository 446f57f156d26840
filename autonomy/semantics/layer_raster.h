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

  /// Without points.
  LayerRaster(const Vec3f& low, const Vec3f& high) : low_(low) {
    const double area =
        static_cast<double>(high.x() - low.x()) * static_cast<double>(high.y() - low.y());
    cell_ = static_cast<float>(std::max(kCell, std::sqrt(area / kMostCells)));
    columns_ = 1 + static_cast<int>((high.x() - low_.x()) / cell_);
    rows_ = 1 + static_cast<int>((high.y() - low_.y()) / cell_);
    masks_.resize(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), 0);
  }
  LayerRaster(const WorkingCloud& cloud, const std::vector<float>& heights)
      : LayerRaster(cloud.low, cloud.high) {
    for (std::size_t i = 0; i < cloud.points.size(); ++i) {
      const double layer = (static_cast<double>(heights[i]) - kLowest) / kLayer;
      if (!(layer >= 0 && layer < kLayers)) continue;
      const int c =
          std::min(columns_ - 1, static_cast<int>((cloud.points[i].x() - low_.x()) / cell_));
      const int r = std::min(rows_ - 1, static_cast<int>((cloud.points[i].y() - low_.y()) / cell_));
      masks_[at(c, r)] |= std::uint64_t{1} << static_cast<int>(layer);
    }
  }
  [[nodiscard]] bool covers(const Vec2& p) const {
    const Vec2 cell = (p - low_.head<2>().cast<double>()) / static_cast<double>(cell_);
    return cell.minCoeff() >= 0 && cell.x() < columns_ && cell.y() < rows_;
  }
  /// @pre covers(p)
  [[nodiscard]] std::size_t cell_of(const Vec2& p) const {
    const Vec2 cell = (p - low_.head<2>().cast<double>()) / static_cast<double>(cell_);
    return at(std::min(columns_ - 1, static_cast<int>(cell.x())),
              std::min(rows_ - 1, static_cast<int>(cell.y())));
  }
  [[nodiscard]] int column(std::size_t cell) const {
    return static_cast<int>(cell % static_cast<std::size_t>(columns_));
  }
  [[nodiscard]] int row(std::size_t cell) const {
    return static_cast<int>(cell / static_cast<std::size_t>(columns_));
  }
  [[nodiscard]] bool empty(std::size_t cell) const { return masks_[cell] == 0; }
  /// @return whether that layer was empty before; false for heights that no layer has
  bool add(std::size_t cell, double height) {
    const double layer = (height - kLowest) / kLayer;
    if (!(layer >= 0 && layer < kLayers)) return false;
    const std::uint64_t bit = std::uint64_t{1} << static_cast<int>(layer);
    const bool fresh = (masks_[cell] & bit) == 0;
    masks_[cell] |= bit;
    return fresh;
  }
  void clear(std::size_t cell) { masks_[cell] = 0; }
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
