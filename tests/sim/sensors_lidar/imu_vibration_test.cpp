#include "sensors/imu_vibration.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <numbers>
#include <string>
#include <vector>

#include "sensors/imu.h"
#include "support/spectrum.h"

namespace arex::sim {
namespace {

using test::Spectrum;
using test::welch;

constexpr double kPi = std::numbers::pi;
constexpr double kOutput_hz = 200;

/// Accelerometer x, y, z, gyro x, y, z.
using SixSeries = std::array<std::vector<double>, 6>;

void append(SixSeries& series, const Vec3& accel, const Vec3& gyro) {
  for (int i = 0; i < 3; ++i) {
    series[static_cast<std::size_t>(i)].push_back(accel[i]);
    series[static_cast<std::size_t>(i + 3)].push_back(gyro[i]);
  }
}

/// Rotor speeds of a flight about hover: trimmed apart by a few per cent, each wandering by 2 %
/// about its own within half a second, as control makes them.
class Rotors {
 public:
  explicit Rotors(std::uint64_t seed) : random_(seed, "rotors") {}
  std::array<double, 4> next() {
    constexpr std::array<double, 4> kTrim{1.03, 0.97, 1.01, 0.99};
    std::array<double, 4> speeds{};
    for (std::size_t i = 0; i < 4; ++i) {
      wander_[i] += -wander_[i] * 1e-3 / 0.5 + 0.02 * std::sqrt(2e-3 / 0.5) * random_.normal();
      speeds[i] = 716 * kTrim[i] * (1 + wander_[i]);
    }
    return speeds;
  }

