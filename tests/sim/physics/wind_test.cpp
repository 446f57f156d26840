#include "physics/wind.h"

#include <cmath>

namespace arex::sim {
namespace {

/// 20 m/s along a horizontal direction, so that gusts are quick and lags short.
WindConfig strong_wind() {
  WindConfig config;
  config.mean_mps = {16, 12, 0};
  return config;
}

/// Gusts along the wind, across it and vertical.
Vec3 gust(const DrydenWind& wind, const Vec3& mean) {
  const Vec3 along = mean.normalized(), up = Vec3::UnitZ();
  const Vec3 difference = wind.velocity() - mean;
  return {difference.dot(along), difference.dot(up.cross(along)), difference.dot(up)};
}

TEST(DrydenWind, ScalesFollowTheSpecification) {
  const DrydenWind wind(strong_wind(), 1);
  // At 10 ft: 0.177 + 0.000823 * 10 = 0.18523; sigma_w = 0.1 W20; L_w = h.
  EXPECT_NEAR(wind.gust_sigma().z(), 2.0, 1e-9);
  EXPECT_NEAR(wind.gust_sigma().x(), 2.0 / std::pow(0.18523, 0.4), 1e-6);
  EXPECT_NEAR(wind.gust_time().z() * 20, 3.048, 1e-9);
  EXPECT_NEAR(wind.gust_time().x() * 20, 3.048 / std::pow(0.18523, 1.2), 1e-6);
}

TEST(DrydenWind, CalmAndSteadyWindHaveNoGusts) {
  DrydenWind calm({}, 1);
  WindConfig steady = strong_wind();
  steady.turbulence_scale = 0;
  DrydenWind constant(steady, 1);
  for (int i = 0; i < 100; ++i) {
    calm.step();
    constant.step();
    EXPECT_EQ(calm.velocity(), Vec3::Zero());
    EXPECT_EQ(constant.velocity(), steady.mean_mps);
  }
}

TEST(DrydenWind, SameSeedSameGustsOtherSeedOthers) {
  DrydenWind a(strong_wind(), 7), b(strong_wind(), 7), c(strong_wind(), 8);
  for (int i = 0; i < 50; ++i) {
    a.step();
    b.step();
    c.step();
    EXPECT_EQ(a.velocity(), b.velocity());
    EXPECT_NE(a.velocity(), c.velocity());
  }
}

// The spectra of the specification and these autocorrelations are Fourier pairs:
// longitudinal exp(-t/T); transverse and vertical exp(-t/T) (1 - t/(2 T)). Over many seeds, at the
// start and later: the gusts are stationary from the first tick, with the specified variance.
TEST(DrydenWind, EnsembleHasTheSpectrumOfTheSpecification) {
  const WindConfig config = strong_wind();
  constexpr int kSeeds = 6000;
  constexpr std::array<int, 5> kLags_ms{0, 20, 60, 150, 300};
  std::array<Vec3, kLags_ms.size()> product{}, square{};
  product.fill(Vec3::Zero());
  square.fill(Vec3::Zero());
  Vec3 sum = Vec3::Zero(), sigma = Vec3::Zero(), time = Vec3::Zero();
  for (int seed = 0; seed < kSeeds; ++seed) {
    DrydenWind wind(config, static_cast<std::uint64_t>(seed));
    sigma = wind.gust_sigma();
    time = wind.gust_time();
    const Vec3 first = gust(wind, config.mean_mps).cwiseQuotient(sigma);
    sum += first;
    int tick = 0;
    for (std::size_t k = 0; k < kLags_ms.size(); ++k) {
      for (; tick < kLags_ms[k]; ++tick) wind.step();
      const Vec3 later = gust(wind, config.mean_mps).cwiseQuotient(sigma);
      product[k] += first.cwiseProduct(later);
      square[k] += later.cwiseProduct(later);
    }
  }
  const double error = 1 / std::sqrt(kSeeds);  // of a mean; products' variance is at most 2
  for (std::size_t k = 0; k < kLags_ms.size(); ++k) {
    for (int axis = 0; axis < 3; ++axis) {
      const double s = kLags_ms[k] * 1e-3 / time[axis];
      const double expected = std::exp(-s) * (axis == 0 ? 1 : 1 - s / 2);
      EXPECT_NEAR(product[k][axis] / kSeeds, expected, 4 * std::sqrt(2.0) * error)
          << "axis " << axis << " lag " << kLags_ms[k];
      EXPECT_NEAR(square[k][axis] / kSeeds, 1, 4 * std::sqrt(2.0) * error);
    }
  }
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(sum[axis] / kSeeds, 0, 4 * error);
}

// A tick's exact discretisation does not depend on how it is cut: the variance of one tick's
// change follows from the autocorrelation, 2 (1 - rho(dt)).
TEST(DrydenWind, OneTickChangesByWhatTheAutocorrelationSays) {
  const WindConfig config = strong_wind();
  constexpr int kSteps = 200'000;
  DrydenWind wind(config, 3);
  Vec3 previous = gust(wind, config.mean_mps), square = Vec3::Zero();
  for (int i = 0; i < kSteps; ++i) {
    wind.step();
    const Vec3 now = gust(wind, config.mean_mps);
    square += (now - previous).cwiseAbs2();
    previous = now;
  }
  for (int axis = 0; axis < 3; ++axis) {
    const double s = 1e-3 / wind.gust_time()[axis];
    const double rho = std::exp(-s) * (axis == 0 ? 1 : 1 - s / 2);
    const double expected = 2 * (1 - rho) * std::pow(wind.gust_sigma()[axis], 2);
    // Increments are nearly independent: standard error sqrt(2/n).
    EXPECT_NEAR(square[axis] / kSteps, expected, 4 * std::sqrt(2.0 / kSteps) * expected + 1e-9);
  }
}

}  // namespace
}  // namespace arex::sim
