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
  config.vibration.broadband_mps2 = 0;
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
    ASSERT_EQ(imu.magnetometer().has_value(), tick % 20 == 0);
    ASSERT_EQ(imu.barometer().has_value(), tick % 20 == 0);
    if (imu.output()) {
      ASSERT_EQ(imu.output()->stamp, raw.stamp);
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

// Allan deviation of the default sensor at rest: where white noise rules it is density / sqrt(tau).
TEST(ImuModel, AllanDeviationFollowsTheDensity) {
  constexpr double kTau_s = 0.1;
  constexpr int kCluster = 100, kClusters = 3000;
  ImuModel imu(ImuConfig{}, 3);
  Vec3 previous = Vec3::Zero(), sum = Vec3::Zero();
  for (int c = 0; c < kClusters; ++c) {
    Vec3 mean = Vec3::Zero();
    for (int i = 0; i < kCluster; ++i) {
      mean += imu.sample(at_tick(std::int64_t{c} * kCluster + i)).gyro_radps / kCluster;
    }
    if (c > 0) sum += (mean - previous).cwiseAbs2();
    previous = mean;
  }
  for (int axis = 0; axis < 3; ++axis) {
    const double allan = std::sqrt(sum[axis] / (2 * (kClusters - 1)));
    EXPECT_NEAR(allan, 1.0e-4 / std::sqrt(kTau_s), 0.05 * 1.0e-4 / std::sqrt(kTau_s));
  }
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
  EXPECT_NEAR(rms(gyro_walk) / (2.0e-5 * root_time), 1, 0.05);
  EXPECT_NEAR(rms(accel_walk) / (1.0e-3 * root_time), 1, 0.05);
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

struct Series {
  std::vector<double> accel_x, accel_z, gyro_x, output_x;
};

Series record(ImuModel& imu, const std::array<double, 4>& rotor_radps, int seconds) {
  Series series;
  for (int i = 0; i < 1000 * seconds; ++i) {
    Truth truth = at_tick(i);
    truth.rotor_radps = rotor_radps;
    const ImuSample sample = imu.sample(truth);
    series.accel_x.push_back(sample.accel_mps2.x());
    series.accel_z.push_back(sample.accel_mps2.z() - kGravity);
    series.gyro_x.push_back(sample.gyro_radps.x());
    if (imu.output()) series.output_x.push_back(imu.output()->accel_mps2.x());
  }
  return series;
}

TEST(ImuVibration, LinesOfOneRotorGrowWithTheSquareOfItsSpeed) {
  for (const double revolutions : {114.0, 57.0}) {  // per second; whole turns in the record
    const double speed = 2 * kPi * revolutions;
    const double growth = 0.5 * std::pow(speed / 716, 2);
    ImuModel imu(quiet(), 4);
    const Series series = record(imu, {speed, 0, 0, 0}, 4);
    EXPECT_NEAR(amplitude(series.accel_x, revolutions, 1000), 2 * growth, 0.01 * growth);
    EXPECT_NEAR(amplitude(series.accel_z, 2 * revolutions, 1000), 1 * growth, 0.01 * growth);
    EXPECT_NEAR(amplitude(series.gyro_x, revolutions, 1000), 0.03 * growth, 0.001 * growth);
    EXPECT_LT(amplitude(series.accel_x, revolutions + 5, 1000), 0.01 * growth);
  }
}

TEST(ImuVibration, FourRotorsAddToTheConfiguredRms) {
  // Near hover and a hertz apart: a peak of 2 m/s^2 has an RMS of sqrt 2.
  ImuModel imu(quiet(), 5);
  std::array<double, 4> speeds{};
  for (std::size_t i = 0; i < 4; ++i) speeds[i] = 2 * kPi * (112.5 + static_cast<double>(i));
  const Series series = record(imu, speeds, 4);
  double x = 0, z = 0, gyro = 0;
  for (std::size_t i = 0; i < series.accel_x.size(); ++i) {
    x += std::pow(series.accel_x[i], 2) / 4000;
    z += std::pow(series.accel_z[i], 2) / 4000;
    gyro += std::pow(series.gyro_x[i], 2) / 4000;
  }
  EXPECT_NEAR(std::sqrt(x), 2 / std::numbers::sqrt2, 0.05 * 1.414);
  EXPECT_NEAR(std::sqrt(z), 1 / std::numbers::sqrt2, 0.05 * 0.707);
  EXPECT_NEAR(std::sqrt(gyro), 0.03 / std::numbers::sqrt2, 0.05 * 0.0212);
}

TEST(ImuVibration, BroadbandHasItsRms) {
  ImuConfig config = quiet();
  config.vibration.broadband_mps2 = 0.3;
  config.vibration.once_per_rev_mps2 = 0;
  ImuModel imu(config, 6);
  const Series series = record(imu, {716, 716, 716, 716}, 10);
  double sum = 0;
  for (const double value : series.accel_x) sum += value * value;
  EXPECT_NEAR(std::sqrt(sum / 10'000), 0.3, 0.05 * 0.3);
}

TEST(ImuVibration, AliasesInTheOutputAsTheFilterLeavesIt) {
  // One per revolution at 114 Hz lies above half of 200 Hz and comes out at 86 Hz.
  ImuModel imu(quiet(), 7);
  const double speed = 2 * kPi * 114;
  const Series series = record(imu, {speed, 0, 0, 0}, 4);
  const double ratio = std::tan(kPi * 114e-3) / std::tan(kPi * 90e-3);
  const double expected = std::pow(speed / 716, 2) / std::sqrt(1 + std::pow(ratio, 4));
  // The first of four seconds still holds the filter's transient, 0.1 % of the record.
  EXPECT_NEAR(amplitude(series.output_x, 86, 200), expected, 0.02 * expected);
  EXPECT_LT(amplitude(series.output_x, 50, 200), 0.02 * expected);
}

TEST(ImuModel, OutputPassesSlowMotionWithTheFiltersDelay) {
  // A second-order Butterworth delays slow signals by sqrt 2 / (2 pi f).
  ImuConfig config = quiet();
  ImuModel imu(config, 8);
  const double delay_s = std::numbers::sqrt2 / (2 * kPi * config.output_cutoff_hz);
  for (int i = 0; i < 2000; ++i) {
    Truth truth = at_tick(i);
    truth.w_WB_B.x() = std::sin(2 * kPi * 1e-3 * i);  // 1 Hz
    imu.sample(truth);
    if (!imu.output() || i < 500) continue;
    EXPECT_NEAR(imu.output()->gyro_radps.x(), std::sin(2 * kPi * (1e-3 * i - delay_s)), 1e-3);
  }
}

TEST(ImuVibration, WeakFrameRocksAtItsMode) {
  // Steady response of q'' + 2 z w0 q' + w0^2 q = -alpha to a sine: |q'| = A w / |w0^2 - w^2 + 2 j
  // z w0 w|.
  const double w0 = 2 * kPi * 80, z = 0.03;
  for (const double frequency : {20.0, 60.0, 80.0, 100.0}) {
    ImuConfig config = quiet();
    config.vibration.frame_coupling = 1;
    ImuModel imu(config, 9);
    const double w = 2 * kPi * frequency;
    std::vector<double> gyro;
    for (int i = 0; i < 2000; ++i) {
      Truth truth = at_tick(i);
      truth.alpha_WB_B.x() = 10 * std::cos(w * 1e-3 * i);
      const double value = imu.sample(truth).gyro_radps.x();
      if (i >= 1000) gyro.push_back(value);
    }
    const double gain = 10 * w / std::abs(std::complex<double>(w0 * w0 - w * w, 2 * z * w0 * w));
    // Held over a tick, the drive loses sin(x)/x of its amplitude.
    const double held = std::sin(w * 0.5e-3) / (w * 0.5e-3);
    EXPECT_NEAR(amplitude(gyro, frequency, 1000), gain * held, 0.02 * gain) << frequency << " Hz";
  }
  ImuModel stiff(quiet(), 9);
  Truth truth = at_tick(0);
  truth.alpha_WB_B.x() = 10;
  EXPECT_EQ(stiff.sample(truth).gyro_radps.norm(), 0);
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
    truth.stamp = i * Stamp{20} * kNanosecondsPerTick;
    imu.sample(truth);
    field += imu.magnetometer()->field_gauss / kSamples;
    field2 += (imu.magnetometer()->field_gauss - expected_field).cwiseAbs2() / kSamples;
    pressure += imu.barometer()->pressure_pa / kSamples;
    pressure2 += std::pow(imu.barometer()->pressure_pa - expected_pressure, 2) / kSamples;
  }
  EXPECT_LT((field - expected_field).norm(), 2e-4);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(std::sqrt(field2[axis]), 4e-4 * std::sqrt(50), 0.05 * 2.83e-3);
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
