#include "planning/spline_cost.h"

#include <gtest/gtest.h>

#include <functional>

#include "autonomy/planning/test_grid.h"
#include "planning/lbfgs_minimiser.h"

namespace arex {
namespace {

using Cost = std::function<double(std::span<const Vec3>, std::span<Vec3>)>;

std::vector<Vec3> random_points(std::uint64_t seed, double spread) {
  RandomStream random(seed, "cost");
  std::vector<Vec3> q;
  for (int i = 0; i < 11; ++i) {
    q.push_back(Vec3(0.4 * i, 0, 0) + test::random_point(random, -spread, spread));
  }
  return q;
}

/// Compares the gradient with central differences of the cost, relative to its size.
void expect_gradient(const Cost& cost, std::vector<Vec3> q) {
  std::vector<Vec3> gradient(q.size(), Vec3::Zero()), scratch(q.size());
  cost(q, gradient);
  double largest = 0;
  for (const Vec3& g : gradient) largest = std::max(largest, g.norm());
  ASSERT_GT(largest, 0) << "the term must be active";
  constexpr double h = 1e-6;
  for (std::size_t i = 0; i < q.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      const double here = q[i][axis];
      q[i][axis] = here + h;
      const double above = cost(q, scratch);
      q[i][axis] = here - h;
      const double below = cost(q, scratch);
      q[i][axis] = here;
      EXPECT_NEAR((above - below) / (2 * h), gradient[i][axis], 2e-6 * largest + 1e-7);
    }
  }
}

FeasibilityLimits limits() {
  return {{2.0, 0.9, 1.4}, {3.0, 0.9, 1.4}, {4.0, 0.9, 1.4}, 1.0, 0.7, 0.3};
}

FitnessReference reference(const std::vector<Vec3>& q) {
  RandomStream random(3, "reference");
  FitnessReference r{{}, {}, 25.0, 1.0};
  for (std::size_t i = 1; i + 1 < q.size(); ++i) {
    r.points.push_back(q[i] + test::random_point(random, -0.3, 0.3));
    r.tangents.push_back(test::random_point(random, -1, 1).normalized());
  }
  return r;
}

Anchors anchors(std::size_t n) {
  RandomStream random(4, "anchors");
  Anchors a(n);
  for (std::size_t i = 0; i < n; ++i) {
    for (int k = 0; k < random.uniform_int(0, 3); ++k) {
      a[i].push_back({Vec3(0.4 * static_cast<double>(i), 0, 0) + test::random_point(random, -1, 1),
                      test::random_point(random, -1, 1).normalized()});
    }
  }
  return a;
}

TEST(SplineCost, SmoothnessGradient) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    expect_gradient([](auto q, auto g) { return smoothness_cost(q, 0.24, 2e-4, g); },
                    random_points(seed, 0.5));
  }
}

TEST(SplineCost, CollisionGradientOnAllBranches) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const Anchors a = anchors(11);
    expect_gradient([&](auto q, auto g) { return collision_cost(q, a, 0.5, 0.7, g); },
                    random_points(seed, 0.8));
  }
}

TEST(SplineCost, FeasibilityGradientOnAllBranches) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    for (const double spread : {0.05, 0.5}) {  // cubic, and far into the quadratic
      expect_gradient([](auto q, auto g) { return feasibility_cost(q, 0.24, limits(), 1e-3, g); },
                      random_points(seed, spread));
    }
  }
}

TEST(SplineCost, FitnessGradient) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const std::vector<Vec3> q = random_points(seed, 0.5);
    const FitnessReference r = reference(q);
    expect_gradient([&](auto x, auto g) { return fitness_cost(x, r, 0.8, g); }, q);
  }
}

TEST(SplineCost, SmoothnessIsThePapersSum) {
  const std::vector<Vec3> q = random_points(1, 0.5);
  constexpr double dt = 0.2;
  std::vector<Vec3> v, a, j, gradient(q.size());
  for (std::size_t i = 0; i + 1 < q.size(); ++i) v.push_back((q[i + 1] - q[i]) / dt);
  for (std::size_t i = 0; i + 1 < v.size(); ++i) a.push_back((v[i + 1] - v[i]) / dt);
  for (std::size_t i = 0; i + 1 < a.size(); ++i) j.push_back((a[i + 1] - a[i]) / dt);
  double sum = 0;
  for (const Vec3& x : a) sum += x.squaredNorm();
  for (const Vec3& x : j) sum += x.squaredNorm();
  EXPECT_NEAR(smoothness_cost(q, dt, 1.0, gradient), sum, 1e-9 * sum);
}

