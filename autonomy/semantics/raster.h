#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "math/types.h"

namespace arex {

/// A picture of the map from above: one number per square cell, x fastest.
struct Raster {
  Vec2 low = Vec2::Zero();  ///< x, y of the lower corner of cell (0, 0), m
  double cell_m = 1;
  int columns = 0;  ///< along x
  int rows = 0;     ///< along y
  std::vector<float> values;

  Raster() = default;
  /// Covers [low, high] with cells of one value.
  Raster(const Vec2& low_, const Vec2& high, double cell, float value)
      : low(low_),
        cell_m(cell),
        columns(1 + static_cast<int>(std::floor((high.x() - low_.x()) / cell))),
        rows(1 + static_cast<int>(std::floor((high.y() - low_.y()) / cell))),
        values(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), value) {}

  [[nodiscard]] int column_of(double x) const {
    return std::clamp(static_cast<int>(std::floor((x - low.x()) / cell_m)), 0, columns - 1);
  }
  [[nodiscard]] int row_of(double y) const {
    return std::clamp(static_cast<int>(std::floor((y - low.y()) / cell_m)), 0, rows - 1);
  }
  [[nodiscard]] std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
           static_cast<std::size_t>(column);
  }
  [[nodiscard]] bool contains(int column, int row) const {
    return column >= 0 && row >= 0 && column < columns && row < rows;
  }
  /// The cell of a point, clamped to the border.
  [[nodiscard]] std::size_t cell_of(double x, double y) const {
    return index(column_of(x), row_of(y));
  }
  [[nodiscard]] Vec2 centre(int column, int row) const {
    return low + cell_m * Vec2(column + 0.5, row + 0.5);
  }
  /// Bilinear between the cells' middles, clamped to the border. @pre no NaN around
  [[nodiscard]] double interpolate(double x, double y) const {
    const double u = std::clamp((x - low.x()) / cell_m - 0.5, 0.0, columns - 1.0);
    const double v = std::clamp((y - low.y()) / cell_m - 0.5, 0.0, rows - 1.0);
    const int i = std::min(static_cast<int>(u), std::max(0, columns - 2));
    const int j = std::min(static_cast<int>(v), std::max(0, rows - 2));
    const int i1 = std::min(i + 1, columns - 1), j1 = std::min(j + 1, rows - 1);
    const double a = u - i, b = v - j;
    const auto value = [&](int c, int r) { return static_cast<double>(values[index(c, r)]); };
    return (1 - b) * ((1 - a) * value(i, j) + a * value(i1, j)) +
           b * ((1 - a) * value(i, j1) + a * value(i1, j1));
  }
};

}  // namespace arex
