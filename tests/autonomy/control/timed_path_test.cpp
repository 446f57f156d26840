#include "control/timed_path.h"

#include <gtest/gtest.h>

#include <numbers>

#include "config/config.h"
#include "math/random.h"
#include "math/so3.h"

namespace arex {
namespace {

TEST(SCurve, ReachesTheDistanceAtRestWithinItsLimits) {
  RandomStream random(1, "s_curve");
  for (int i = 0; i < 400; ++i) {
    const SCurveLimits limits{random.uniform(0.1, 5), random.uniform(0.1, 6),
                              random.uniform(0.1, 20)};
    const double distance = std::pow(10, random.uniform(-4, 2));
    const SCurve curve(distance, limits);
    constexpr int kSteps = 400;
    double before = 0;
    for (int k = 0; k <= kSteps; ++k) {
      const auto s = curve.sample(curve.duration_s() * k / kSteps);
      ASSERT_GE(s.position, before - 1e-9);
      ASSERT_LE(s.speed, limits.speed * (1 + 1e-9));
      ASSERT_LE(std::abs(s.acceleration), limits.acceleration * (1 + 1e-9));
      before = s.position;
    }
    const auto end = curve.sample(curve.duration_s() * (1 - 1e-12));
    EXPECT_NEAR(end.position, distance, 1e-9 * distance);
    EXPECT_NEAR(end.speed, 0, 1e-8);
    EXPECT_NEAR(end.acceleration, 0, 1e-8);
  }
}

TEST(SCurve, IsTheFastestOfItsKind) {
  // Long leg: closed form d/v + v/a + a/j. Short leg: 4 tj with distance = 2 j tj^3.
  EXPECT_NEAR(SCurve(20, {1.5, 1.5, 3}).duration_s(), 20 / 1.5 + 1.5 / 1.5 + 1.5 / 3, 1e-12);
  EXPECT_NEAR(SCurve(0.01, {1.5, 1.5, 3}).duration_s(), 4 * std::cbrt(0.01 / 6), 1e-12);
  EXPECT_EQ(SCurve(0, {1, 1, 1}).duration_s(), 0);
}

TEST(SCurve, IsContinuousInTheDistance) {
  // Across the switches between the cases the duration must not jump.
  const SCurveLimits limits{1.5, 1.5, 3};
  double before = 0;
  for (double d = 0.0005; d < 4; d += 0.0005) {
    const double duration = SCurve(d, limits).duration_s();
    ASSERT_GT(duration, before);
    ASSERT_LT(duration - before, d < 0.01 ? 0.3 : 0.02);
    before = duration;
  }
}

TimedPath random_path(std::uint64_t seed, const TimedPathConfig& config,
                      std::vector<Vec3>& corners) {
  RandomStream random(seed, "path");
  TimedPath path(config, {0, 0, 0.1}, random.uniform(-3, 3));
  corners = {path.end()};
  path.climb_to(1.5);
  corners.push_back(path.end());
  for (int i = 0; i < 5; ++i) {
    path.fly_to({random.uniform(-10, 10), random.uniform(-10, 10), random.uniform(0.5, 3)});
    corners.push_back(path.end());
  }
  path.wait(0.7);
  path.land_to(-1);
  corners.push_back(path.end());
  return path;
}

double distance_to_polyline(const Vec3& p, const std::vector<Vec3>& corners) {
  double least = 1e9;
  for (std::size_t i = 1; i < corners.size(); ++i) {
    const Vec3 leg = corners[i] - corners[i - 1];
    const double s =
        std::clamp(leg.dot(p - corners[i - 1]) / std::max(leg.squaredNorm(), 1e-12), 0.0, 1.0);
    least = std::min(least, (corners[i - 1] + s * leg - p).norm());
  }
  return least;
}

TEST(TimedPath, DerivativesAgreeWithNumericalOnesAndLimitsHold) {
  const TimedPathConfig config;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    std::vector<Vec3> corners;
    const TimedPath path = random_path(seed, config, corners);
    constexpr double kStep = 1e-5;
    for (double t = 0.003; t < path.duration_s() + 1; t += 0.0137) {
      const auto s = path.sample(t), a = path.sample(t - kStep), b = path.sample(t + kStep);
      // Jerk bounds the second difference, so continuity of all three is tested with it.
      ASSERT_LT(((b.p_OB - a.p_OB) / (2 * kStep) - s.v_OB).norm(), 1e-7);
      ASSERT_LT(((b.v_OB - a.v_OB) / (2 * kStep) - s.a_OB).norm(), 5e-5);
      ASSERT_LT((b.a_OB - a.a_OB).norm(), 2 * kStep * config.max_jerk_mps3 * (1 + 1e-6) + 1e-9);
      ASSERT_NEAR(so3::wrap(b.yaw_rad - a.yaw_rad) / (2 * kStep), s.yaw_rate_radps, 1e-7);
      ASSERT_LE(s.v_OB.norm(), config.max_speed_mps * (1 + 1e-9));
      ASSERT_LE(s.a_OB.norm(), config.max_acceleration_mps2 * (1 + 1e-9));
      ASSERT_LE(std::abs(s.yaw_rate_radps), config.max_yaw_rate_radps * (1 + 1e-9));
      ASSERT_LT(distance_to_polyline(s.p_OB, corners), 1e-9);
    }
    EXPECT_LT((path.sample(path.duration_s() + 5).p_OB - path.end()).norm(), 1e-12);
    EXPECT_NEAR(path.sample(1e9).yaw_rad, path.end_yaw_rad(), 1e-12);
    EXPECT_EQ(path.sample(-1).v_OB.norm(), 0);
  }
}

TEST(TimedPath, TurnsTowardsTheLegBeforeMovingAlongIt) {
  const TimedPathConfig config;
  for (const double yaw : {0.0, 0.4, 1.5, 3.1, -2.0}) {
    TimedPath path(config, Vec3::Zero(), yaw);
    path.fly_to({5, 0, 0});
    for (double t = 0; t < path.duration_s(); t += 0.01) {
      const auto s = path.sample(t);
      if (s.v_OB.norm() > 1e-9) {
        ASSERT_LE(std::abs(s.yaw_rad), config.moving_heading_rad + 1e-6);
      }
    }
    EXPECT_NEAR(path.end_yaw_rad(), 0, 1e-12);
  }
}

TEST(TimedPath, TakeOffAndLandingKeepTheHeadingAndTheirSpeeds) {
  const TimedPathConfig config;
  TimedPath path(config, {1, 2, 0}, 0.8);
  path.climb_to(1.5);
  const double top = path.duration_s();
  path.land_to(-0.5);
  double climb = 0, sink = 0;
  for (double t = 0; t < path.duration_s(); t += 0.01) {
    const auto s = path.sample(t);
    (t < top ? climb : sink) = std::max(t < top ? climb : sink, std::abs(s.v_OB.z()));
    ASSERT_EQ(s.yaw_rad, 0.8);
    ASSERT_EQ(s.p_OB.x(), 1);
  }
  EXPECT_NEAR(climb, config.climb_speed_mps, 1e-9);
  EXPECT_NEAR(sink, config.landing_speed_mps, 1e-9);
}

TEST(TimedPath, DefaultsKeepTheirOwnRules) {
  TimedPathConfig config;
  ConfigNode empty;
  empty.kind = ConfigNode::Kind::kMap;
  EXPECT_NO_THROW(read_config(empty, config));
}

}  // namespace
}  // namespace arex
