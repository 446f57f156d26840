#pragma once

#include <Eigen/Core>
#include <vector>

#include "odometry/inertial/inertial_config.h"
#include "odometry/inertial/navigation_state.h"

namespace arex {

/// Rows of a preintegration's error: rotation, velocity, position.
inline constexpr int kImuTurn = 0, kImuSpeed = 3, kImuWay = 6;

/// What the IMU says of the motion between two frames, whatever the state at the first: turn,
/// change of velocity and of position in the body's frame there, gravity left out.
///
/// Error [rotation, velocity, position], 9x1, rotation on the right. Sources: Forster et al., T-RO
/// 2017, for the errors on the manifold; Qin et al., T-RO 2018, for the midpoint.
class Preintegration {
 public:
  using Covariance = Eigen::Matrix<double, 9, 9>;
  using BiasJacobian = Eigen::Matrix<double, 9, 6>;

  /// @param b_g, b_a the biases that it is linearised at, rad/s and m/s^2
  Preintegration(const ImuNoiseConfig& noise, const Vec3& b_g, const Vec3& b_a)
      : noise_(noise), b_g_(b_g), b_a_(b_a) {}

  /// Goes on by one interval. @pre it begins where the one before ended; its forces are scaled.
  void add(const ImuInterval& imu);
  /// Goes on by what `later` integrated. @pre that begins where this ends.
  void join(const Preintegration& later);
  /// What shakes the IMU against the vehicle at the two ends: it does not add up.
  void note_shaking(double angle_std_rad, double speed_std_mps);
  /// The same readings with other biases.
  [[nodiscard]] Preintegration relinearised(const Vec3& b_g, const Vec3& b_a) const;

  [[nodiscard]] double dt_s() const { return dt_s_; }
  [[nodiscard]] const Mat3& dR() const { return dR_; }
  [[nodiscard]] const Vec3& dv() const { return dv_; }
  [[nodiscard]] const Vec3& dp() const { return dp_; }
  [[nodiscard]] const Vec3& b_g() const { return b_g_; }
  [[nodiscard]] const Vec3& b_a() const { return b_a_; }
  [[nodiscard]] Covariance covariance() const;
  /// Derivative by [b_g, b_a], rotation on the right.
  [[nodiscard]] const BiasJacobian& bias_jacobian() const { return J_; }
  [[nodiscard]] const ImuNoiseConfig& noise() const { return noise_; }

 private:
  ImuNoiseConfig noise_;
  Vec3 b_g_, b_a_;
  std::vector<ImuInterval> intervals_;
  double dt_s_ = 0;
  Mat3 dR_ = Mat3::Identity();
  Vec3 dv_ = Vec3::Zero();
  Vec3 dp_ = Vec3::Zero();
  Covariance P_ = Covariance::Zero();
  BiasJacobian J_ = BiasJacobian::Zero();
  double shaken_rad_ = 0, shaken_mps_ = 0;
};

}  // namespace arex
