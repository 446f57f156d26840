#include "planning/free_space.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>

#include "planning/curve_check.h"

namespace arex {
namespace {

/// Cells of a cube around a centre cell, with the squared distance (cells) to what is occupied.
class ClearanceCube {
 public:
  ClearanceCube(const GridView& grid, const Eigen::Vector3i& centre, int radius, int reach)
      : centre_(centre), radius_(radius), width_(2 * radius + 1) {
    const int far = reach * reach;
    squared_.assign(static_cast<std::size_t>(width_ * width_ * width_), far);
    const int wide = radius + reach;
    for (int z = -wide; z <= wide; ++z) {
      for (int x = -wide; x <= wide; ++x) {
        for (int y = -wide; y <= wide; ++y) {
          const Eigen::Vector3i cell = centre + Eigen::Vector3i(x, y, z);
          if (!grid.contains(cell)) continue;
          if ((grid.cells[grid.index(cell)] & GridView::kOccupied) != 0) spread({x, y, z}, reach);
        }
      }
    }
  }
  [[nodiscard]] int count() const { return width_ * width_ * width_; }
  [[nodiscard]] bool contains(const Eigen::Vector3i& offset) const {
    return offset.cwiseAbs().maxCoeff() <= radius_;
  }
  [[nodiscard]] int index(const Eigen::Vector3i& offset) const {
    return ((offset.z() + radius_) * width_ + offset.x() + radius_) * width_ + offset.y() + radius_;
  }
  [[nodiscard]] Eigen::Vector3i offset(int index) const {
    return {index / width_ % width_ - radius_, index % width_ - radius_,
            index / (width_ * width_) - radius_};
  }
  /// Distance between centres, in cells.
  [[nodiscard]] double clearance(int index) const {
    return std::sqrt(static_cast<double>(squared_[static_cast<std::size_t>(index)]));
  }

 private:
  void spread(const Eigen::Vector3i& occupied, int reach) {
    const Eigen::Vector3i low = (occupied.array() - reach).max(-radius_);
    const Eigen::Vector3i high = (occupied.array() + reach).min(radius_);
    for (int z = low.z(); z <= high.z(); ++z) {
      for (int x = low.x(); x <= high.x(); ++x) {
        for (int y = low.y(); y <= high.y(); ++y) {
          int& value = squared_[static_cast<std::size_t>(index({x, y, z}))];
          value = std::min(value, (Eigen::Vector3i(x, y, z) - occupied).squaredNorm());
        }
      }
    }
  }

