#include "odometry/inertial/standstill.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "math/so3.h"

namespace arex {
namespace {

/// Below that frequency nothing shakes an IMU: there it would move the vehicle.
constexpr double kShakingEnds_hz = 3;

/// The samples of the last `window_s` before the newest.
std::span<const ImuSample> newest(std::span<const ImuSample> samples, double window_s) {
  const Stamp begin = samples.back().stamp - from_seconds(window_s);
  const auto first = std::lower_bound(samples.begin(), samples.end(), begin,
                                      [](const ImuSample& s, Stamp t) { return s.stamp < t; });
  return {first, samples.end()};
}

}  // namespace

double scatter_of_integral(double density) {
  return density / (2 * std::numbers::pi * std::sqrt(kShakingEnds_hz));
}

ImuMoments moments(std::span<const ImuSample> samples) {
  ImuMoments m;
  const auto n = static_cast<double>(samples.size());
  for (const ImuSample& s : samples) {
    m.gyro_mean += s.gyro_radps / n;
    m.accel_mean += s.accel_mps2 / n;
  }
  Vec3 gyro = Vec3::Zero(), accel = Vec3::Zero();
  for (const ImuSample& s : samples) {
    gyro += (s.gyro_radps - m.gyro_mean).cwiseAbs2() / n;
    accel += (s.accel_mps2 - m.accel_mean).cwiseAbs2() / n;
  }
  m.gyro_std = std::sqrt(gyro.maxCoeff());
  m.accel_std = std::sqrt(accel.maxCoeff());
  return m;
}

Mat3 level(const Vec3& f_B) {
  const double roll = std::atan2(f_B.y(), f_B.z());
  const double pitch = std::atan2(-f_B.x(), std::hypot(f_B.y(), f_B.z()));
  return so3::Exp({0, pitch, 0}) * so3::Exp({roll, 0, 0});
}

WhiteNoise white_noise(std::span<const ImuSample> samples) {
  constexpr std::size_t kBlock = 5;  // 25 ms at 200 Hz: some time constants of the filters
  const std::size_t blocks = samples.size() / kBlock;
  if (blocks < 3) return {};
  std::vector<Vec3> gyro_means(blocks, Vec3::Zero()), accel_means(blocks, Vec3::Zero());
  for (std::size_t i = 0; i < blocks * kBlock; ++i) {
    gyro_means[i / kBlock] += samples[i].gyro_radps / kBlock;
    accel_means[i / kBlock] += samples[i].accel_mps2 / kBlock;
  }
  double gyro = 0, accel = 0;
  const auto bend = [](const std::vector<Vec3>& means, std::size_t b) {
    return (means[b - 2] - 2 * means[b - 1] + means[b]).squaredNorm();
  };
  for (std::size_t b = 2; b < blocks; ++b) {
    gyro += bend(gyro_means, b);
    accel += bend(accel_means, b);
  }
  // White noise: the variance of a mean, times its time; a second difference has six of them.
  const double period_s = to_seconds(samples.back().stamp - samples.front().stamp) /
                          static_cast<double>(samples.size() - 1);
  const double axes = 3, differences = static_cast<double>(blocks - 2);
  const double share = kBlock * period_s / (6 * axes * differences);
  return {std::sqrt(gyro * share), std::sqrt(accel * share)};
}

ImuNoiseConfig scaled_to_measured(ImuNoiseConfig imu, const WhiteNoise& measured) {
  const double gyro = std::max(1.0, measured.gyro / imu.gyro_noise_density);
  const double accel = std::max(1.0, measured.accel / imu.accel_noise_density);
  imu.gyro_noise_density *= gyro;
  imu.gyro_walk_density *= gyro;
  imu.accel_noise_density *= accel;
  imu.accel_walk_density *= accel;
  return imu;
}

ImuNoiseConfig shaken_by(ImuNoiseConfig imu, const WhiteNoise& measured) {
  // Two of the integral's scatters, at the begin and the end of a scan of 0.1 s, are what white
  // noise of 0.4 of the density makes of it.
  constexpr double kScan_s = 0.1;
  const double share = std::sqrt(2.0) * scatter_of_integral(1) / std::sqrt(kScan_s);
  imu.accel_noise_density = std::max(imu.accel_noise_density, share * measured.accel);
  return imu;
}

double shaken_angle(const WhiteNoise& measured, double mean_over_s) {
  // The mean's spectrum goes with sinc^2(f T): integrated, within a tenth of this up to 0.15 s.
  constexpr double kCut = 5;
  return scatter_of_integral(measured.gyro) / std::hypot(1, kCut * kShakingEnds_hz * mean_over_s);
}

double shaken_speed(const WhiteNoise& measured) { return scatter_of_integral(measured.accel); }

OdometryNeed missing_for_start(std::span<const ImuSample> samples,
                               const StaticInitialiserConfig& config) {
  if (samples.size() < 2) return OdometryNeed::kImu;
  const bool whole = samples.front().stamp <= samples.back().stamp - from_seconds(config.window_s);
  if (!whole || has_gap(samples)) return OdometryNeed::kImu;
  const ImuMoments m = moments(newest(samples, config.window_s));
  if (m.gyro_std > config.max_gyro_std_radps) return OdometryNeed::kGyroNoise;
  if (m.accel_std > config.max_accel_std_mps2) return OdometryNeed::kAccelNoise;
  if (m.gyro_mean.norm() > config.max_gyro_mean_radps) return OdometryNeed::kGyroBias;
  if (m.accel_mean.norm() < 0.5 * kGravity) return OdometryNeed::kAccelMagnitude;
  return OdometryNeed::kNothing;
}

std::optional<Standstill> measure_standstill(std::span<const ImuSample> samples,
                                             const StaticInitialiserConfig& config) {
  if (missing_for_start(samples, config) != OdometryNeed::kNothing) return std::nullopt;
  const std::span<const ImuSample> window = newest(samples, config.window_s);
  return Standstill{samples.back().stamp, window.size(), moments(window), white_noise(window)};
}

bool stands_still(std::span<const ImuSample> samples, const NavigationState& x, double accel_scale,
                  const StaticInitialiserConfig& config, const WhiteNoise& noise) {
  if (samples.size() < 2) return false;
  const ImuMoments m = moments(samples);
  // A mean over less time is noisier.
  const double reach =
      config.still_sigma / std::sqrt(to_seconds(samples.back().stamp - samples.front().stamp));
  const Vec3 rate = x.rate(m.gyro_mean);
  const Vec3 force = accel_scale * m.accel_mean - (x.b_a - x.R_OB.transpose() * x.g_O);
  return m.gyro_std < config.max_gyro_std_radps && m.accel_std < config.max_accel_std_mps2 &&
         rate.norm() < std::hypot(config.still_rate_radps, reach * noise.gyro) &&
         force.norm() < std::hypot(config.still_force_mps2, reach * noise.accel);
}

}  // namespace arex
