#include "planning/grid_astar.h"

#include <algorithm>
#include <cstdlib>

#include "planning/curve_check.h"

namespace arex {
namespace {

constexpr int kStepCost[4] = {0, 10, 14, 17};  ///< by the number of axes that change
constexpr std::uint8_t kNoStep = 26;

/// A step to one of the 26 neighbours.
struct Step {
  int dx, dy, dz, cost;
  std::uint32_t passed;  ///< bits (of the 3 x 3 x 3 block) of all cells that the step touches
};

constexpr int block_bit(int dx, int dy, int dz) { return (dz + 1) * 9 + (dx + 1) * 3 + dy + 1; }

constexpr std::array<Step, 26> make_steps() {
  std::array<Step, 26> steps{};
  std::size_t n = 0;
  for (int dz = -1; dz <= 1; ++dz) {
    for (int dx = -1; dx <= 1; ++dx) {
      for (int dy = -1; dy <= 1; ++dy) {
        if (dx == 0 && dy == 0 && dz == 0) continue;
        std::uint32_t passed = 0;
        for (int a = 0; a <= 1; ++a) {
          for (int b = 0; b <= 1; ++b) {
            for (int c = 0; c <= 1; ++c) passed |= 1u << block_bit(a * dx, b * dy, c * dz);
          }
        }
        const int axes = (dx != 0) + (dy != 0) + (dz != 0);
        steps[n++] = {dx, dy, dz, kStepCost[axes], passed};
      }
    }
  }
  return steps;
}
constexpr std::array<Step, 26> kSteps = make_steps();

/// Octile distance: the cost of the shortest path in an empty grid.
int octile(int dx, int dy, int dz) {
  int a = std::abs(dx), b = std::abs(dy), c = std::abs(dz);
  if (a < b) std::swap(a, b);
  if (b < c) std::swap(b, c);
  if (a < b) std::swap(a, b);
  return kStepCost[1] * (a - b) + kStepCost[2] * (b - c) + kStepCost[3] * c;
}

int heuristic(int distance, bool greedy) { return greedy ? distance + distance / 4 : distance; }

std::uint32_t flat(const Eigen::Vector3i& cell, const Eigen::Vector3i& size) {
  return static_cast<std::uint32_t>((cell.z() * size.x() + cell.x()) * size.y() + cell.y());
}

Eigen::Vector3i cell_of_index(std::uint32_t node, const Eigen::Vector3i& size) {
  const int index = static_cast<int>(node);
  return {index / size.y() % size.x(), index % size.y(), index / (size.y() * size.x())};
}

}  // namespace

void GridAstar::prepare(const Window& window) {
  const auto cells = static_cast<std::size_t>(window.size.prod());
  if (nodes_.size() < cells) nodes_.resize(cells);
  if (++generation_ == 0) {  // wrapped round: old stamps would look new
    std::fill(nodes_.begin(), nodes_.end(), Node{});
    generation_ = 1;
  }
  for (std::size_t i = lowest_; i <= highest_ && i < open_.size(); ++i) open_[i].clear();
  lowest_ = highest_ = 0;
}

void GridAstar::push(std::uint32_t node, int f) {
  // An inflated or rounded heuristic may fall below the lowest bucket; the node then comes next.
  const auto bucket = std::max(lowest_, static_cast<std::size_t>(std::max(f - f_start_, 0)));
  if (bucket >= open_.size()) open_.resize(bucket + 256);
  open_[bucket].push_back(node);
  highest_ = std::max(highest_, bucket);
}

bool GridAstar::pop(std::uint32_t& node) {
  for (; lowest_ <= highest_ && lowest_ < open_.size(); ++lowest_) {
    if (open_[lowest_].empty()) continue;
    node = open_[lowest_].back();
    open_[lowest_].pop_back();
    return true;
  }
  return false;
}

void GridAstar::expand(const GridView& grid, const Window& window, std::uint32_t node,
                       const Eigen::Vector3i& goal, const AstarOptions& options) {
  const Eigen::Vector3i local = cell_of_index(node, window.size), cell = window.low + local;
  // One look at the 3 x 3 x 3 block; cells outside the window count as blocked.
  std::uint32_t blocked = 0;
  for (int dz = -1; dz <= 1; ++dz) {
    for (int dx = -1; dx <= 1; ++dx) {
      const bool row_inside = local.z() + dz >= 0 && local.z() + dz < window.size.z() &&
                              local.x() + dx >= 0 && local.x() + dx < window.size.x();
      for (int dy = -1; dy <= 1; ++dy) {
        const bool inside = row_inside && local.y() + dy >= 0 && local.y() + dy < window.size.y();
        if (!inside || (grid.cells[grid.index({cell.x() + dx, cell.y() + dy, cell.z() + dz})] &
                        GridView::kBlocked) != 0) {
          blocked |= 1u << block_bit(dx, dy, dz);
        }
      }
    }
  }
  const int cost_here = nodes_[node].cost;
  for (std::size_t k = 0; k < kSteps.size(); ++k) {
    const Step& step = kSteps[k];
    const std::uint32_t needed =
        options.cut_corners ? 1u << block_bit(step.dx, step.dy, step.dz) : step.passed;
    if ((blocked & needed & ~(1u << block_bit(0, 0, 0))) != 0) continue;
    const auto next = static_cast<std::uint32_t>(
        static_cast<int>(node) + (step.dz * window.size.x() + step.dx) * window.size.y() + step.dy);
    Node& there = nodes_[next];
    const int cost = cost_here + step.cost;
    if (there.generation == generation_ && (there.closed || there.cost <= cost)) continue;
    there = {generation_, cost, static_cast<std::uint8_t>(k), false};
    push(next, cost + heuristic(octile(cell.x() + step.dx - goal.x(), cell.y() + step.dy - goal.y(),
                                       cell.z() + step.dz - goal.z()),
                                options.greedy));
  }
}

std::vector<Vec3> GridAstar::trace(const GridView& grid, const Window& window,
                                   std::uint32_t node) const {
  std::vector<Vec3> path;
  Eigen::Vector3i local = cell_of_index(node, window.size);
  while (true) {
    path.push_back(grid.centre_of(window.low + local));
    const Node& here = nodes_[flat(local, window.size)];
    if (here.step == kNoStep) break;
    const Step& step = kSteps[here.step];
    local -= Eigen::Vector3i(step.dx, step.dy, step.dz);
  }
  std::reverse(path.begin(), path.end());
  return path;
}

AstarResult GridAstar::search(const GridView& grid, const Eigen::Vector3i& start,
                              const Eigen::Vector3i& goal, const AstarOptions& options) {
  AstarResult result;
  if (!grid.contains(start) || !grid.contains(goal) ||
      (grid.cells[grid.index(start)] & GridView::kBlocked) != 0 ||
      (grid.cells[grid.index(goal)] & GridView::kBlocked) != 0) {
    return result;
  }
  Window window{Eigen::Vector3i::Zero(), grid.size};
  const Eigen::Vector3i margins(options.window_margin_cells, options.window_margin_cells,
                                options.window_height_cells);
  for (int axis = 0; axis < 3; ++axis) {
    if (margins[axis] < 0) continue;
    window.low[axis] = std::max(std::min(start[axis], goal[axis]) - margins[axis], 0);
    window.size[axis] =
        std::min(std::max(start[axis], goal[axis]) + margins[axis] + 1, grid.size[axis]) -
        window.low[axis];
  }
  prepare(window);
  const std::uint32_t first = flat(start - window.low, window.size);
  const std::uint32_t last = flat(goal - window.low, window.size);
  f_start_ = heuristic(octile(start.x() - goal.x(), start.y() - goal.y(), start.z() - goal.z()),
                       options.greedy);
  nodes_[first] = {generation_, 0, kNoStep, false};
  push(first, f_start_);

  std::uint32_t node = 0;
  while (pop(node)) {
    if (nodes_[node].closed) continue;  // an older, dearer entry of the same node
    nodes_[node].closed = true;
    if (node == last) {
      result.status = AstarStatus::kFound;
      result.cost = nodes_[node].cost;
      result.path = trace(grid, window, node);
      return result;
    }
    if (result.expansions == options.max_expansions) {
      result.status = AstarStatus::kBudget;
      return result;
    }
    ++result.expansions;
    expand(grid, window, node, goal, options);
  }
  return result;
}

std::vector<Vec3> shortcut(const GridView& grid, std::span<const Vec3> path, double margin_m) {
  std::vector<Vec3> kept;
  if (path.empty()) return kept;
  kept.push_back(path.front());
  std::size_t at = 0;
  while (at + 1 < path.size()) {
    // Farthest visible vertex by doubling, then bisection: few line checks for long straight runs.
    std::size_t good = at + 1, reach = 2;
    while (at + reach < path.size() &&
           is_segment_free(grid, path[at], path[at + reach], margin_m)) {
      good = at + reach;
      reach *= 2;
    }
    std::size_t bad = std::min(at + reach, path.size());
    while (good + 1 < bad) {
      const std::size_t middle = (good + bad) / 2;
      (is_segment_free(grid, path[at], path[middle], margin_m) ? good : bad) = middle;
    }
    kept.push_back(path[good]);
    at = good;
  }
  return kept;
}

}  // namespace arex
