#include "planning/curve_check.h"

#include <gtest/gtest.h>

#include "autonomy/planning/test_grid.h"

namespace arex {
namespace {

UniformBspline random_curve(RandomStream& random) {
  std::vector<Vec3> q{test::random_point(random, 0.5, 2.5)};
  for (int i = 0; i < 9; ++i) {
    q.push_back((q.back() + test::random_point(random, -0.4, 0.4))
                    .cwiseMax(Vec3::Constant(0.3))
                    .cwiseMin(Vec3::Constant(2.7)));
  }
  return {std::move(q), 0.2};
}

TEST(CurveCheck, FindsWhatFineSamplingFinds) {
  RandomStream random(1, "curve_check");
  int colliding = 0, free = 0;
  for (int trial = 0; trial < 400; ++trial) {
    test::TestGrid grid(30, 30, 30);
    for (int k = 0; k < 150; ++k) {
      grid.at(random.uniform_int(0, 29), random.uniform_int(0, 29), random.uniform_int(0, 29)) |=
          GridView::kInflated;
    }
    const UniformBspline curve = random_curve(random);
    std::optional<double> expected;
    const int n = static_cast<int>(curve.duration_s() / 1e-4);
    for (int i = 0; i <= n && !expected; ++i) {
      const double t = curve.duration_s() * i / n;
      if (is_blocked(grid.view(), curve.position(t))) expected = t;
    }
    const auto found = first_collision(grid.view(), curve);
    if (expected) {
      ++colliding;
      ASSERT_TRUE(found);
      EXPECT_LE(*found, *expected);
      // The colliding piece is at most half a cell long.
      EXPECT_LT((curve.position(*found) - curve.position(*expected)).norm(), 0.06);
    } else {
      free += !found;
      if (found) {  // then it grazes: some blocked cell is within the graze length
        const Vec3 near = Vec3::Constant(2 * kGrazeLength_m);
        bool touched = false;
        for (double t = *found; t < std::min(*found + 0.2, curve.duration_s()); t += 2e-5) {
          touched |=
              is_box_blocked(grid.view(), curve.position(t) - near, curve.position(t) + near);
        }
        EXPECT_TRUE(touched);
      }
    }
  }
  EXPECT_GT(colliding, 50);
  EXPECT_GT(free, 50);
}

TEST(CurveCheck, SeesACornerThatSamplesMiss) {
  // A straight flight that clips the corner of one cell by 2 mm.
  test::TestGrid grid(20, 20, 5);
  grid.at(10, 10, 2) |= GridView::kInflated;
  const Vec3 direction = Vec3(1, -1, 0).normalized();
  for (const double inside : {0.002, -0.004}) {
    const Vec3 past = Vec3(1.0, 1.0, 0.25) + inside * Vec3(1, 1, 0).normalized();
    std::vector<Vec3> q;
    for (int i = 0; i < 10; ++i) q.push_back(past + (0.2 * i - 0.93) * direction);
    EXPECT_EQ(first_collision(grid.view(), UniformBspline(q, 0.1)).has_value(), inside > 0);
  }
}

TEST(CurveCheck, IntervalsHaveFreeEndsAndCoverAllThatIsBlocked) {
  RandomStream random(2, "intervals");
  test::TestGrid grid(30, 30, 30);
  for (int k = 0; k < 600; ++k) {
    grid.at(random.uniform_int(0, 29), random.uniform_int(0, 29), random.uniform_int(0, 29)) |=
        GridView::kInflated;
  }
  int intervals = 0;
  for (int trial = 0; trial < 50; ++trial) {
    const UniformBspline curve = random_curve(random);
    const auto found = find_collisions(grid.view(), curve);
    for (const TimeInterval& interval : found) {
      ++intervals;
      if (interval.begin_s > 0) {
        EXPECT_FALSE(is_blocked(grid.view(), curve.position(interval.begin_s)));
      }
      if (interval.end_s < curve.duration_s() - 1e-9) {
        EXPECT_FALSE(is_blocked(grid.view(), curve.position(interval.end_s)));
      }
    }
    for (double t = 0; t < curve.duration_s(); t += 1e-3) {
      if (!is_blocked(grid.view(), curve.position(t))) continue;
      EXPECT_TRUE(std::any_of(found.begin(), found.end(), [&](const TimeInterval& i) {
        return t >= i.begin_s && t <= i.end_s;
      }));
    }
  }
  EXPECT_GT(intervals, 20);
}

TEST(CurveCheck, OutsideTheGridIsBlocked) {
  const test::TestGrid grid(20, 20, 20);
  std::vector<Vec3> q;
  for (int i = 0; i < 8; ++i) q.push_back({1.0 + 0.25 * i, 1.0, 1.0});
  EXPECT_TRUE(first_collision(grid.view(), UniformBspline(q, 0.1)));
}

TEST(CurveCheck, RestBesideAWallIsFree) {
  test::TestGrid grid(20, 20, 20);
  grid.mark({10, 0, 0}, {10, 19, 19}, GridView::kInflated);
  const Vec3 p(1.0 - 2e-4, 1.03, 1.07);  // 0.2 mm before the wall
  std::vector<Vec3> q(4, p);
  for (int i = 1; i < 6; ++i) q.push_back(p - 0.05 * i * Vec3::UnitX());
  EXPECT_FALSE(first_collision(grid.view(), UniformBspline(q, 0.1)));
}

}  // namespace
}  // namespace arex
