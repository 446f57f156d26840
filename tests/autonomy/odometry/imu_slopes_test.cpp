#include "odometry/inertial/imu_slopes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "math/random.h"

namespace arex {
namespace {

constexpr Stamp kPeriod = 5'000'000, kFrame = 100'000'000;
constexpr double kPi = std::numbers::pi;

/// An angle that shakes: a sum of waves with the spectrum of an integrated white noise of the
/// density above 3 Hz, as far as 200 Hz sampling goes.
class Shaking {
 public:
  Shaking(double density, std::uint64_t seed) {
    RandomStream random(seed, "shaking");
    constexpr double kStep_hz = 0.25;
    for (double f = 3 + kStep_hz / 2; f < 95; f += kStep_hz) {
      const double rate = density * std::sqrt(kStep_hz);
      waves_.push_back({2 * kPi * f, rate * random.normal(), rate * random.normal()});
    }
  }
  [[nodiscard]] double rate(double t) const {
    double sum = 0;
    for (const Wave& w : waves_) sum += w.a * std::cos(w.w * t) + w.b * std::sin(w.w * t);
    return sum;
  }
  [[nodiscard]] double angle(double t) const {
    double sum = 0;
    for (const Wave& w : waves_) sum += (w.a * std::sin(w.w * t) - w.b * std::cos(w.w * t)) / w.w;
    return sum;
  }

 private:
  struct Wave {
    double w, a, b;
  };
  std::vector<Wave> waves_;
};

template <typename Rate>
std::vector<ImuSample> sampled(Rate rate, Stamp until) {
  std::vector<ImuSample> samples;
  for (Stamp t = 0; t <= until; t += kPeriod) {
    samples.push_back({t, Vec3(0, 0, rate(to_seconds(t))), Vec3(0, rate(to_seconds(t)), kGravity)});
  }
  return samples;
}

ImuInterval slopes(const std::vector<ImuSample>& samples, Stamp from, Stamp to, double delay_s,
                   const WhiteNoise& shaking) {
  auto intervals = imu_intervals(samples, from, to, 1.0, delay_s);
  add_slopes(intervals, samples, 1.0, delay_s, kFrame, shaking);
  return intervals.back();
}

TEST(ImuSlopes, OfASteadyAccelerationAreThatAcceleration) {
  const auto samples = sampled([](double t) { return 3 * t; }, 400'000'000);
  for (const double delay_s : {-0.02, 0.0, 0.0025, 0.03}) {
    const ImuInterval imu = slopes(samples, 150'000'000, 250'000'000, delay_s, {});
    EXPECT_NEAR(imu.gyro_slope.z(), 3, 0.05) << delay_s;
    EXPECT_NEAR(imu.accel_slope.y(), 3, 0.05) << delay_s;
    EXPECT_EQ(imu.gyro_slope.x(), 0);
  }
}

// Summed over predictions they are the vehicle's rate, whatever it did in between.
TEST(ImuSlopes, Telescope) {
  const auto rate = [](double t) { return 0.3 * std::sin(9 * t) + 0.2 * std::cos(31 * t); };
  const auto samples = sampled(rate, 1'200'000'000);
  double sum = 0;
  for (Stamp from = 100'000'000; from < 1'000'000'000; from += kFrame) {
    sum += 0.1 * slopes(samples, from, from + kFrame, 0, {}).gyro_slope.z();
  }
  const auto mean = [&](double t) {  // of the rate over a frame
    double m = 0;
    for (int i = -10; i <= 10; ++i) m += rate(t + 0.005 * i) / 21;
    return m;
  };
  EXPECT_NEAR(sum, mean(1.0) - mean(0.1), 1e-9);
}

TEST(ImuSlopes, WithoutReadingsBeyondTheEndTakeWhatThereIs) {
  const auto samples = sampled([](double t) { return 3 * t; }, 260'000'000);
  const ImuInterval imu = slopes(samples, 150'000'000, 250'000'000, 0, {});
  EXPECT_NEAR(imu.gyro_slope.z(), 3, 0.2);
}

// What a shaken scan is compared by is the mean of the angle over it. The slope's error has little
// to do with that, and scatters as it is told to.
TEST(ImuSlopes, ErrApartFromWhatAScanSees) {
  constexpr double kDensity = 5e-3;  // rad/s/sqrt(Hz)
  constexpr int kRuns = 500;
  double cross = 0, slope2 = 0, mean2 = 0, angle2 = 0, line_cross = 0, line2 = 0;
  for (int run = 0; run < kRuns; ++run) {
    const Shaking shaking(kDensity, static_cast<std::uint64_t>(run));
    const auto samples = sampled([&](double t) { return shaking.rate(t); }, 400'000'000);
    const ImuInterval imu = slopes(samples, 150'000'000, 250'000'000, 0, {});
    double mean = 0, line = 0;
    for (int i = -20; i < 20; ++i) {
      const double since = 0.0025 * (i + 0.5);
      mean += shaking.angle(0.25 + since) / 40;
      line += shaking.rate(0.25 + since) * since;
    }
    const double slope = imu.gyro_slope.z();
    cross += slope * mean;
    slope2 += slope * slope;
    mean2 += mean * mean;
    angle2 += std::pow(shaking.angle(0.25), 2);
    line_cross += line * mean;
    line2 += line * line;
  }
  // The level before shares the scan's begin: a little is left.
  EXPECT_LT(std::abs(cross) / std::sqrt(slope2 * mean2), 0.3);
  EXPECT_LT(line_cross / std::sqrt(line2 * mean2), -0.5);  // what the level is for

  const WhiteNoise shaken{kDensity, 0};
  EXPECT_NEAR(shaken_angle(shaken) / std::sqrt(angle2 / kRuns), 1, 0.1);
  EXPECT_NEAR(shaken_angle(shaken, 0.1) / std::sqrt(mean2 / kRuns), 1, 0.15);
  const ImuInterval told =
      slopes(sampled([](double) { return 0; }, 400'000'000), 150'000'000, 250'000'000, 0, shaken);
  const double std = told.gyro_slope_noise.z() / std::sqrt(0.1);
  EXPECT_NEAR(std / std::sqrt(slope2 / kRuns), 1, 0.3);
}

TEST(ImuSlopes, LeaveOutWhatIsNoise) {
  const WhiteNoise shaken{5e-3, 0};
  const auto samples = sampled([](double t) { return 0.05 * t; }, 400'000'000);
  EXPECT_EQ(slopes(samples, 150'000'000, 250'000'000, 0, shaken).gyro_slope.z(), 0);
  const auto swift = sampled([](double t) { return 5 * t; }, 400'000'000);
  EXPECT_NEAR(slopes(swift, 150'000'000, 250'000'000, 0, shaken).gyro_slope.z(), 5, 0.25);
}

}  // namespace
}  // namespace arex
