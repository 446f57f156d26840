#include "odometry/error_state_filter.h"

#include <Eigen/LU>
#include <array>
#include <cmath>

namespace arex {
namespace {

/// So fast a reading that is held while the vehicle goes on grows wrong: rad/s^2, m/s^3.
constexpr double kHeldRateDrift = 10, kHeldForceDrift = 30;

/// The density of white noise whose integral over `dt` scatters as that of an error which grows by
/// `drift` from zero on.
double held_noise(double drift, double dt) { return 0.5 * drift * dt * std::sqrt(dt); }

using PoseColumns = Eigen::Matrix<double, kErrorDim, PoseInformation::kDim>;
/// First index in the error state of each block of a PoseInformation.
constexpr std::array<int, 4> kPoseBlocks{kRotation, kPosition, kExtrinsicRotation,
                                         kExtrinsicPosition};

PoseColumns pose_columns(const ErrorMatrix& P) {
  PoseColumns columns;
  for (int i = 0; i < 4; ++i) {
    columns.block<kErrorDim, 3>(0, 3 * i) =
        P.block<kErrorDim, 3>(0, kPoseBlocks[static_cast<std::size_t>(i)]);
  }
  return columns;
}

PoseInformation::Matrix pose_rows(const PoseColumns& columns) {
  PoseInformation::Matrix rows;
  for (int i = 0; i < 4; ++i) {
    rows.block<3, PoseInformation::kDim>(3 * i, 0) =
        columns.block<3, PoseInformation::kDim>(kPoseBlocks[static_cast<std::size_t>(i)], 0);
  }
  return rows;
}

PoseInformation::Vector pose_part(const ErrorVector& d) {
  PoseInformation::Vector part;
  for (int i = 0; i < 4; ++i) {
    part.segment<3>(3 * i) = d.segment<3>(kPoseBlocks[static_cast<std::size_t>(i)]);
  }
  return part;
}

}  // namespace

/// The prior seen from an iterate, and the gain in its information form: K = M H^T V^-1, which asks
/// neither for the inverse of P (singular where the extrinsics are fixed) nor for a matrix that
/// grows with the residuals.
struct ErrorStateFilter::Gain {
  ErrorVector prior;  ///< the prior's mean, as an error of the iterate
  ErrorMatrix P;      ///< the prior's covariance at the iterate
  PoseColumns M;
};

void ErrorStateFilter::reset(const NavigationState& x, const ErrorMatrix& P) {
  x_ = x;
  P_ = P;
}

void ErrorStateFilter::predict(const ImuInterval& imu, bool standing) {
  const double dt = imu.dt_s();
  PropagationJacobians jacobians = propagation_jacobians(x_, imu);
  if (standing) jacobians.F.col(kTimeOffset).head<kTimeOffset>().setZero();
  Eigen::Matrix<double, kNoiseDim, 1> Q;
  // Of the turn, without what shakes the gyro to and fro.
  const Vec3 rate = x_.rate(imu.gyro_level);
  const double held = imu.held ? 1 : 0;
  const double delay_std_s = standing ? 0 : std::sqrt(P_(kTimeOffset, kTimeOffset));
  for (int i = 0; i < 3; ++i) {
    const double gyro_noise =
        imu.gyro_clipped[static_cast<std::size_t>(i)]
            ? noise_.clipped_gyro_noise_density
            : std::hypot(noise_.gyro_noise_density, noise_.gyro_scale_noise_density * rate.norm(),
                         held * held_noise(kHeldRateDrift, dt));
    const double gyro = std::hypot(gyro_noise, delay_std_s * imu.gyro_slope_noise[i]);
    Q[i] = gyro * gyro / dt;
    const double accel =
        std::hypot(noise_.accel_noise_density, held * held_noise(kHeldForceDrift, dt),
                   delay_std_s * imu.accel_slope_noise[i]);
    Q[3 + i] = accel * accel / dt;
    Q[6 + i] = noise_.gyro_walk_density * noise_.gyro_walk_density / dt;
    Q[9 + i] = noise_.accel_walk_density * noise_.accel_walk_density / dt;
  }
  const ErrorMatrix FP = jacobians.F * P_;
  const NoiseJacobian GQ = jacobians.G * Q.asDiagonal();
  P_.noalias() = FP * jacobians.F.transpose();
  P_.noalias() += GQ * jacobians.G.transpose();
  P_(kTimeOffset, kTimeOffset) += noise_.delay_walk_density * noise_.delay_walk_density * dt;
  P_ = (0.5 * (P_ + P_.transpose())).eval();
  x_ = propagate(x_, imu);
}

ErrorStateFilter::Gain ErrorStateFilter::gain(const NavigationState& x,
                                              const PoseInformation& information) const {
  const ErrorMatrix J_inverse = local_jacobian_inverse(x_, x);
  Gain g;
  g.prior = -J_inverse * local(x_, x);
  g.P = J_inverse * P_ * J_inverse.transpose();
  const PoseColumns P_h = pose_columns(g.P);
  const PoseInformation::Matrix I_AP =
      PoseInformation::Matrix::Identity() + information.A * pose_rows(P_h);
  g.M = P_h * I_AP.partialPivLu().inverse();
  return g;
}

NavigationState ErrorStateFilter::iterate(const NavigationState& x,
                                          const PoseInformation& information) const {
  const Gain g = gain(x, information);
  const PoseInformation::Vector innovation = -information.b - information.A * pose_part(g.prior);
  return retract(x, g.prior + g.M * innovation);
}

void ErrorStateFilter::finish(const NavigationState& x, const PoseInformation& information) {
  const Gain g = gain(x, information);
  // Joseph's form: (I - K H) P (I - K H)^T + K V K^T with K H = M A and K V K^T = M A M^T.
  const PoseColumns MA = g.M * information.A;
  ErrorMatrix I_KH = ErrorMatrix::Identity();
  for (int i = 0; i < 4; ++i) {
    I_KH.block<kErrorDim, 3>(0, kPoseBlocks[static_cast<std::size_t>(i)]) -=
        MA.block<kErrorDim, 3>(0, 3 * i);
  }
  P_ = I_KH * g.P * I_KH.transpose() + MA * g.M.transpose();
  P_ = (0.5 * (P_ + P_.transpose())).eval();
  x_ = x;
}

PoseInformation::Matrix ErrorStateFilter::pose_covariance() const {
  return pose_rows(pose_columns(P_));
}

void ErrorStateFilter::inflate_pose_covariance(double rotation_std_rad, double position_std_m,
                                               double velocity_std_mps) {
  P_.topRows<9>().setZero();
  P_.leftCols<9>().setZero();
  P_.diagonal().segment<3>(kRotation).setConstant(rotation_std_rad * rotation_std_rad);
  P_.diagonal().segment<3>(kPosition).setConstant(position_std_m * position_std_m);
  P_.diagonal().segment<3>(kVelocity).setConstant(velocity_std_mps * velocity_std_mps);
}

}  // namespace arex
