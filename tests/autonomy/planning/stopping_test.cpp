#include "planning/stopping.h"

#include <gtest/gtest.h>

#include "autonomy/planning/test_grid.h"
#include "planning/curve_check.h"
#include "support/unavoidable.h"

namespace arex {
namespace {

constexpr MotionLimits kLimits{2.0, 3.0, 30.0};

TEST(Stopping, SpeedAndDistanceAreInverse) {
  for (double v = 0; v < 4; v += 0.3) {
    EXPECT_NEAR(stoppable_speed(stopping_distance(v, 3.0, 0.1), 3.0, 0.1), v, 1e-12);
  }
  EXPECT_EQ(stoppable_speed(-1.0, 3.0, 0.1), 0.0);
}

TEST(Stopping, BrakingTakesTheDistanceThatPhysicsAsks) {
  RandomStream random(1, "brake");
  for (int i = 0; i < 50; ++i) {
    MotionState state;
    state.v = test::random_point(random, -1, 1).normalized() * random.uniform(0.1, 2.0);
    const UniformBspline s = brake(state, kLimits, 0.05);
    EXPECT_LT((s.velocity(0) - state.v).norm(), 1e-12);
    EXPECT_LT(s.velocity(s.duration_s()).norm(), 1e-12);
    EXPECT_LE(s.acceleration_bound(), kLimits.max_acceleration_mps2 * (1 + 1e-9));
    const double length = (s.position(s.duration_s()) - state.p).norm();
    const double least = stopping_distance(state.v.norm(), kLimits.max_acceleration_mps2, 0.0);
    EXPECT_GE(length, least - 1e-9);
    EXPECT_LE(length, least + 2 * 0.05 * state.v.norm());
  }
}

TEST(Stopping, SwervesWhereTheWayAheadIsTooShort) {
  test::TestGrid grid(40, 40, 20);
  grid.mark({24, 15, 0}, {26, 20, 19}, GridView::kInflated);  // 0.35 m ahead, its edge 0.05 m aside
  const MotionState state{{2.05, 2.05, 1.0}, {1.5, 0, 0}, Vec3::Zero()};
  EXPECT_TRUE(first_collision(grid.view(), brake(state, kLimits, 0.05)));
  const auto stop = find_stop(grid.view(), state, kLimits, 0.05, {3.5, 2.0, 1.0});
  ASSERT_TRUE(stop);
  EXPECT_FALSE(first_collision(grid.view(), *stop));
  EXPECT_LT((stop->velocity(0) - state.v).norm(), 1e-12);
  EXPECT_LT(stop->velocity(stop->duration_s()).norm(), 1e-12);
  EXPECT_LE(stop->acceleration_bound(), kLimits.max_acceleration_mps2 * (1 + 1e-9));
}

TEST(Stopping, TheWidestStopGoesWhereThereIsRoom) {
  test::TestGrid grid(60, 60, 20);
  grid.mark({0, 0, 0}, {59, 59, 19}, GridView::kInflated);   // no place is free
  grid.mark({26, 0, 0}, {26, 32, 19}, GridView::kOccupied);  // a wall that ends just to the left
  const MotionState state{{2.0, 3.2, 1.0}, {1.5, 0, 0}, Vec3::Zero()};
  EXPECT_FALSE(find_stop(grid.view(), state, kLimits, 0.05, state.p));
  const UniformBspline stop = widest_stop(grid.view(), state, kLimits, 0.05);
  EXPECT_GT(stop.position(stop.duration_s()).y(), state.p.y());
}

// As flown: a false return dead ahead, in an aisle, beside a wall. The way round it on the wall's
// side ended nearer to the wall than the vehicle's radius.
TEST(Stopping, TheWidestStopDoesNotFleeFromASpeckIntoAWall) {
  test::TestGrid grid(60, 60, 20);
  grid.mark({0, 0, 0}, {59, 59, 19}, GridView::kInflated);
  grid.mark({0, 19, 0}, {59, 19, 19}, GridView::kOccupied);  // 1.1 m to the right
  for (const int speck : {30, 31}) {  // left of the vehicle's line and right of it
    test::TestGrid with = grid;
    with.mark({26, speck, 10}, {26, speck, 10}, GridView::kOccupied);
    const MotionState state{{2.0, 3.1, 1.05}, {2.0, -0.03, 0}, Vec3::Zero()};
    const UniformBspline stop = widest_stop(with.view(), state, kLimits, 0.05);
    for (double t = 0; t <= stop.duration_s(); t += 0.02) {
      EXPECT_GE(stop.position(t).y(), 2.5) << t;  // half a metre from the wall's face
    }
  }
}

/// A wall of cells from (x, y0) to (x, y1) with its face at 0.1 x m; the vehicle comes from the
/// left.
test::TestGrid wall(int x, int y0, int y1) {
  test::TestGrid grid(80, 80, 8);
  grid.mark({x, y0, 0}, {x + 2, y1, 7}, GridView::kInflated);
  return grid;
}

TEST(Stopping, CollisionIsUnavoidableBeforeAWideWallNearerThanTheBrakingDistance) {
  const Vec3 v(1.5, 0, 0);
  for (const double distance : {0.05, 0.15, 0.25, 0.33, 0.40, 0.6}) {
    const test::TestGrid grid = wall(40, 0, 79);
    const Vec3 p(4.0 - distance, 4.05, 0.4);
    const double needed = stopping_distance(1.5, 3.0, 0.0);  // 0.375 m
    EXPECT_EQ(support::is_collision_unavoidable(grid.view(), p, v, 3.0), distance < needed)
        << distance;
  }
  // Beside a narrow one there is a way: 0.3 m ahead leaves 0.2 s, in which 3 m/s^2 shift by 6 cm.
  EXPECT_FALSE(support::is_collision_unavoidable(wall(40, 40, 40).view(), {3.7, 4.05, 0.4}, v, 3));
  EXPECT_TRUE(support::is_collision_unavoidable(wall(40, 30, 50).view(), {3.7, 4.05, 0.4}, v, 3));
}

TEST(Stopping, KnownPrefixEndsAtTheFirstUnknownCell) {
  test::TestGrid grid(60, 20, 20);
  grid.forget({33, 0, 0}, {59, 19, 19});
  grid.forget({9, 9, 9}, {11, 11, 11});  // the vehicle's own shadow
  std::vector<Vec3> q;
  for (int i = 0; i < 20; ++i) q.push_back({0.75 + 0.25 * i, 1.05, 1.05});
  const UniformBspline s(q, 0.2);
  const KnownPrefix prefix = known_prefix(grid.view(), s, 0.0, 0.3);
  EXPECT_FALSE(prefix.whole);
  EXPECT_NEAR(s.position(prefix.end_s).x(), 3.3, 0.03);
  EXPECT_NEAR(prefix.length_m, 2.3, 0.03);
  EXPECT_EQ(known_prefix(grid.view(), s, 0.0, 0.0).length_m, 0.0);
}

}  // namespace
}  // namespace arex
