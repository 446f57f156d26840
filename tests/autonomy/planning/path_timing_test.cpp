#include "planning/path_timing.h"

#include <gtest/gtest.h>

#include <limits>

#include "autonomy/planning/test_grid.h"

namespace arex {
namespace {

constexpr MotionLimits kLimits{2.0, 3.0, 30.0};
constexpr double kSpan = 0.05;

double distance_to(std::span<const Vec3> path, const Vec3& p) {
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const Vec3 d = path[i + 1] - path[i];
    const double u = std::clamp((p - path[i]).dot(d) / d.squaredNorm(), 0.0, 1.0);
    best = std::min(best, (path[i] + u * d - p).norm());
  }
  return best;
}

TEST(PathTiming, AStraightFlightTakesAboutTheTimeOfATrapezoid) {
  const std::vector<Vec3> path{{0, 0, 1}, {8, 0, 1}};
  const UniformBspline s = time_path(path, {path[0], Vec3::Zero(), Vec3::Zero()}, kLimits, kSpan);
  // Trapezoid at 3 m/s^2 up and 0.85 of it down, plus the jerk-limited build-up of acceleration.
  const double trapezoid = 8.0 / 2.0 + 0.5 * 2.0 / 3.0 + 0.5 * 2.0 / 2.55;
  EXPECT_GT(s.duration_s(), trapezoid);
  EXPECT_LT(s.duration_s(), trapezoid + 0.5);
  EXPECT_LT((s.position(s.duration_s()) - path[1]).norm(), 1e-12);
}

TEST(PathTiming, KeepsLimitsAndPathAroundRoundedCorners) {
  RandomStream random(1, "timing");
  for (int trial = 0; trial < 100; ++trial) {
    std::vector<Vec3> corners{test::random_point(random, -1, 1)};
    for (int i = 0; i < 5; ++i) {
      corners.push_back(corners.back() +
                        Vec3(1.5, random.uniform(-1.0, 1.0), random.uniform(-0.3, 0.3)));
    }
    const std::vector<Vec3> path = round_corners(corners, 0.4);
    const UniformBspline s = time_path(path, {path[0], Vec3::Zero(), Vec3::Zero()}, kLimits, kSpan);
    EXPECT_LE(s.speed_bound(), 1.01 * kLimits.max_speed_mps);
    EXPECT_LE(s.acceleration_bound(), 1.15 * kLimits.max_acceleration_mps2);
    EXPECT_LT((s.position(s.duration_s()) - corners.back()).norm(), 1e-9);
    EXPECT_LT(s.velocity(s.duration_s()).norm(), 1e-9);
    for (double t = 0; t < s.duration_s(); t += 0.01) {
      // a dt^2 / 6, and the station's chord.
      EXPECT_LT(distance_to(path, s.position(t)), 3.0 * kSpan * kSpan / 6 + 1e-3);
    }
  }
}

TEST(PathTiming, BeginsExactlyInItsState) {
  const std::vector<Vec3> path{{0, 0, 1}, {8, 0, 1}};
  const MotionState start{path[0], {1.5, 0, 0}, {-0.8, 0.3, 0.1}};
  const UniformBspline s = time_path(path, start, kLimits, kSpan);
  EXPECT_LT((s.position(0) - start.p).norm(), 1e-12);
  EXPECT_LT((s.velocity(0) - start.v).norm(), 1e-12);
  EXPECT_LT((s.acceleration(0) - start.a).norm(), 1e-10);
}

TEST(PathTiming, ObeysItsSpeedCap) {
  const std::vector<Vec3> path{{0, 0, 1}, {8, 0, 1}};
  const auto cap = [](double s) { return s > 3 && s < 5 ? 0.5 : 10.0; };
  const UniformBspline s =
      time_path(path, {path[0], Vec3::Zero(), Vec3::Zero()}, kLimits, kSpan, cap);
  double fastest = 0;
  for (double t = 0; t < s.duration_s(); t += 0.01) {
    const double x = s.position(t).x();
    if (x > 3.05 && x < 4.95) fastest = std::max(fastest, s.velocity(t).norm());
  }
  EXPECT_GT(fastest, 0.45);
  EXPECT_LT(fastest, 0.62);
}

TEST(PathTiming, RoundingLeavesThePolylineByLessThanItsBound) {
  RandomStream random(2, "rounding");
  for (int trial = 0; trial < 50; ++trial) {
    std::vector<Vec3> corners{Vec3::Zero()};
    for (int i = 0; i < 5; ++i)
      corners.push_back(corners.back() + test::random_point(random, -1, 1));
    for (const double spacing : {0.1, 0.4}) {
      for (const Vec3& p : round_corners(corners, spacing)) {
        EXPECT_LT(distance_to(corners, p), spacing);
      }
    }
  }
}

TEST(Resample, KeepsEndsAndSpacing) {
  const std::vector<Vec3> line{{0, 0, 0}, {1, 0, 0}, {1, 0.5, 0}};
  const std::vector<Vec3> points = resample(line, 0.1);
  EXPECT_EQ(points.size(), 16u);
  EXPECT_EQ(points.front(), line.front());
  EXPECT_EQ(points.back(), line.back());
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    EXPECT_LT((points[i + 1] - points[i]).norm(), 0.1 + 1e-9);
  }
}

}  // namespace
}  // namespace arex
