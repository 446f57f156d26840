#include "odometry/static_initialiser.h"

#include <algorithm>
#include <cmath>

#include "math/so3.h"

namespace arex {
namespace {

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
void add_extrinsic_covariance(const LidarInertialConfig& config, const NavigationState& x,
                              ErrorMatrix& P) {
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

}  // namespace

std::optional<StaticStart> start_from_standstill(std::span<const ImuSample> samples,
                                                 const Pose& X_BL,
                                                 const LidarInertialConfig& config) {
  const StaticInitialiserConfig& sc = config.initialiser;
  const std::optional<Standstill> standing = measure_standstill(samples, sc);
  if (!standing) return std::nullopt;
  const ImuMoments& m = standing->moments;

  StaticStart start;
  start.stamp = standing->stamp;
  start.accel_scale = config.scale_accel ? kGravity / m.accel_mean.norm() : 1;
  const Vec3 f_B = start.accel_scale * m.accel_mean;
  NavigationState x;
  x.R_OB = level(f_B);
  x.b_g = m.gyro_mean;
  x.X_BL = X_BL;
  ErrorStateFilter filter(config.imu);
  ErrorMatrix P = prior_covariance(sc);
  const double mean_share = 1 / static_cast<double>(standing->samples);
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
  start.white_noise = standing->white_noise;
  if (config.estimate_extrinsics) add_extrinsic_covariance(config, start.state, start.covariance);
  return start;
}

}  // namespace arex
