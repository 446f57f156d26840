#pragma once

#include <vector>

#include "exploration/exploration_space.h"
#include "mapping/line_walk.h"
#include "mapping/occupancy_map_2d.h"
#include "math/random.h"

/// Maps for the exploration tests.
namespace arex::test {

inline OccupancyMap2D make_map(int width, int height, std::int8_t state, double resolution = 0.1) {
  OccupancyMap2D map;
  map.width = width;
  map.height = height;
  map.resolution = resolution;
  map.origin = {-0.5 * width * resolution, -0.5 * height * resolution};
  map.cells.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), state);
  return map;
}

inline void fill(OccupancyMap2D& map, const Eigen::Vector2i& low, const Eigen::Vector2i& high,
                 std::int8_t state) {
  for (int y = low.y(); y <= high.y(); ++y) {
    for (int x = low.x(); x <= high.x(); ++x) {
      if (map.contains({x, y})) map.cells[map.index({x, y})] = state;
    }
  }
}

/// A blotchy map of all three states.
inline OccupancyMap2D random_map(int width, int height, RandomStream& random) {
  OccupancyMap2D map = make_map(width, height, OccupancyMap2D::kFree);
  for (int k = 0; k < 40; ++k) {
    const Eigen::Vector2i low(random.uniform_int(0, width - 1), random.uniform_int(0, height - 1));
    const Eigen::Vector2i size(random.uniform_int(0, 12), random.uniform_int(0, 12));
    const bool unknown = k % 2 == 0;
    fill(map, low, low + (unknown ? size : Eigen::Vector2i(size / 4)),
         unknown ? OccupancyMap2D::kUnknown : OccupancyMap2D::kOccupied);
  }
  return map;
}

/// A maze of square rooms: a random spanning tree of doors, and a pillar in every third room.
/// Everything is known: the truth that a sensor reveals.
inline OccupancyMap2D maze(int columns, int rows, int room_cells, int door_cells,
                           RandomStream& random) {
  OccupancyMap2D map =
      make_map(columns * room_cells + 1, rows * room_cells + 1, OccupancyMap2D::kFree);
  for (int c = 0; c <= columns; ++c) {
    fill(map, {c * room_cells, 0}, {c * room_cells, map.height - 1}, OccupancyMap2D::kOccupied);
  }
  for (int r = 0; r <= rows; ++r) {
    fill(map, {0, r * room_cells}, {map.width - 1, r * room_cells}, OccupancyMap2D::kOccupied);
  }
  std::vector<bool> visited(static_cast<std::size_t>(columns * rows), false);
  std::vector<Eigen::Vector2i> stack{{columns / 2, rows / 2}};
  visited[static_cast<std::size_t>(stack.back().y() * columns + stack.back().x())] = true;
  while (!stack.empty()) {
    const Eigen::Vector2i room = stack.back();
    std::vector<Eigen::Vector2i> next;
    for (const Eigen::Vector2i& step : {Eigen::Vector2i(1, 0), Eigen::Vector2i(0, 1),
                                        Eigen::Vector2i(-1, 0), Eigen::Vector2i(0, -1)}) {
      const Eigen::Vector2i other = room + step;
      if (other.x() < 0 || other.y() < 0 || other.x() >= columns || other.y() >= rows) continue;
      if (!visited[static_cast<std::size_t>(other.y() * columns + other.x())]) next.push_back(step);
    }
    if (next.empty()) {
      stack.pop_back();
      continue;
    }
    const Eigen::Vector2i step =
        next[static_cast<std::size_t>(random.uniform_int(0, static_cast<int>(next.size()) - 1))];
    const Eigen::Vector2i other = room + step;
    visited[static_cast<std::size_t>(other.y() * columns + other.x())] = true;
    const Eigen::Vector2i wall = room_cells * room.cwiseMax(other);
    const int shift = random.uniform_int(2, room_cells - door_cells - 2);
    const Eigen::Vector2i along(step.y() != 0 ? 1 : 0, step.x() != 0 ? 1 : 0);
    fill(map, wall + shift * along, wall + (shift + door_cells - 1) * along, OccupancyMap2D::kFree);
    stack.push_back(other);
  }
  for (int k = 0; k < columns * rows; k += 3) {
    const Eigen::Vector2i room(k % columns, k / columns);
    if (room == Eigen::Vector2i(columns / 2, rows / 2)) continue;
    const Eigen::Vector2i pillar =
        room_cells * room + Eigen::Vector2i(random.uniform_int(10, room_cells - 10),
                                            random.uniform_int(10, room_cells - 10));
    fill(map, pillar, pillar + Eigen::Vector2i(1, 1), OccupancyMap2D::kOccupied);
  }
  return map;
}

/// Centre of a maze's middle room.
inline Vec2 maze_start(const OccupancyMap2D& map, int columns, int rows, int room_cells) {
  return map.centre_of(
      {columns / 2 * room_cells + room_cells / 2, rows / 2 * room_cells + room_cells / 2});
}

/// Copies from the truth what a disc sensor at p sees.
inline void reveal(const OccupancyMap2D& truth, const Vec2& p, double range_m,
                   OccupancyMap2D& map) {
  constexpr int kRays = 720;
  for (int i = 0; i < kRays; ++i) {
    const double angle = 2 * M_PI * i / kRays;
    walk_line(truth, p, p + range_m * Vec2(std::cos(angle), std::sin(angle)),
              [&](const Eigen::Vector2i& cell) {
                if (!truth.contains(cell)) return false;
                map.cells[map.index(cell)] = truth.at(cell);
                return truth.at(cell) == OccupancyMap2D::kFree;
              });
  }
}

/// The neighbour of a cell from which the way to where the field begins is shortest; the cell
/// itself where none is nearer.
inline Eigen::Vector2i next_towards(const ExplorationSpace& field, const Eigen::Vector2i& here) {
  Eigen::Vector2i next = here;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      const Eigen::Vector2i cell = here + Eigen::Vector2i(dx, dy);
      if (field.travel_distance(cell) < field.travel_distance(next)) next = cell;
    }
  }
  return next;
}

inline OccupancyMap2D unknown_like(const OccupancyMap2D& truth) {
  OccupancyMap2D map = truth;
  map.cells.assign(map.cells.size(), OccupancyMap2D::kUnknown);
  return map;
}

}  // namespace arex::test
