#pragma once

#include <cmath>
#include <cstdlib>
#include <limits>

#include "mapping/occupancy_map_2d.h"

namespace arex {

/// Visits, in order, every cell that the segment from a to b passes through, both ends' cells
/// included; consecutive cells share a side. `visit(cell)` returns false to stop. The walk takes
/// exactly as many steps as the cells of a and b are apart, so that rounding cannot lead it astray.
/// Source: Amanatides and Woo, A fast voxel traversal algorithm for ray tracing, 1987.
template <class Visit>
void walk_line(const OccupancyMap2D& map, const Vec2& a, const Vec2& b, Visit&& visit) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  Eigen::Vector2i cell = map.cell_of(a);
  const Eigen::Vector2i last = map.cell_of(b);
  const Vec2 from = (a - map.origin) / map.resolution;
  const Vec2 delta = (b - map.origin) / map.resolution - from;
  Eigen::Vector2i left = (last - cell).cwiseAbs();
  Eigen::Vector2i step(last.x() < cell.x() ? -1 : 1, last.y() < cell.y() ? -1 : 1);
  // Parameter along the segment at which it crosses the next cell border in x and in y.
  Vec2 next, per_cell;
  for (int k = 0; k < 2; ++k) {
    const double border = cell[k] + (step[k] > 0 ? 1 : 0);
    per_cell[k] = left[k] > 0 ? std::abs(1 / delta[k]) : kNever;
    next[k] = left[k] > 0 ? (border - from[k]) / delta[k] : kNever;
  }
  while (visit(cell)) {
    if (left.x() == 0 && left.y() == 0) return;
    const int k = next.x() <= next.y() ? 0 : 1;
    cell[k] += step[k];
    next[k] = --left[k] > 0 ? next[k] + per_cell[k] : kNever;
  }
}

}  // namespace arex
