#include "exploration/frontier_search.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <optional>

namespace arex {
namespace {

/// The unknown neighbour of a cell around which most is unknown.
struct Neighbour {
  Vec2 centre = Vec2::Zero();
  double area_m2 = 0;
};

std::optional<Neighbour> best_unknown_neighbour(const ExplorationSpace& space,
                                                const Eigen::Vector2i& cell) {
  constexpr std::array<int, 4> kDx{1, 0, -1, 0}, kDy{0, 1, 0, -1};
  std::optional<Neighbour> best;
  for (std::size_t s = 0; s < 4; ++s) {
    const Eigen::Vector2i other(cell.x() + kDx[s], cell.y() + kDy[s]);
    if (!space.is_unknown(other)) continue;
    const Vec2 centre = space.map().centre_of(other);
    const double area = space.unknown_area(centre);
    if (!best || area > best->area_m2) best = Neighbour{centre, area};
  }
  return best;
}

bool borders_unknown(const ExplorationSpace& space, const Eigen::Vector2i& cell) {
  return space.is_unknown({cell.x() + 1, cell.y()}) || space.is_unknown({cell.x() - 1, cell.y()}) ||
         space.is_unknown({cell.x(), cell.y() + 1}) || space.is_unknown({cell.x(), cell.y() - 1});
}

/// Takes the component that holds `first` out of `open`.
std::vector<Eigen::Vector2i> take_component(const OccupancyMap2D& map, std::vector<bool>& open,
                                            const Eigen::Vector2i& first) {
  std::vector<Eigen::Vector2i> cells{first};
  open[map.index(first)] = false;
  for (std::size_t k = 0; k < cells.size(); ++k) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const Eigen::Vector2i other = cells[k] + Eigen::Vector2i(dx, dy);
        if (!map.contains(other) || !open[map.index(other)]) continue;
        open[map.index(other)] = false;
        cells.push_back(other);
      }
    }
  }
  std::sort(cells.begin(), cells.end(), [&](const Eigen::Vector2i& a, const Eigen::Vector2i& b) {
    return map.index(a) < map.index(b);
  });
  return cells;
}

Frontier describe(const ExplorationSpace& space, std::vector<Eigen::Vector2i> cells) {
  Frontier frontier;
  frontier.length_m = space.map().resolution * static_cast<double>(cells.size());
  std::vector<Neighbour> neighbours;
  neighbours.reserve(cells.size());
  for (const Eigen::Vector2i& cell : cells) {
    neighbours.push_back(best_unknown_neighbour(space, cell).value_or(Neighbour{}));
  }
  std::vector<std::size_t> order(cells.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return neighbours[a].area_m2 > neighbours[b].area_m2;
  });
  frontier.unknown_area_m2 = neighbours[order.front()].area_m2;
  const double apart = space.information_radius_m();
  for (const std::size_t i : order) {
    const bool covered = std::any_of(
        frontier.points.begin(), frontier.points.end(),
        [&](const FrontierPoint& p) { return (p.point - neighbours[i].centre).norm() <= apart; });
    if (covered) continue;
    frontier.points.push_back({neighbours[i].centre, space.map().centre_of(cells[i])});
  }
  frontier.cells = std::move(cells);
  return frontier;
}

}  // namespace

std::vector<Frontier> find_frontiers(const ExplorationSpace& space) {
  const OccupancyMap2D& map = space.map();
  std::vector<bool> open(map.cells.size(), false);
  std::vector<Eigen::Vector2i> border;
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) {
      // Reachable by having been flown through is not enough: what it borders may be no free space.
      if (!space.is_reachable({x, y}) || !space.is_free({x, y})) continue;
      if (!borders_unknown(space, {x, y})) continue;
      border.emplace_back(x, y);
      open[map.index({x, y})] = true;
    }
  }
  std::vector<Frontier> frontiers;
  for (const Eigen::Vector2i& cell : border) {
    if (!open[map.index(cell)]) continue;
    frontiers.push_back(describe(space, take_component(map, open, cell)));
  }
  return frontiers;
}

}  // namespace arex