  Eigen::Vector3i centre_;
  int radius_, width_;
  std::vector<int> squared_;
};

}  // namespace

std::optional<Vec3> nearest_free_goal(const GridView& grid, const Vec3& from, const Vec3& goal,
                                      double max_shift_m) {
  const double length = (from - goal).norm();
  const double step = 0.5 * grid.resolution_m;
  for (double s = 0; s <= std::min(length, max_shift_m); s += step) {
    const Vec3 p = length > 0 ? Vec3(goal + (from - goal) * (s / length)) : goal;
    const Eigen::Vector3i cell = grid.cell_of(p);
    if (grid.contains(cell) && !is_blocked(grid, p)) return grid.centre_of(cell);
  }
  const int radius = static_cast<int>(max_shift_m / grid.resolution_m);
  const Eigen::Vector3i centre = grid.cell_of(goal);
  std::optional<Vec3> best;
  double best_distance = max_shift_m;
  for (int z = -radius; z <= radius; ++z) {
    for (int x = -radius; x <= radius; ++x) {
      for (int y = -radius; y <= radius; ++y) {
        const Vec3 p = grid.centre_of(centre + Eigen::Vector3i(x, y, z));
        if (is_blocked(grid, p) || (p - goal).norm() >= best_distance) continue;
        best = p;
        best_distance = (p - goal).norm();
      }
    }
  }
  return best;
}

double clearance(const GridView& grid, const Vec3& p, double max_m) {
  const int reach = static_cast<int>(std::ceil(max_m / grid.resolution_m));
  const Eigen::Vector3i centre = grid.cell_of(p);
  double best = max_m;
  for (int z = -reach; z <= reach; ++z) {
    for (int x = -reach; x <= reach; ++x) {
      for (int y = -reach; y <= reach; ++y) {
        const Eigen::Vector3i cell = centre + Eigen::Vector3i(x, y, z);
        if (!grid.contains(cell)) continue;
        if ((grid.cells[grid.index(cell)] & GridView::kOccupied) == 0) continue;
        const Vec3 beyond =
            ((p - grid.centre_of(cell)).cwiseAbs().array() - 0.5 * grid.resolution_m).max(0.0);
        best = std::min(best, beyond.norm());
      }
    }
  }
  return best;
}

std::vector<Vec3> escape_path(const GridView& grid, const Vec3& start, double vehicle_radius_m,
                              double max_distance_m) {
  const Eigen::Vector3i centre = grid.cell_of(start);
  if (!grid.contains(centre)) return {};
  const int radius = static_cast<int>(std::ceil(max_distance_m / grid.resolution_m));
  const int reach = static_cast<int>(std::ceil(2.0 * vehicle_radius_m / grid.resolution_m)) + 1;
  const ClearanceCube cube(grid, centre, radius, reach);
  const int source = cube.index(Eigen::Vector3i::Zero());
  const double allowed = std::min(vehicle_radius_m / grid.resolution_m, cube.clearance(source));

  // Dijkstra; ties by index.
  const auto cells = static_cast<std::size_t>(cube.count());
  std::vector<double> cost(cells, std::numeric_limits<double>::infinity());
  std::vector<int> parent(cells, -1);
  using Entry = std::pair<double, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  cost[static_cast<std::size_t>(source)] = 0;
  open.push({0.0, source});
  while (!open.empty()) {
    const auto [c, node] = open.top();
    open.pop();
    if (c > cost[static_cast<std::size_t>(node)]) continue;
    const Eigen::Vector3i offset = cube.offset(node);
    if (!is_blocked(grid, grid.centre_of(centre + offset))) {
      std::vector<Vec3> path;
      for (int at = node; at >= 0; at = parent[static_cast<std::size_t>(at)]) {
        path.push_back(at == source ? start : grid.centre_of(centre + cube.offset(at)));
      }
      std::reverse(path.begin(), path.end());
      return path;
    }
    for (int k = 0; k < 27; ++k) {
      const Eigen::Vector3i step(k / 3 % 3 - 1, k % 3 - 1, k / 9 - 1);
      const Eigen::Vector3i next = offset + step;
      if (k == 13 || !cube.contains(next) || !grid.contains(centre + next)) continue;
      const int there = cube.index(next);
      const double room = cube.clearance(there);
      if (room < allowed) continue;
      const double through = c + step.cast<double>().norm() / std::max(room, 0.5);
      if (through >= cost[static_cast<std::size_t>(there)]) continue;
      cost[static_cast<std::size_t>(there)] = through;
      parent[static_cast<std::size_t>(there)] = node;
      open.push({through, there});
    }
  }
  return {};
}

GridView ShrunkInflation::around(const GridView& grid, const Vec3& p, double reach_m,
                                 double vehicle_radius_m, double yield_m) {
  cells_.assign(grid.cells, grid.cells + grid.size.cast<std::ptrdiff_t>().prod());
  GridView shrunk = grid;
  shrunk.cells = cells_.data();
  const Eigen::Vector3i centre = grid.cell_of(p);
  if (!grid.contains(centre)) return shrunk;
  // Floor and ceiling are no inflation; one who is beyond them has to come back, though.
  const bool barred = (grid.cells[grid.index(centre)] & GridView::kBarred) != 0;
  const int radius = static_cast<int>(std::ceil(reach_m / grid.resolution_m));
  const double least = vehicle_radius_m / grid.resolution_m + 0.5;  // from centre to centre
  const ClearanceCube cube(grid, centre, radius, static_cast<int>(std::ceil(least)) + 2);
  const double here = cube.clearance(cube.index(Eigen::Vector3i::Zero()));
  const double kept = std::max(std::min(least, here), here - yield_m / grid.resolution_m);
  for (int i = 0; i < cube.count(); ++i) {
    const Eigen::Vector3i cell = centre + cube.offset(i);
    if (!grid.contains(cell) || cube.clearance(i) < kept) continue;
    std::uint8_t& flags = cells_[grid.index(cell)];
    if ((flags & GridView::kBarred) != 0 && !barred) continue;
    flags = static_cast<std::uint8_t>(flags & ~GridView::kInflated);
  }
  return shrunk;
}

}  // namespace arex
