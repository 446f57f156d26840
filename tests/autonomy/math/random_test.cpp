#include "math/random.h"

#include <gtest/gtest.h>

#include <cmath>

namespace arex {
namespace {

TEST(RandomStream, DependsOnSeedNameAndForkOnly) {
  RandomStream a(7, "gyro"), same(7, "gyro"), other_name(7, "accel"), other_seed(8, "gyro");
  const auto first = a.bits();
  EXPECT_EQ(first, same.bits());
  EXPECT_NE(first, other_name.bits());
  EXPECT_NE(first, other_seed.bits());
  RandomStream parent(7, "gyro");
  EXPECT_EQ(parent.fork(3).bits(), parent.fork(3).bits());
  EXPECT_NE(parent.fork(3).bits(), parent.fork(4).bits());
}

TEST(RandomStream, UniformHasTheRightMomentsAndStaysInside) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    RandomStream random(seed, "uniform");
    constexpr int kDraws = 200'000;
    double sum = 0, squares = 0;
    for (int i = 0; i < kDraws; ++i) {
      const double u = random.uniform();
      ASSERT_GE(u, 0);
      ASSERT_LT(u, 1);
      sum += u;
      squares += u * u;
    }
    // Five standard errors of the mean (1/sqrt(12 n)) and of the second moment (sqrt(4/45/n)).
    EXPECT_NEAR(sum / kDraws, 0.5, 5 * std::sqrt(1.0 / 12 / kDraws));
    EXPECT_NEAR(squares / kDraws, 1.0 / 3, 5 * std::sqrt(4.0 / 45 / kDraws));
  }
}

TEST(RandomStream, NormalMatchesTheGaussianDistributionFunction) {
  // Kolmogorov-Smirnov against erfc, body and tails; 2.2 / sqrt(n) fails once in 8000 runs.
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    RandomStream random(seed, "normal");
    constexpr int kDraws = 200'000;
    std::vector<double> draws(kDraws);
    for (double& d : draws) d = random.normal();
    std::sort(draws.begin(), draws.end());
    double worst = 0;
    for (int i = 0; i < kDraws; ++i) {
      const double cdf = 0.5 * std::erfc(-draws[static_cast<std::size_t>(i)] / std::sqrt(2.0));
      worst = std::max(
          {worst, std::abs(cdf - double(i) / kDraws), std::abs(cdf - double(i + 1) / kDraws)});
    }
    EXPECT_LT(worst, 2.2 / std::sqrt(double(kDraws)));
    // Share beyond the ziggurat's base layer (3.654 sigma): 2.58e-4; 52 expected, Poisson.
    const auto beyond = std::count_if(draws.begin(), draws.end(),
                                      [](double d) { return std::abs(d) > 3.6541528853610088; });
    EXPECT_GT(beyond, 15);
    EXPECT_LT(beyond, 95);
  }
}

TEST(RandomStream, IntegersCoverTheClosedRange) {
  RandomStream random(1, "int");
  std::array<int, 5> seen{};
  for (int i = 0; i < 5000; ++i) ++seen[static_cast<std::size_t>(random.uniform_int(-2, 2) + 2)];
  for (const int count : seen) EXPECT_NEAR(count, 1000, 5 * std::sqrt(800.0));
}

}  // namespace
}  // namespace arex
