#pragma once

#include "odometry/inertial/navigation_state.h"
#include "odometry/lidar_inertial_config.h"

namespace arex {

/// What residuals r(x) with Jacobian H and covariance V say of the pose and the extrinsics:
/// [R_OB, p_OB, R_BL, p_BL], 12x1. Summed in the order of the residuals.
struct PoseInformation {
  static constexpr int kDim = 12;
  using Vector = Eigen::Matrix<double, kDim, 1>;
  using Matrix = Eigen::Matrix<double, kDim, kDim>;

  Matrix A = Matrix::Zero();  ///< H^T V^-1 H
  Vector b = Vector::Zero();  ///< H^T V^-1 r
};

/// Covariance and update equations of the iterated error-state Kalman filter.
class ErrorStateFilter {
 public:
  explicit ErrorStateFilter(const ImuNoiseConfig& noise) : noise_(noise) {}

  void reset(const NavigationState& x, const ErrorMatrix& P);
  [[nodiscard]] const ImuNoiseConfig& noise() const { return noise_; }
  void set_noise(const ImuNoiseConfig& noise) { noise_ = noise; }
  [[nodiscard]] const NavigationState& state() const { return x_; }
  [[nodiscard]] const ErrorMatrix& covariance() const { return P_; }

  /// Propagates state and covariance over one IMU interval (paper, eq. (2)).
  /// @param standing nothing moves: how the readings change is noise, and says nothing of when they
  /// were taken
  void predict(const ImuInterval& imu, bool standing = false);

  /// One iteration of an update around `x`, the iterate: where the residuals' information and the
  /// prior (state() and covariance()) agree. Returns the next iterate.
  [[nodiscard]] NavigationState iterate(const NavigationState& x,
                                        const PoseInformation& information) const;

  /// Ends an update at the iterate `x`, whose residuals had this information.
  void finish(const NavigationState& x, const PoseInformation& information);

  /// Conditions on a linear measurement of the whole error state: residual = z - h(state()).
  template <int Rows>
  void correct(const Eigen::Matrix<double, Rows, 1>& residual,
               const Eigen::Matrix<double, Rows, kErrorDim>& H,
               const Eigen::Matrix<double, Rows, Rows>& V);

  /// Adds doubt of the IMU's delay, of which nothing else is the worse yet.
  void doubt_delay(double std_s) { P_(kTimeOffset, kTimeOffset) += std_s * std_s; }

  /// Covariance of [R_OB, p_OB, R_BL, p_BL].
  [[nodiscard]] PoseInformation::Matrix pose_covariance() const;

  /// Sets the covariance of pose and velocity anew and drops their correlations with the rest: for
  /// a recovery.
  void inflate_pose_covariance(double rotation_std_rad, double position_std_m,
                               double velocity_std_mps);

 private:
  struct Gain;
  [[nodiscard]] Gain gain(const NavigationState& x, const PoseInformation& information) const;

  ImuNoiseConfig noise_;
  NavigationState x_;
  ErrorMatrix P_ = ErrorMatrix::Identity();
};

template <int Rows>
void ErrorStateFilter::correct(const Eigen::Matrix<double, Rows, 1>& residual,
                               const Eigen::Matrix<double, Rows, kErrorDim>& H,
                               const Eigen::Matrix<double, Rows, Rows>& V) {
  const Eigen::Matrix<double, kErrorDim, Rows> PHt = P_ * H.transpose();
  const Eigen::Matrix<double, Rows, Rows> S = H * PHt + V;
  const Eigen::Matrix<double, kErrorDim, Rows> K = PHt * S.inverse();
  const ErrorMatrix I_KH = ErrorMatrix::Identity() - K * H;
  x_ = retract(x_, K * residual);
  P_ = (I_KH * P_ * I_KH.transpose() + K * V * K.transpose()).eval();
}

}  // namespace arex
