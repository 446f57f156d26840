#include "planning/grid_astar.h"

#include <gtest/gtest.h>

#include <limits>
#include <queue>

#include "autonomy/planning/test_grid.h"
#include "planning/curve_check.h"

namespace arex {
namespace {

test::TestGrid random_grid(std::uint64_t seed, double share) {
  test::TestGrid grid(24, 20, 8);
  RandomStream random(seed, "astar");
  for (int x = 0; x < 24; ++x) {
    for (int y = 0; y < 20; ++y) {
      for (int z = 0; z < 8; ++z) {
        if (random.uniform() < share) grid.at(x, y, z) |= GridView::kInflated;
      }
    }
  }
  grid.at(0, 0, 0) = grid.at(23, 19, 7) = GridView::kKnown;
  return grid;
}

/// Dijkstra with plain loops; infinite if there is no path.
int brute_force_cost(const GridView& grid, const Eigen::Vector3i& from, const Eigen::Vector3i& to,
                     bool cut_corners) {
  constexpr int kFar = std::numeric_limits<int>::max();
  std::vector<int> cost(static_cast<std::size_t>(grid.size.prod()), kFar);
  const auto free = [&](const Eigen::Vector3i& c) {
    return grid.contains(c) && (grid.cells[grid.index(c)] & 3) == 0;
  };
  using Entry = std::tuple<int, int, int, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  cost[grid.index(from)] = 0;
  open.push({0, from.x(), from.y(), from.z()});
  while (!open.empty()) {
    const auto [c, x, y, z] = open.top();
    open.pop();
    const Eigen::Vector3i cell(x, y, z);
    if (c > cost[grid.index(cell)]) continue;
    for (int dx = -1; dx <= 1; ++dx) {
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dz = -1; dz <= 1; ++dz) {
          const Eigen::Vector3i next = cell + Eigen::Vector3i(dx, dy, dz);
          bool passable = free(next);
          if (!cut_corners) {
            for (int k = 0; k < 8; ++k) {
              passable &=
                  free(cell + Eigen::Vector3i(k & 1 ? dx : 0, k & 2 ? dy : 0, k & 4 ? dz : 0));
            }
          }
          if (!passable) continue;
          const int axes = std::abs(dx) + std::abs(dy) + std::abs(dz);
          const int through = c + (axes == 0 ? 0 : axes == 1 ? 10 : axes == 2 ? 14 : 17);
          if (through >= cost[grid.index(next)]) continue;
          cost[grid.index(next)] = through;
          open.push({through, next.x(), next.y(), next.z()});
        }
      }
    }
  }
  return cost[grid.index(to)];
}

TEST(GridAstar, CostsAreThoseOfDijkstra) {
  GridAstar astar;
  int found = 0, none = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    for (const double share : {0.1, 0.3, 0.45, 0.75}) {
      for (const bool cut : {false, true}) {
        const test::TestGrid grid = random_grid(seed, share);
        const Eigen::Vector3i from(0, 0, 0), to(23, 19, 7);
        AstarOptions options;
        options.cut_corners = cut;
        const AstarResult result = astar.search(grid.view(), from, to, options);
        const int expected = brute_force_cost(grid.view(), from, to, cut);
        if (expected == std::numeric_limits<int>::max()) {
          EXPECT_EQ(result.status, AstarStatus::kExhausted);
          ++none;
        } else {
          ASSERT_EQ(result.status, AstarStatus::kFound);
          EXPECT_EQ(result.cost, expected);
          ++found;
          options.greedy = true;
          const AstarResult greedy = astar.search(grid.view(), from, to, options);
          ASSERT_EQ(greedy.status, AstarStatus::kFound);
          EXPECT_LE(greedy.cost, expected * 5 / 4);
        }
      }
    }
  }
  EXPECT_GT(found, 20);
  EXPECT_GT(none, 20);
}

TEST(GridAstar, PathsKeepHalfACellOfClearance) {
  GridAstar astar;
  int paths = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const test::TestGrid grid = random_grid(seed, 0.25);
    const AstarResult result = astar.search(grid.view(), {0, 0, 0}, {23, 19, 7});
    if (result.status != AstarStatus::kFound) continue;
    ++paths;
    for (std::size_t i = 0; i + 1 < result.path.size(); ++i) {
      EXPECT_LT((result.path[i + 1] - result.path[i]).norm(), 0.1 * 1.74);
      EXPECT_TRUE(is_segment_free(grid.view(), result.path[i], result.path[i + 1]));
    }
  }
  EXPECT_GT(paths, 10);
}

TEST(GridAstar, StopsAtItsBudgetAndForgetsEarlierSearches) {
  const test::TestGrid grid(30, 30, 10);
  GridAstar astar;
  AstarOptions options;
  options.max_expansions = 5;
  EXPECT_EQ(astar.search(grid.view(), {0, 0, 0}, {29, 29, 9}, options).status,
            AstarStatus::kBudget);
  const AstarResult first = astar.search(grid.view(), {0, 0, 0}, {29, 5, 9});
  EXPECT_NE(0, astar.search(grid.view(), {3, 20, 0}, {9, 5, 1}).expansions);
  const AstarResult again = astar.search(grid.view(), {0, 0, 0}, {29, 5, 9});
  EXPECT_EQ(first.path, again.path);
  EXPECT_EQ(first.expansions, again.expansions);
}

TEST(GridAstar, StaysInItsWindow) {
  test::TestGrid grid(40, 40, 10);
  grid.mark({20, 0, 0}, {20, 36, 9}, GridView::kInflated);  // a wall with a gap at y = 37..39
  GridAstar astar;
  AstarOptions options;
  options.window_margin_cells = 8;
  EXPECT_EQ(astar.search(grid.view(), {15, 10, 5}, {25, 10, 5}, options).status,
            AstarStatus::kExhausted);
  options.window_margin_cells = -1;
  EXPECT_EQ(astar.search(grid.view(), {15, 10, 5}, {25, 10, 5}, options).status,
            AstarStatus::kFound);
}

TEST(Shortcut, KeepsEndsAndStaysFree) {
  GridAstar astar;
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const test::TestGrid grid = random_grid(seed, 0.1);
    const AstarResult result = astar.search(grid.view(), {0, 0, 0}, {23, 19, 7});
    ASSERT_EQ(result.status, AstarStatus::kFound);
    const std::vector<Vec3> corners = shortcut(grid.view(), result.path, 0.01);
    EXPECT_EQ(corners.front(), result.path.front());
    EXPECT_EQ(corners.back(), result.path.back());
    EXPECT_LT(corners.size(), result.path.size());
    for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
      EXPECT_TRUE(is_segment_free(grid.view(), corners[i], corners[i + 1]));
    }
  }
}

}  // namespace
}  // namespace arex
