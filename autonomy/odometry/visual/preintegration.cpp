#include "odometry/visual/preintegration.h"

#include <algorithm>
#include <cmath>

#include "math/so3.h"

namespace arex {
void Preintegration::add(const ImuInterval& imu) {
  const double h = imu.dt_s();
  if (h <= 0) return;
  intervals_.push_back(imu);
  const Vec3 rate = imu.mean_gyro() - b_g_;
  const Vec3 a0 = imu.accel_begin - b_a_, a1 = imu.accel_end - b_a_;
  const Mat3 E = so3::Exp(h * rate);
  const Mat3 dR1 = dR_ * E;
  const Vec3 a = 0.5 * (dR_ * a0 + dR1 * a1);

  const Mat3 turn_by_gyro = -h * so3::right_jacobian(h * rate);
  const Mat3 a_by_end_turn = -0.5 * dR1 * so3::hat(a1);
  const Mat3 a_by_turn = -0.5 * dR_ * so3::hat(a0) + a_by_end_turn * E.transpose();
  const Mat3 a_by_accel = -0.5 * (dR_ + dR1);
  const Mat3 a_by_gyro = a_by_end_turn * turn_by_gyro;

  Covariance F = Covariance::Identity();
  F.block<3, 3>(kImuTurn, kImuTurn) = E.transpose();
  F.block<3, 3>(kImuSpeed, kImuTurn) = h * a_by_turn;
  F.block<3, 3>(kImuWay, kImuTurn) = 0.5 * h * h * a_by_turn;
  F.block<3, 3>(kImuWay, kImuSpeed) = h * Mat3::Identity();
  BiasJacobian B;  // a reading errs as a bias would, for one interval
  B.block<3, 3>(kImuTurn, 0) = turn_by_gyro;
  B.block<3, 3>(kImuSpeed, 0) = h * a_by_gyro;
  B.block<3, 3>(kImuWay, 0) = 0.5 * h * h * a_by_gyro;
  B.block<3, 3>(kImuTurn, 3).setZero();
  B.block<3, 3>(kImuSpeed, 3) = h * a_by_accel;
  B.block<3, 3>(kImuWay, 3) = 0.5 * h * h * a_by_accel;

  Eigen::Matrix<double, 6, 1> variance;  // of the interval's mean readings
  for (int axis = 0; axis < 3; ++axis) {
    const bool clipped = imu.gyro_clipped[static_cast<std::size_t>(axis)];
    const double density =
        std::hypot(clipped ? noise_.clipped_gyro_noise_density : noise_.gyro_noise_density,
                   noise_.gyro_scale_noise_density * rate[axis]);
    variance[axis] = density * density / h;
    variance[3 + axis] = noise_.accel_noise_density * noise_.accel_noise_density / h;
  }
  P_ = (F * P_ * F.transpose() + B * variance.asDiagonal() * B.transpose()).eval();
  J_ = (F * J_ + B).eval();
  dp_ += h * dv_ + 0.5 * h * h * a;
  dv_ += h * a;
  dR_ = dR1;
  dt_s_ += h;
}

void Preintegration::join(const Preintegration& later) {
  for (const ImuInterval& imu : later.intervals_) add(imu);
  note_shaking(later.shaken_rad_, later.shaken_mps_);
}

void Preintegration::note_shaking(double angle_std_rad, double speed_std_mps) {
  shaken_rad_ = std::max(shaken_rad_, angle_std_rad);
  shaken_mps_ = std::max(shaken_mps_, speed_std_mps);
}

Preintegration::Covariance Preintegration::covariance() const {
  Covariance P = P_;
  P.diagonal().segment<3>(kImuTurn).array() += 2 * shaken_rad_ * shaken_rad_;
  P.diagonal().segment<3>(kImuSpeed).array() += 2 * shaken_mps_ * shaken_mps_;
  return P;
}

Preintegration Preintegration::relinearised(const Vec3& b_g, const Vec3& b_a) const {
  Preintegration again(noise_, b_g, b_a);
  again.intervals_.reserve(intervals_.size());
  for (const ImuInterval& imu : intervals_) again.add(imu);
  again.note_shaking(shaken_rad_, shaken_mps_);
  return again;
}

}  // namespace arex