 private:
  RandomStream random_;
  std::array<double, 4> wander_{};
};

/// What the IMU gives the stack in such a flight, gravity left in.
SixSeries fly(const ImuConfig& config, std::uint64_t seed, int seconds) {
  ImuModel imu(config, seed);
  Rotors rotors(seed);
  SixSeries series;
  for (int i = 0; i < 1000 * seconds; ++i) {
    Truth truth;
    truth.stamp = i * kNanosecondsPerTick;
    truth.rotor_radps = rotors.next();
    imu.sample(truth);
    if (imu.output()) append(series, imu.output()->accel_mps2, imu.output()->gyro_radps);
  }
  return series;
}

ImuConfig at_level(VibrationLevel level) {
  ImuConfig config;
  config.vibration.level = level;
  return config;
}

/// RMS above 5 Hz of the recorded vehicles (reference.md, section 11).
constexpr std::array<double, 6> kFirefly{1.10, 0.51, 0.86, 0.022, 0.050, 0.038};
constexpr std::array<double, 6> kCubeOrange{1.84, 1.26, 2.04, 0.056, 0.105, 0.067};
constexpr std::array<double, 6> kF450{1.48, 2.76, 2.71, 0.167, 0.130, 0.109};

TEST(ImuVibration, EachLevelIsAsStrongAsItsVehicle) {
  struct Case {
    VibrationLevel level;
    std::array<double, 6> rms;
  };
  for (const auto& [level, rms] :
       {Case{VibrationLevel::kSmooth, kFirefly}, Case{VibrationLevel::kTypical, kCubeOrange},
        Case{VibrationLevel::kRough, kF450}}) {
    for (const std::uint64_t seed : {1U, 2U, 3U}) {
      const SixSeries series = fly(at_level(level), seed, 20);
      for (std::size_t i = 0; i < 6; ++i) {
        EXPECT_NEAR(welch(series[i], kOutput_hz).rms(5, 100) / rms[i], 1, 0.2)
            << "level " << static_cast<int>(level) << " axis " << i << " seed " << seed;
      }
    }
  }
}

TEST(ImuVibration, TypicalFloorBetweenTheLinesIsThatOfRealVehicles) {
  const SixSeries series = fly(at_level(VibrationLevel::kTypical), 4, 30);
  for (std::size_t i = 0; i < 6; ++i) {
    const double floor = welch(series[i], kOutput_hz).floor(10, 100);
    EXPECT_GT(floor, i < 3 ? 0.04 : 9e-4) << i;
    EXPECT_LT(floor, i < 3 ? 0.2 : 8e-3) << i;
  }
}

TEST(ImuVibration, IsSilentAtLevelNoneAndWhereNothingTurns) {
  ImuConfig still = at_level(VibrationLevel::kTypical);
  still.gyro_noise_density = still.accel_noise_density = 0;
  still.gyro_walk_density = still.accel_walk_density = 0;
  ImuModel imu(still, 5);
  Truth truth;
  truth.stamp = 0;
  const ImuSample first = imu.sample(truth);
  for (int i = 1; i < 1000; ++i) {
    truth.stamp = i * kNanosecondsPerTick;
    const ImuSample sample = imu.sample(truth);
    ASSERT_EQ(sample.accel_mps2, first.accel_mps2);
    ASSERT_EQ(sample.gyro_radps, first.gyro_radps);
  }
  VibrationModel none({.level = VibrationLevel::kNone}, 1);
  for (int i = 0; i < 100; ++i) {
    const auto shake = none.step({716, 716, 716, 716});
    ASSERT_EQ(shake.accel_mps2.norm() + shake.gyro_radps.norm(), 0);
  }
}

/// Amplitude of one frequency in a series, by projection.
double amplitude(const std::vector<double>& series, double frequency_hz) {
  std::complex<double> sum = 0;
  for (std::size_t i = 0; i < series.size(); ++i) {
    sum += series[i] * std::polar(1.0, -2 * kPi * frequency_hz * 1e-3 * static_cast<double>(i));
  }
  return 2 * std::abs(sum) / static_cast<double>(series.size());
}

TEST(ImuVibration, EveryRotorHasItsOwnLineAndTheirSquaresAddUp) {
  const std::array<double, 4> revolutions{108, 112, 116, 121};  // per second
  for (const std::uint64_t seed : {1U, 2U}) {
    VibrationModel model({}, seed);
    std::array<double, 4> speeds{};
    for (std::size_t i = 0; i < 4; ++i) speeds[i] = 2 * kPi * revolutions[i];
    std::vector<double> accel_z, gyro_y;
    for (int i = 0; i < 20'000; ++i) {
      const auto shake = model.step(speeds);
      accel_z.push_back(shake.accel_mps2.z());
      gyro_y.push_back(shake.gyro_radps.y());
    }
    const VibrationSpectrum& level = vibration_spectrum(VibrationLevel::kTypical);
    double accel = 0, gyro = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const double growth = std::pow(speeds[i] / 716, 2);
      const double line = amplitude(accel_z, revolutions[i]) / growth;
      EXPECT_GT(line, 0.2 * level[2].once_per_rev);
      EXPECT_LT(amplitude(accel_z, revolutions[i] + 2), 0.1 * line * growth);
      accel += line * line;
      gyro += std::pow(amplitude(gyro_y, revolutions[i]) / growth, 2);
    }
    EXPECT_NEAR(std::sqrt(accel) / level[2].once_per_rev, 1, 0.03);
    EXPECT_NEAR(std::sqrt(gyro) / level[4].once_per_rev, 1, 0.03);
  }
}

TEST(ImuVibration, GrowsWithThrustAndScale) {
  const auto rms = [](double speed, double scale) {
    VibrationModel model({.scale = scale}, 3);
    double sum = 0;
    for (int i = 0; i < 20'000; ++i) {
      sum += model.step({speed, speed, speed, speed}).accel_mps2.squaredNorm();
    }
    return std::sqrt(sum / 20'000);
  };
  const double hover = rms(716, 1);
  EXPECT_NEAR(rms(716 * std::numbers::sqrt2, 1) / hover, 2, 0.05);
  EXPECT_NEAR(rms(716 / std::numbers::sqrt2, 1) / hover, 0.5, 0.02);
  EXPECT_NEAR(rms(716, 0.25) / hover, 0.25, 1e-9);
}

// A shaken airframe stays where it is: what the sensor adds up over a minute is bounded.
TEST(ImuVibration, DriftsNeitherVelocityNorAttitude) {
  for (const auto level : {VibrationLevel::kTypical, VibrationLevel::kRough}) {
    VibrationModel model({.level = level}, 6);
    Rotors rotors(6);
    Vec3 velocity = Vec3::Zero(), angle = Vec3::Zero();
    double most_velocity = 0, most_angle = 0;
    for (int i = 0; i < 60'000; ++i) {
      const auto shake = model.step(rotors.next());
      velocity += 1e-3 * shake.accel_mps2;
      angle += 1e-3 * shake.gyro_radps;
      most_velocity = std::max(most_velocity, velocity.norm());
      most_angle = std::max(most_angle, angle.norm());
    }
    EXPECT_LT(most_velocity, 0.1);  // white from 0 Hz on, 0.1 m/s^2/sqrt(Hz) would make 0.5 m/s
    EXPECT_LT(most_angle, 0.006);
  }
}

// Spun up, flown and spun down, it is where it was: an elastic mount comes back. (Rates that grew
// with the thrust leave 0.5 mrad where the rotors start, which tilts whatever is mapped then.)
TEST(ImuVibration, LeavesNoAngleBehindAsRotorsStartAndStop) {
  constexpr int kRamp = 200, kFlight = 2000, kRest = 2000;  // ticks
  constexpr int kSeeds = 8;
  double squares = 0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    VibrationModel model({}, seed);
    Vec3 angle = Vec3::Zero();
    for (int i = 0; i < 2 * kRamp + kFlight + kRest; ++i) {
      const int until_stop = 2 * kRamp + kFlight - i;
      const double share = std::clamp(std::min(i, until_stop) / static_cast<double>(kRamp), 0., 1.);
      const double speed = 716 * share;
      angle += 1e-3 * model.step({speed, speed, speed, speed}).gyro_radps;
    }
    squares += angle.squaredNorm() / (3 * kSeeds);
  }
  // Of a line that sweeps from zero speed on, a few hundredths of a milliradian remain.
  EXPECT_LT(std::sqrt(squares), 1e-4);
}

#ifdef AREX_REAL_DATA
/// EuRoC's Firefly in the air: 10 to 138 s of the recording, 200 Hz.
SixSeries firefly() {
  std::ifstream in(AREX_REAL_DATA "/imu/euroc_firefly_imu200.csv");
  std::string line;
  std::getline(in, line);  // heading
  SixSeries series;
  double begin = -1;
  while (std::getline(in, line)) {
    std::array<double, 7> v{};
    const char* at = line.c_str();
    for (double& value : v) {
      char* end = nullptr;
      value = std::strtod(at, &end);
      at = end + 1;
    }
    const double time = 1e-9 * v[0];
    if (begin < 0) begin = time;
    if (time - begin <= 10 || time - begin >= 138) continue;
    append(series, {v[4], v[5], v[6]}, {v[1], v[2], v[3]});
  }
  return series;
}

/// sensor_combined of a PX4 log from 6 to 10.5 s, its motors at work: nearly 200 Hz.
SixSeries f450() {
  std::ifstream in(AREX_REAL_DATA "/imu/px4_fmuv5_f450_flight_9s.ulg", std::ios::binary);
  const std::string log{std::istreambuf_iterator<char>(in), {}};
  SixSeries series;
  int topic = -1;
  for (std::size_t at = 16; at + 3 <= log.size();) {
    std::uint16_t size = 0, id = 0;
    std::memcpy(&size, log.data() + at, 2);
    const char type = log[at + 2];
    const char* body = log.data() + at + 3;
    at += 3U + size;
    if (at > log.size()) break;
    if (type == 'A' && std::string(body + 3, size - 3U) == "sensor_combined") {
      std::memcpy(&id, body + 1, 2);
      topic = id;
    }
    if (type != 'D') continue;
    std::memcpy(&id, body, 2);
    if (id != topic) continue;
    std::uint64_t time_us = 0;
    std::array<float, 3> gyro{}, accel{};
    std::memcpy(&time_us, body + 2, 8);
    std::memcpy(gyro.data(), body + 10, 12);
    std::memcpy(accel.data(), body + 30, 12);
    if (time_us < 6'000'000 || time_us >= 10'500'000) continue;
    append(series, Eigen::Vector3f(accel.data()).cast<double>(),
           Eigen::Vector3f(gyro.data()).cast<double>());
  }
  return series;
}

/// In bands, over what was recorded: `most` is the largest factor allowed either way.
void expect_like(const SixSeries& flown, const SixSeries& recorded, double from_hz, double most) {
  for (std::size_t i = 0; i < 6; ++i) {
    const Spectrum a = welch(flown[i], kOutput_hz), b = welch(recorded[i], kOutput_hz);
    EXPECT_NEAR(a.rms(5, 100) / b.rms(5, 100), 1, 0.25) << "axis " << i;
    const std::array<double, 7> edges_hz{5, 10, 20, 40, 60, 80, 100};
    for (std::size_t k = 0; k + 1 < edges_hz.size(); ++k) {
      if (edges_hz[k] < from_hz) continue;
      const double ratio =
          a.level(edges_hz[k], edges_hz[k + 1]) / b.level(edges_hz[k], edges_hz[k + 1]);
      EXPECT_GT(ratio, 1 / most) << "axis " << i << " from " << edges_hz[k] << " Hz";
      EXPECT_LT(ratio, most) << "axis " << i << " from " << edges_hz[k] << " Hz";
    }
  }
}

TEST(ImuVibration, SmoothHasTheSpectraOfTheFirefly) {
  const SixSeries recorded = firefly();
  ASSERT_GT(recorded[0].size(), 25'000U);
  for (const std::uint64_t seed : {1U, 2U}) {
    expect_like(fly(at_level(VibrationLevel::kSmooth), seed, 30), recorded, 5, 2.2);
  }
}

TEST(ImuVibration, RoughHasTheSpectraOfTheF450) {
  const SixSeries recorded = f450();
  ASSERT_GT(recorded[0].size(), 850U);
  // Below 10 Hz that vehicle moved: it was thrown about by hand on the sticks.
  for (const std::uint64_t seed : {1U, 2U}) {
    expect_like(fly(at_level(VibrationLevel::kRough), seed, 30), recorded, 10, 3);
  }
}

// No recording of the vehicle that typical is as strong as has its spectra public: they lie between
// the two that have, but for x, in which it is stronger than both.
TEST(ImuVibration, TypicalLiesBetweenTheRecordings) {
  const SixSeries smooth = firefly(), rough = f450();
  const SixSeries flown = fly(at_level(VibrationLevel::kTypical), 1, 30);
  for (std::size_t i = 0; i < 6; ++i) {
    const Spectrum a = welch(smooth[i], kOutput_hz), b = welch(rough[i], kOutput_hz);
    const Spectrum typical = welch(flown[i], kOutput_hz);
    for (const double from : {10.0, 20.0, 40.0, 60.0, 80.0}) {
      const double to = from < 20 ? 20 : from + 20;
      const double low = std::min(a.level(from, to), b.level(from, to));
      const double high = std::max(a.level(from, to), b.level(from, to));
      EXPECT_GT(typical.level(from, to), 0.8 * low) << "axis " << i << " from " << from;
      EXPECT_LT(typical.level(from, to), 2.2 * high) << "axis " << i << " from " << from;
    }
  }
}
#endif

}  // namespace
}  // namespace arex::sim
