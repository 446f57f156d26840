#include "odometry/static_initialiser.h"

#include <algorithm>
#include <cmath>

#include "math/so3.h"

namespace arex {
namespace {

struct Moments {
  Vec3 gyro_mean = Vec3::Zero(), accel_mean = Vec3::Zero();
  double gyro_std = 0, accel_std = 0;  ///< the largest axis
};

Moments moments(std::span<const ImuSample> samples) {
  Moments m;
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

ErrorMatrix prior_covariance(const StaticInitialiserConfig& sc) {
  // Gravity before it is measured.
  constexpr double kGravityPriorStd = 10.0;
  ErrorMatrix P = ErrorMatrix::Zero();
  const auto set = [&P](int block, double std) {
    P.diagonal().segment<3>(block).setConstant(std * std);
  };
  set(kRotation, kDefinedStd);
  set(kPosition, kDefinedStd);
  set(kVelocity, kDefinedStd);
  set(kGyroBias, sc.gyro_bias_std_radps);
  set(kAccelBias, sc.accel_bias_std_mps2);
  set(kGravityBlock, kGravityPriorStd);
  return P;
}

/// Adds doubt about the mounting. The map is made by the LiDAR, so O is where the map is: what the
/// start fixes is the LiDAR's pose in O, and gravity in B. An error of the mounting is at first one
/// of B's pose and of gravity in O as well, and only motion tells them apart.
void doubt_mounting(const LidarInertialConfig& config, const NavigationState& x, ErrorMatrix& P) {
  Eigen::Matrix<double, kErrorDim, 6> T = Eigen::Matrix<double, kErrorDim, 6>::Zero();
  T.block<3, 3>(kExtrinsicRotation, 0) = Mat3::Identity();
  T.block<3, 3>(kExtrinsicPosition, 3) = Mat3::Identity();
  const Mat3 turn = -x.X_BL.R;  // of B, that keeps R_OL
  T.block<3, 3>(kRotation, 0) = turn;
  T.block<3, 3>(kPosition, 0) = x.R_OB * so3::hat(x.X_BL.p) * turn;  // keeps p_OL
  T.block<3, 3>(kPosition, 3) = -x.R_OB;
  T.block<3, 3>(kGravityBlock, 0) = -x.R_OB * so3::hat(x.R_OB.transpose() * x.g_O) * turn;
  Eigen::Matrix<double, 6, 1> variance;
  variance.head<3>().setConstant(std::pow(config.extrinsic_rotation_std_rad, 2));
  variance.tail<3>().setConstant(std::pow(config.extrinsic_position_std_m, 2));
  P += T * variance.asDiagonal() * T.transpose();
}

/// The samples of the last `window_s` before the newest.
std::span<const ImuSample> newest(std::span<const ImuSample> samples, double window_s) {
  const Stamp begin = samples.back().stamp - from_seconds(window_s);
  const auto first = std::lower_bound(samples.begin(), samples.end(), begin,
                                      [](const ImuSample& s, Stamp t) { return s.stamp < t; });
  return {first, samples.end()};
}

/// Roll and pitch that turn the specific force f_B to z; yaw zero.
Mat3 level(const Vec3& f_B) {
  const double roll = std::atan2(f_B.y(), f_B.z());
  const double pitch = std::atan2(-f_B.x(), std::hypot(f_B.y(), f_B.z()));
  return so3::Exp({0, pitch, 0}) * so3::Exp({roll, 0, 0});
}

}  // namespace

WhiteNoise white_noise(std::span<const ImuSample> samples) {
  constexpr std::size_t kBlock = 5;  // 25 ms at 200 Hz: some time constants of the filters
  const std::size_t blocks = samples.size() / kBlock;
  if (blocks < 2) return {};
  const auto block = [&](std::size_t b) { return moments(samples.subspan(b * kBlock, kBlock)); };
  double gyro = 0, accel = 0;
  for (std::size_t b = 1; b < blocks; ++b) {
    const Moments before = block(b - 1), after = block(b);
    gyro += (after.gyro_mean - before.gyro_mean).squaredNorm();
    accel += (after.accel_mean - before.accel_mean).squaredNorm();
  }
  // White noise: the variance of a mean, times its time.
  const double period_s = to_seconds(samples.back().stamp - samples.front().stamp) /
                          static_cast<double>(samples.size() - 1);
  const double axes = 3, differences = static_cast<double>(blocks - 1);
  const double share = kBlock * period_s / (2 * axes * differences);
  return {std::sqrt(gyro * share), std::sqrt(accel * share)};
}

bool has_gap(std::span<const ImuSample> samples) {
  return std::adjacent_find(samples.begin(), samples.end(),
                            [](const ImuSample& a, const ImuSample& b) {
                              return b.stamp - a.stamp > kMaxImuGap;
                            }) != samples.end();
}

OdometryNeed missing_for_start(std::span<const ImuSample> samples,
                               const StaticInitialiserConfig& config) {
  if (samples.size() < 2) return OdometryNeed::kImu;
  const bool whole = samples.front().stamp <= samples.back().stamp - from_seconds(config.window_s);
  if (!whole || has_gap(samples)) return OdometryNeed::kImu;
  const Moments m = moments(newest(samples, config.window_s));
  if (m.gyro_std > config.max_gyro_std_radps) return OdometryNeed::kGyroNoise;
  if (m.accel_std > config.max_accel_std_mps2) return OdometryNeed::kAccelNoise;
  if (m.gyro_mean.norm() > config.max_gyro_mean_radps) return OdometryNeed::kGyroBias;
  if (m.accel_mean.norm() < 0.5 * kGravity) return OdometryNeed::kAccelMagnitude;
  return OdometryNeed::kNothing;
}

std::optional<StaticStart> start_from_standstill(std::span<const ImuSample> samples,
                                                 const Pose& X_BL,
                                                 const LidarInertialConfig& config) {
  const StaticInitialiserConfig& sc = config.initialiser;
  if (missing_for_start(samples, sc) != OdometryNeed::kNothing) return std::nullopt;
  const std::span<const ImuSample> window = newest(samples, sc.window_s);
  const Moments m = moments(window);

  StaticStart start;
  start.stamp = samples.back().stamp;
  start.accel_scale = config.scale_accel ? kGravity / m.accel_mean.norm() : 1;
  const Vec3 f_B = start.accel_scale * m.accel_mean;
  NavigationState x;
  x.R_OB = level(f_B);
  x.b_g = m.gyro_mean;
  x.X_BL = X_BL;
  ErrorStateFilter filter(config.imu);
  ErrorMatrix P = prior_covariance(sc);
  const double mean_share = 1 / static_cast<double>(window.size());
  P.diagonal().segment<3>(kGyroBias).array() += m.gyro_std * m.gyro_std * mean_share;
  filter.reset(x, P);

  // At rest f_B = -R^T g + b_a.
  Eigen::Matrix<double, 3, kErrorDim> H = Eigen::Matrix<double, 3, kErrorDim>::Zero();
  H.block<3, 3>(0, kGravityBlock) = -x.R_OB.transpose();
  H.block<3, 3>(0, kAccelBias) = Mat3::Identity();
  const double mean_variance = m.accel_std * m.accel_std * mean_share;
  filter.correct<3>(f_B + x.R_OB.transpose() * x.g_O - x.b_a, H, mean_variance * Mat3::Identity());

  // |g| = G.
  Eigen::Matrix<double, 1, kErrorDim> h = Eigen::Matrix<double, 1, kErrorDim>::Zero();
  const Vec3 g = filter.state().g_O;
  h.block<1, 3>(0, kGravityBlock) = g.normalized().transpose();
  filter.correct<1>(Eigen::Matrix<double, 1, 1>(kGravity - g.norm()), h,
                    Eigen::Matrix<double, 1, 1>(std::pow(sc.gravity_std_mps2, 2)));
  start.state = filter.state();
  start.covariance = filter.covariance();
  start.white_noise = white_noise(window);
  if (config.estimate_extrinsics) doubt_mounting(config, start.state, start.covariance);
  return start;
}

bool stands_still(std::span<const ImuSample> samples, const NavigationState& x, double accel_scale,
                  const StaticInitialiserConfig& config, const WhiteNoise& noise) {
  if (samples.size() < 2) return false;
  const Moments m = moments(samples);
  // A mean over less time is noisier.
  const double reach =
      config.still_sigma / std::sqrt(to_seconds(samples.back().stamp - samples.front().stamp));
  const Vec3 rate = m.gyro_mean - x.b_g;
  const Vec3 force = accel_scale * m.accel_mean - (x.b_a - x.R_OB.transpose() * x.g_O);
  return m.gyro_std < config.max_gyro_std_radps && m.accel_std < config.max_accel_std_mps2 &&
         rate.norm() < std::hypot(config.still_rate_radps, reach * noise.gyro) &&
         force.norm() < std::hypot(config.still_force_mps2, reach * noise.accel);
}

}  // namespace arex
