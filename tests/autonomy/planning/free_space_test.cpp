#include "planning/free_space.h"

#include <gtest/gtest.h>

#include "autonomy/planning/test_grid.h"
#include "planning/curve_check.h"

namespace arex {
namespace {

TEST(FreeSpace, ClearanceIsTheDistanceToTheNearestOccupiedBox) {
  RandomStream random(1, "clearance");
  test::TestGrid grid(30, 30, 30);
  std::vector<Eigen::Vector3i> occupied;
  for (int k = 0; k < 20; ++k) {
    occupied.push_back(
        {random.uniform_int(0, 29), random.uniform_int(0, 29), random.uniform_int(0, 29)});
    grid.at(occupied.back().x(), occupied.back().y(), occupied.back().z()) |= GridView::kOccupied;
  }
  for (int trial = 0; trial < 100; ++trial) {
    const Vec3 p = test::random_point(random, 0, 3);
    double expected = 1.0;
    for (const auto& cell : occupied) {
      const Vec3 low = 0.1 * cell.cast<double>();
      const Vec3 nearest = p.cwiseMax(low).cwiseMin((low.array() + 0.1).matrix());
      expected = std::min(expected, (p - nearest).norm());
    }
    EXPECT_NEAR(clearance(grid.view(), p, 1.0), expected, 1e-9);
  }
}

TEST(FreeSpace, GoalsMoveBackAlongTheWay) {
  test::TestGrid grid(100, 40, 20);
  grid.add_obstacle({60, 15, 0}, {64, 25, 19}, 3);
  const Vec3 from(1.0, 2.0, 1.0), goal(6.2, 2.0, 1.0);
  const auto moved = nearest_free_goal(grid.view(), from, goal, 1.5);
  ASSERT_TRUE(moved);
  EXPECT_FALSE(is_blocked(grid.view(), *moved));
  EXPECT_NEAR(moved->x(), 5.65, 0.06);
  EXPECT_NEAR(moved->y(), 2.0, 0.06);
  EXPECT_FALSE(nearest_free_goal(grid.view(), from, goal, 0.3));
}

TEST(FreeSpace, EscapesThroughTheWiderSide) {
  // Between two walls, nearer to the left one; the way out is to the right of an opening.
  test::TestGrid grid(60, 60, 20);
  grid.mark({0, 0, 0}, {59, 35, 19}, GridView::kInflated);
  grid.mark({20, 0, 0}, {20, 35, 19}, GridView::kOccupied);
  grid.mark({30, 0, 0}, {30, 35, 19}, GridView::kOccupied);
  const Vec3 start(2.35, 3.05, 1.0);
  const std::vector<Vec3> path = escape_path(grid.view(), start, 0.3, 1.5);
  ASSERT_GE(path.size(), 2u);
  EXPECT_EQ(path.front(), start);
  EXPECT_FALSE(is_blocked(grid.view(), path.back()));
  const double at_start = clearance(grid.view(), start, 2.0);
  for (const Vec3& p : path) EXPECT_GE(clearance(grid.view(), p, 2.0), at_start - 0.06);
  // It drifts towards the middle of the passage.
  EXPECT_GT(path[path.size() / 2].x(), start.x());
}

TEST(FreeSpace, NoEscapeThroughGapsNarrowerThanTheVehicle) {
  test::TestGrid grid(60, 60, 20);
  grid.mark({15, 15, 0}, {45, 45, 19}, GridView::kInflated);
  grid.mark({20, 20, 0}, {40, 40, 19}, GridView::kOccupied);
  for (int z = 0; z < 20; ++z) {
    for (int x = 25; x <= 35; ++x) {
      for (int y = 25; y <= 35; ++y) grid.at(x, y, z) = GridView::kKnown | GridView::kInflated;
    }
    for (int x = 36; x <= 45; ++x) grid.at(x, 30, z) = GridView::kKnown | GridView::kInflated;
  }
  EXPECT_TRUE(escape_path(grid.view(), {3.05, 3.05, 1.0}, 0.3, 2.0).empty());
  EXPECT_FALSE(escape_path(grid.view(), {3.05, 3.05, 1.0}, 0.05, 2.0).empty());
}

TEST(FreeSpace, InflationShrinksToTheRoomThereIs) {
  RandomStream random(2, "shrunk");
  constexpr double kTrueRadius = 0.3, kReach = 0.8;
  int freed = 0;
  for (int trial = 0; trial < 20; ++trial) {
    test::TestGrid grid(40, 40, 30);
    for (int k = 0; k < 4; ++k) {
      const Eigen::Vector3i cell(random.uniform_int(0, 39), random.uniform_int(0, 39),
                                 random.uniform_int(0, 29));
      grid.add_obstacle(cell, cell, 5);
    }
    const Vec3 p = test::random_point(random, 0.5, 2.5);
    const GridView before = grid.view();
    ShrunkInflation shrunk;
    const GridView after = shrunk.around(before, p, kReach, kTrueRadius, before.resolution_m);
    EXPECT_EQ(is_blocked(after, p), (before.at(p) & GridView::kOccupied) != 0);
    const double here = clearance(before, p, 1.0);
    for (int i = 0; i < 40 * 40 * 30; ++i) {
      const Eigen::Vector3i cell(i / 40 % 40, i % 40, i / 1600);
      const std::uint8_t was = before.cells[before.index(cell)];
      const std::uint8_t is = after.cells[after.index(cell)];
      if (was == is) continue;
      ++freed;
      const Vec3 centre = before.centre_of(cell);
      EXPECT_EQ(was & ~GridView::kInflated, is);
      EXPECT_LE((centre - p).cwiseAbs().maxCoeff(), kReach + 0.1);
      // Clearances here are to boxes and from any point of the cell; the planner's between centres.
      EXPECT_GE(clearance(before, centre, 1.0), std::min(here - 0.1, kTrueRadius) - 0.1);
    }
  }
  EXPECT_GT(freed, 100);
}

// The inflation gives way to a vehicle inside it; floor and ceiling do not, unless it is beyond.
TEST(ShrunkInflation, LeavesTheCeilingWhereItIs) {
  test::TestGrid grid(40, 40, 30);
  constexpr auto kBeyond = GridView::kInflated | GridView::kBarred;
  grid.mark({0, 0, 20}, {39, 39, 29}, kBeyond);
  grid.mark({18, 18, 10}, {22, 22, 19}, GridView::kInflated);
  ShrunkInflation shrunk;
  const GridView below = shrunk.around(grid.view(), {2.05, 2.05, 1.85}, 0.8, 0.3, 0);
  EXPECT_FALSE(below.inflated({2.05, 2.05, 1.95}));
  EXPECT_TRUE(below.inflated({2.05, 2.05, 2.05}));
  const GridView above = shrunk.around(grid.view(), {2.05, 2.05, 2.25}, 0.8, 0.3, 0);
  EXPECT_FALSE(above.inflated({2.05, 2.05, 2.05}));
}

}  // namespace
}  // namespace arex
