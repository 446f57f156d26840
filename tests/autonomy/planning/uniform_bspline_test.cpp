#include "planning/uniform_bspline.h"

#include <gtest/gtest.h>

#include <numbers>

#include "autonomy/planning/test_grid.h"

namespace arex {
namespace {

UniformBspline random_spline(std::uint64_t seed) {
  RandomStream random(seed, "bspline");
  std::vector<Vec3> q;
  for (int i = 0; i < 12; ++i) q.push_back(test::random_point(random, -2, 2));
  return {std::move(q), 0.13 + 0.05 * static_cast<double>(seed)};
}

/// Cox-de Boor recursion: the definition of the basis.
double basis(int i, int degree, double x) {
  if (degree == 0) return x >= i && x < i + 1 ? 1.0 : 0.0;
  return (x - i) / degree * basis(i, degree - 1, x) +
         (i + degree + 1 - x) / degree * basis(i + 1, degree - 1, x);
}

TEST(UniformBspline, IsTheSumOfItsBasisFunctions) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    const UniformBspline spline = random_spline(seed);
    for (double t = 0; t < spline.duration_s(); t += 0.0173) {
      Vec3 sum = Vec3::Zero();
      for (int i = 0; i < 12; ++i) {
        sum += basis(i, 3, t / spline.knot_span_s() + 3) *
               spline.control_points()[static_cast<std::size_t>(i)];
      }
      EXPECT_LT((sum - spline.position(t)).norm(), 1e-12);
    }
  }
}

TEST(UniformBspline, DerivativesMatchDifferences) {
  constexpr double h = 1e-5;
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    const UniformBspline s = random_spline(seed);
    for (double t = 0.01; t < s.duration_s() - 0.01; t += 0.0317) {
      // The third derivative jumps at knots.
      const double u = t / s.knot_span_s() - std::floor(t / s.knot_span_s());
      if (u < 1e-3 || u > 1 - 1e-3) continue;
      const auto slope = [&](auto f) { return Vec3((f(t + h) - f(t - h)) / (2 * h)); };
      EXPECT_LT((slope([&](double x) { return s.position(x); }) - s.velocity(t)).norm(), 1e-5);
      EXPECT_LT((slope([&](double x) { return s.velocity(x); }) - s.acceleration(t)).norm(), 1e-4);
      EXPECT_LT((slope([&](double x) { return s.acceleration(x); }) - s.jerk(t)).norm(), 1e-3);
    }
  }
}

TEST(UniformBspline, BoundsHoldAndTheAccelerationBoundIsExact) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const UniformBspline s = random_spline(seed);
    double speed = 0, acceleration = 0;
    for (int i = 0; i <= 64 * s.spans(); ++i) {
      const double t = s.knot_span_s() * i / 64;
      speed = std::max(speed, s.velocity(t).norm());
      acceleration = std::max(acceleration, s.acceleration(t).norm());
    }
    EXPECT_LE(speed, s.speed_bound() * (1 + 1e-12));
    EXPECT_GT(speed, 0.5 * s.speed_bound());
    EXPECT_NEAR(acceleration, s.acceleration_bound(), 1e-9 * acceleration);
  }
}

TEST(UniformBspline, FitHoldsBothEndsExactly) {
  RandomStream random(7, "bspline.fit");
  for (int trial = 0; trial < 50; ++trial) {
    const auto state = [&] {
      return MotionState{test::random_point(random, -5, 5), test::random_point(random, -2, 2),
                         test::random_point(random, -3, 3)};
    };
    const MotionState start = state(), end = state();
    std::vector<Vec3> points;
    for (int i = 0; i < random.uniform_int(5, 40); ++i) {
      points.push_back(test::random_point(random, -5, 5));
    }
    while (points.size() < 5) points.push_back(test::random_point(random, -5, 5));
    const UniformBspline s = UniformBspline::fit(points, start, end, 0.21);
    const double T = s.duration_s();
    EXPECT_NEAR(T, 0.21 * static_cast<double>(points.size() - 1), 1e-9);
    EXPECT_LT((s.position(0) - start.p).norm() + (s.position(T) - end.p).norm(), 1e-10);
    EXPECT_LT((s.velocity(0) - start.v).norm() + (s.velocity(T) - end.v).norm(), 1e-10);
    EXPECT_LT((s.acceleration(0) - start.a).norm() + (s.acceleration(T) - end.a).norm(), 1e-9);
  }
}

TEST(UniformBspline, FitReproducesACubic) {
  const Vec3 c0(1, 2, 3), c1(-1, 0.5, 2), c2(0.3, -0.2, 0.1), c3(-0.05, 0.08, 0.02);
  const auto at = [&](double t) {
    return MotionState{c0 + t * c1 + t * t * c2 + t * t * t * c3, c1 + 2 * t * c2 + 3 * t * t * c3,
                       2 * c2 + 6 * t * c3};
  };
  constexpr double dt = 0.25;
  constexpr int n = 16;
  std::vector<Vec3> points;
  for (int i = 0; i <= n; ++i) points.push_back(at(i * dt).p);
  const UniformBspline s = UniformBspline::fit(points, at(0), at(n * dt), dt);
  for (double t = 0; t <= n * dt; t += 0.01) EXPECT_LT((s.position(t) - at(t).p).norm(), 1e-9);
}

TEST(UniformBspline, RejectsTooFewPoints) {
  EXPECT_THROW(UniformBspline(std::vector<Vec3>(3, Vec3::Zero()), 0.1), std::invalid_argument);
  EXPECT_THROW(UniformBspline(std::vector<Vec3>(5, Vec3::Zero()), 0.0), std::invalid_argument);
}

}  // namespace
}  // namespace arex
