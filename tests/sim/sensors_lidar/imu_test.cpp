#include "sensors/imu.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

namespace arex::sim {
namespace {

constexpr double kPi = std::numbers::pi;

ImuConfig quiet() {
  ImuConfig config;
  config.gyro_noise_density = config.gyro_walk_density = config.gyro_bias_sigma_radps = 0;
  config.accel_noise_density = config.accel_walk_density = config.accel_bias_sigma_mps2 = 0;
  config.gyro_scale_sigma_fraction = config.accel_scale_sigma_fraction = 0;
  config.vibration.level = VibrationLevel::kNone;
  return config;
}

Truth at_tick(std::int64_t tick) {
  Truth truth;
  truth.stamp = tick * kNanosecondsPerTick;
  return truth;
}

/// Amplitude of one frequency in a series, by projection over whole seconds.
double amplitude(const std::vector<double>& series, double frequency_hz, double rate_hz) {
  std::complex<double> sum = 0;
  for (std::size_t i = 0; i < series.size(); ++i) {
    const double phase = 2 * kPi * frequency_hz * static_cast<double>(i) / rate_hz;
    sum += series[i] * std::polar(1.0, -phase);
  }
  return 2 * std::abs(sum) / static_cast<double>(series.size());
}

TEST(ImuModel, MeasuresSpecificForceAndRateInTheBody) {
  ImuConfig config;
  config.noise_free = true;
  ImuModel imu(config, 1);
  Truth truth = at_tick(0);
  EXPECT_TRUE(imu.sample(truth).accel_mps2.isApprox(Vec3(0, 0, kGravity)));  // at rest
  truth.a_WB = {0, 0, -kGravity};
  EXPECT_LT(imu.sample(truth).accel_mps2.norm(), 1e-12);  // free fall
  truth.a_WB = {1, 2, 3};
  truth.w_WB_B = {0.1, -0.2, 0.3};
  truth.X_WB.R = so3::from_yaw(kPi / 2);  // body x along W's y
  const ImuSample sample = imu.sample(truth);
  EXPECT_TRUE(sample.accel_mps2.isApprox(Vec3(2, -1, 3 + kGravity)));
  EXPECT_EQ(sample.gyro_radps, truth.w_WB_B);
}

TEST(ImuModel, DeliversEachSensorAtItsRateWithItsClock) {
  ImuConfig config;
  config.clock_offset_s = 0.02;
  ImuModel imu(config, 1);
  for (std::int64_t tick = 0; tick < 1000; ++tick) {
    const ImuSample raw = imu.sample(at_tick(tick));
    ASSERT_EQ(raw.stamp, tick * kNanosecondsPerTick + 20'000'000);
    ASSERT_EQ(imu.output().has_value(), tick % 5 == 0);
    ASSERT_EQ(imu.magnetometer().has_value(), tick % 5 == 0);
    ASSERT_EQ(imu.barometer().has_value(), tick % 20 == 0);
    if (imu.output()) {
      ASSERT_EQ(imu.output()->stamp, raw.stamp);
      ASSERT_EQ(imu.output()->field_gauss, imu.magnetometer()->field_gauss);
    }
  }
}

TEST(ImuModel, WhiteNoiseHasItsDensity) {
  ImuConfig config = quiet();
  config.gyro_noise_density = ImuConfig{}.gyro_noise_density;
  config.accel_noise_density = ImuConfig{}.accel_noise_density;
  for (const std::uint64_t seed : {1U, 2U}) {
    ImuModel imu(config, seed);
    Vec3 gyro = Vec3::Zero(), accel = Vec3::Zero();
    constexpr int kCount = 20'000;
    for (int i = 0; i < kCount; ++i) {
      const ImuSample sample = imu.sample(at_tick(i));
      gyro += sample.gyro_radps.cwiseAbs2();
      accel += (sample.accel_mps2 - Vec3(0, 0, kGravity)).cwiseAbs2();
    }
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(std::sqrt(gyro[axis] / kCount), 1.0e-4 * std::sqrt(1000), 0.05 * 3.16e-3);
      EXPECT_NEAR(std::sqrt(accel[axis] / kCount), 1.4e-3 * std::sqrt(1000), 0.05 * 0.0443);
    }
  }
}

/// Overlapping Allan variance of rates sampled every `step_s`, by their integral.
double allan_variance(const std::vector<double>& integral, double step_s, std::size_t cluster) {
  double sum = 0;
  const std::size_t count = integral.size() - 2 * cluster;
  for (std::size_t i = 0; i < count; ++i) {
    const double d = integral[i + 2 * cluster] - 2 * integral[i + cluster] + integral[i];
    sum += d * d;
  }
  const double tau = step_s * static_cast<double>(cluster);
  return sum / (2 * tau * tau * static_cast<double>(count));
}

// An hour at rest, as the stack gets it: white noise over short times, the walk over long ones,
// N^2 / tau + K^2 tau / 3. Pixhawk 6-series at rest (Allan): accelerometer 6.2e-4 to 1.0e-3, gyro
// 6.1e-5 to 6.3e-5, walks 2.6e-5 and 9e-7 (6C).
TEST(ImuModel, AllanDeviationOverAnHourIsThatOfItsDensities) {
  constexpr double kStep_s = 0.1;
  constexpr int kPerStep = 20;  // of 200 Hz
  constexpr int kTicks = 3'600'000;
  std::array<std::vector<double>, 6> integral;
  ImuModel imu(ImuConfig{}, 3);
  Vec3 gyro = Vec3::Zero(), accel = Vec3::Zero();
  int samples = 0;
  for (int tick = 0; tick < kTicks; ++tick) {
    imu.sample(at_tick(tick));
    if (!imu.output()) continue;
    gyro += imu.output()->gyro_radps * 0.005;
    accel += (imu.output()->accel_mps2 - Vec3(0, 0, kGravity)) * 0.005;
    if (++samples % kPerStep != 0) continue;
    for (int axis = 0; axis < 3; ++axis) {
      integral[static_cast<std::size_t>(axis)].push_back(gyro[axis]);
      integral[static_cast<std::size_t>(axis) + 3].push_back(accel[axis]);
    }
  }
  const ImuConfig config;
  const auto expect = [&](std::size_t first, double white, double walk) {
    for (const double tau : {0.1, 1.0, 10.0, 100.0, 300.0}) {
      const auto cluster = static_cast<std::size_t>(tau / kStep_s + 0.5);
      double mean = 0;
      for (std::size_t axis = first; axis < first + 3; ++axis) {
        mean += allan_variance(integral[axis], kStep_s, cluster) / 3;
      }
      const double expected = white * white / tau + walk * walk * tau / 3;
      // Three axes of an hour have some 3 * 3600 / tau clusters of their own.
      EXPECT_NEAR(std::sqrt(mean / expected), 1, 0.03 + 2 * std::sqrt(0.5 * tau / 10'800))
          << "from " << first << " over " << tau << " s";
    }
  };
  expect(0, config.gyro_noise_density, config.gyro_walk_density);
  expect(3, config.accel_noise_density, config.accel_walk_density);
  EXPECT_LE(config.accel_walk_density, 1e-4);
  EXPECT_TRUE(config.gyro_walk_density >= 1e-6 && config.gyro_walk_density <= 1e-5);
}

TEST(ImuModel, BiasesStartWithTheirSpreadAndWalk) {
  // Over many seeds: the spread at the start and after 4 s of walk.
  ImuConfig config = quiet();
  const ImuConfig defaults;
  config.gyro_bias_sigma_radps = defaults.gyro_bias_sigma_radps;
  config.accel_bias_sigma_mps2 = defaults.accel_bias_sigma_mps2;
  config.gyro_walk_density = defaults.gyro_walk_density;
  config.accel_walk_density = defaults.accel_walk_density;
  constexpr int kSeeds = 700, kTicks = 100;
  double gyro0 = 0, accel0 = 0, gyro_walk = 0, accel_walk = 0;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    ImuModel imu(config, seed);
    const Vec3 gyro = imu.gyro_bias(), accel = imu.accel_bias();
    gyro0 += gyro.squaredNorm();
    accel0 += accel.squaredNorm();
    ImuSample last;
    for (int i = 0; i < kTicks; ++i) last = imu.sample(at_tick(i));
    gyro_walk += (last.gyro_radps - gyro).squaredNorm();
    accel_walk += (last.accel_mps2 - Vec3(0, 0, kGravity) - accel).squaredNorm();
  }
  const auto rms = [&](double sum) { return std::sqrt(sum / (3 * kSeeds)); };
  const double root_time = std::sqrt(1e-3 * kTicks);
  EXPECT_NEAR(rms(gyro0) / 0.002, 1, 0.05);
  EXPECT_NEAR(rms(accel0) / 0.03, 1, 0.05);
  EXPECT_NEAR(rms(gyro_walk) / (2.0e-6 * root_time), 1, 0.05);
  EXPECT_NEAR(rms(accel_walk) / (5.0e-5 * root_time), 1, 0.05);
}

TEST(ImuModel, ClipsAtItsRange) {
  ImuModel imu(quiet(), 1);
  Truth truth = at_tick(0);
  truth.w_WB_B = {40, -50, 1};
  truth.a_WB = {-300, 0, 200};
  const ImuSample sample = imu.sample(truth);
  EXPECT_TRUE(sample.gyro_radps.isApprox(Vec3(34.906585039886591, -34.906585039886591, 1)));
  EXPECT_TRUE(sample.accel_mps2.isApprox(Vec3(-16 * kGravity, 0, 16 * kGravity)));
}

/// Of the mean of five samples of 1 kHz: Dirichlet's kernel.
double mean_of_five(double frequency_hz) {
  const double half_turn = kPi * 1e-3 * frequency_hz;
  return std::abs(std::sin(5 * half_turn) / (5 * std::sin(half_turn)));
}

/// Of a second-order Butterworth low-pass, pre-warped to its cut-off.
double low_pass(double frequency_hz, double cutoff_hz) {
  const double ratio = std::tan(kPi * 1e-3 * frequency_hz) / std::tan(kPi * 1e-3 * cutoff_hz);
  return 1 / std::sqrt(1 + std::pow(ratio, 4));
}

std::vector<double> output_of_a_line(const ImuConfig& config, double frequency_hz) {
  ImuModel imu(config, 7);
  std::vector<double> output;
  for (int i = 0; i < 4000; ++i) {
    Truth truth = at_tick(i);
    truth.a_WB.x() = std::cos(2 * kPi * 1e-3 * frequency_hz * i);
    imu.sample(truth);
    // The first of four seconds still holds the filter's transient, 0.1 % of the record.
    if (imu.output()) output.push_back(imu.output()->accel_mps2.x());
  }
  return output;
}

TEST(ImuModel, OutputAliasesAsTheMeanLeavesIt) {
  // 114 Hz, about one per revolution, lies above half of 200 Hz and comes out at 86 Hz.
  ImuConfig config = quiet();
  for (const double cutoff_hz : {0., 90.}) {
    config.output_cutoff_hz = cutoff_hz;
    const double expected = mean_of_five(114) * (cutoff_hz > 0 ? low_pass(114, cutoff_hz) : 1);
    const std::vector<double> output = output_of_a_line(config, 114);
    EXPECT_NEAR(amplitude(output, 86, 200), expected, 0.02 * expected);
    EXPECT_LT(amplitude(output, 50, 200), 0.02 * expected);
  }
}

TEST(ImuModel, ALineAtTheOutputsRateIsNotTakenForAStandingTurn) {
  // Every fifth sample of it is the same one.
  const std::vector<double> output = output_of_a_line(quiet(), 200);
  for (std::size_t i = 1; i < output.size(); ++i) ASSERT_NEAR(output[i], 0, 1e-12);
}

// What the stack integrates is what the sensor felt, also while rotors start and their lines sweep
// over multiples of the output's rate.
TEST(ImuModel, OutputsAddUpToTheRawSamples) {
  ImuConfig config;
  config.vibration.level = VibrationLevel::kRough;
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    ImuModel imu(config, seed);
    Vec3 raw = Vec3::Zero(), output = Vec3::Zero();
    for (int i = 0; i <= 5000; ++i) {
      Truth truth = at_tick(i);
      truth.rotor_radps.fill(std::min(0.4 * i, 900.));
      const ImuSample sample = imu.sample(truth);
      if (i == 0) continue;  // the first output has but one sample
      raw += 1e-3 * sample.gyro_radps;
      if (imu.output()) output += 5e-3 * imu.output()->gyro_radps;
    }
    EXPECT_LT((output - raw).norm(), 1e-12);
    EXPECT_GT(raw.norm(), 1e-4);
  }
}

TEST(ImuModel, OutputPassesSlowMotionWithItsDelay) {
  // The middle of five samples is two old; a second-order Butterworth adds sqrt 2 / (2 pi f).
  ImuConfig config = quiet();
  for (const double cutoff_hz : {0., 90.}) {
    config.output_cutoff_hz = cutoff_hz;
    ImuModel imu(config, 8);
    const double delay_s =
        0.002 + (cutoff_hz > 0 ? std::numbers::sqrt2 / (2 * kPi * cutoff_hz) : 0);
    for (int i = 0; i < 2000; ++i) {
      Truth truth = at_tick(i);
      truth.w_WB_B.x() = std::sin(2 * kPi * 1e-3 * i);  // 1 Hz
      imu.sample(truth);
      if (!imu.output() || i < 500) continue;
      EXPECT_NEAR(imu.output()->gyro_radps.x(), std::sin(2 * kPi * (1e-3 * i - delay_s)), 1e-3);
    }
  }
}

TEST(ImuModel, MagnetometerAndBarometerReadTheEarth) {
  ImuConfig config;
  config.magnetometer_bias_sigma_gauss = 0;
  ImuModel imu(config, 10);
  Truth truth;
  truth.X_WB = {so3::from_yaw(kPi / 2), {0, 0, 50}};
  Vec3 field = Vec3::Zero(), field2 = Vec3::Zero();
  double pressure = 0, pressure2 = 0;
  const Vec3 expected_field(0.375, 0.019, -0.253);
  const double expected_pressure = 101325 * std::exp(-50 / 8434.5);
  constexpr int kSamples = 5000;
  for (int i = 0; i < kSamples; ++i) {
    truth.stamp = i * Stamp{20} * kNanosecondsPerTick;  // due for all
    imu.sample(truth);
    field += imu.magnetometer()->field_gauss / kSamples;
    field2 += (imu.magnetometer()->field_gauss - expected_field).cwiseAbs2() / kSamples;
    pressure += imu.barometer()->pressure_pa / kSamples;
    pressure2 += std::pow(imu.barometer()->pressure_pa - expected_pressure, 2) / kSamples;
  }
  EXPECT_LT((field - expected_field).norm(), 4e-4);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(std::sqrt(field2[axis]), 4e-4 * std::sqrt(200), 0.05 * 5.66e-3);
  }
  EXPECT_NEAR(pressure, expected_pressure, 0.1);
  EXPECT_NEAR(std::sqrt(pressure2), 1.0, 0.05);
}

TEST(ImuModel, RepeatsForASeedAndDiffersForAnother) {
  ImuModel a(ImuConfig{}, 1), b(ImuConfig{}, 1), c(ImuConfig{}, 2);
  for (int i = 0; i < 100; ++i) {
    Truth truth = at_tick(i);
    truth.rotor_radps = {700, 710, 720, 730};
    const ImuSample sample = a.sample(truth);
    ASSERT_EQ(sample.gyro_radps, b.sample(truth).gyro_radps);
    ASSERT_NE(sample.gyro_radps, c.sample(truth).gyro_radps);
  }
}

}  // namespace
}  // namespace arex::sim