TEST(SplineCost, CollisionPenaltyIsThePapers) {
  const auto penalty = [](double d) {  // one control point at distance d from one obstacle
    const std::vector<Vec3> q{{d, 0, 0}};
    std::vector<Vec3> gradient(1);
    return collision_cost(q, {{{Vec3::Zero(), Vec3::UnitX()}}}, 0.5, 1.0, gradient);
  };
  constexpr double s = 0.5;
  EXPECT_EQ(penalty(0.5), 0.0);
  EXPECT_EQ(penalty(0.9), 0.0);
  EXPECT_NEAR(penalty(0.2), 0.3 * 0.3 * 0.3, 1e-15);
  for (const double d : {-0.1, -1.0}) {
    const double c = s - d;
    EXPECT_NEAR(penalty(d), 3 * s * c * c - 3 * s * s * c + s * s * s, 1e-12);
  }
}

TEST(SplineCost, FeasibilityPenaltyMeetsToSecondOrder) {
  const FeasibilityPenalty f(2.0, 0.9, 1.3);
  constexpr double h = 1e-6;
  double slope = 0, before = 0, after = 0;
  for (const double sign : {-1.0, 1.0}) {
    const double c = sign * f.junction;
    EXPECT_NEAR(f(c - h, slope), f(c + h, slope), 1e-5);
    f(c - h, before);
    f(c + h, after);
    EXPECT_NEAR(before, after, 1e-4);
    // Second derivatives on either side.
    double a = 0, b = 0;
    f(c - 2 * h, a);
    f(c - h, b);
    const double curvature_below = (b - a) / h;
    f(c + h, a);
    f(c + 2 * h, b);
    EXPECT_NEAR(curvature_below, (b - a) / h, 1e-3);
  }
  EXPECT_EQ(f(1.79, slope), 0.0);
  EXPECT_NEAR(f(2.0, slope), 0.2 * 0.2 * 0.2, 1e-12);
  EXPECT_EQ(f(-2.3, slope), f(2.3, slope));
}

TEST(Minimise, FindsTheMinimumOfAQuadraticAndRepeatsItsBits) {
  RandomStream random(5, "quadratic");
  std::vector<Vec3> centre, x(9, Vec3::Zero());
  for (int i = 0; i < 9; ++i) centre.push_back(test::random_point(random, -3, 3));
  const PointCost cost = [&](std::span<const Vec3> at, std::span<Vec3> g) {
    double sum = 0;
    for (std::size_t i = 0; i < at.size(); ++i) {
      const double w = 1.0 + static_cast<double>(i * i);
      g[i] = 2 * w * (at[i] - centre[i]);
      sum += w * (at[i] - centre[i]).squaredNorm();
    }
    return sum;
  };
  const LbfgsConfig config{8, 100, 1e-8};
  const MinimiseResult result = minimise(x, cost, config);
  for (std::size_t i = 0; i < x.size(); ++i) EXPECT_LT((x[i] - centre[i]).norm(), 1e-6);
  EXPECT_GT(result.iterations, 2);
  std::vector<Vec3> again(9, Vec3::Zero());
  minimise(again, cost, config);
  EXPECT_EQ(x, again);
}

TEST(Minimise, StopsAtItsIterationBudget) {
  std::vector<Vec3> x(4, Vec3(-1.2, 1.0, 0));
  const PointCost rosenbrock = [](std::span<const Vec3> at, std::span<Vec3> g) {
    double sum = 0;
    for (std::size_t i = 0; i < at.size(); ++i) {
      const double a = 1 - at[i].x(), b = at[i].y() - at[i].x() * at[i].x();
      g[i] = {-2 * a - 400 * at[i].x() * b, 200 * b, 2 * at[i].z()};
      sum += a * a + 100 * b * b + at[i].z() * at[i].z();
    }
    return sum;
  };
  EXPECT_LE(minimise(x, rosenbrock, {8, 5, 1e-12}).iterations, 5);
}

}  // namespace
}  // namespace arex
