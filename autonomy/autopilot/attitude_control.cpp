#include "autopilot/attitude_control.h"

#include <algorithm>
#include <cmath>

namespace arex {
namespace {

/// The one of q and -q with a non-negative real part: the shorter way round.
Quat canonical(Quat q) {
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  return q;
}

}  // namespace

Vec3 attitude_rate_setpoint(const AttitudeControlConfig& config, const Mat3& R_AB,
                            const Mat3& R_AB_desired, double yaw_rate_radps) {
  const Quat q(R_AB);
  const Quat q_desired(R_AB_desired);
  // The reduced attitude reaches the desired thrust direction without turning about it.
  const Quat q_reduced = Quat::FromTwoVectors(R_AB.col(2), R_AB_desired.col(2)) * q;
  const Quat q_heading = canonical(q_reduced.conjugate() * q_desired);  // a rotation about z
  const double half_angle = std::atan2(q_heading.z(), q_heading.w());
  const Quat q_target =
      q_reduced * Quat(Eigen::AngleAxisd(2 * config.yaw_weight * half_angle, Vec3::UnitZ()));
  const Quat q_error = canonical(q.conjugate() * q_target);

  Vec3 gain = config.attitude_p;
  gain.z() /= config.yaw_weight;  // so that attitude_p is the gain of a pure heading error
  Vec3 rate = gain.cwiseProduct(2 * q_error.vec());
  rate += yaw_rate_radps * R_AB.row(2).transpose();
  const Vec3 limit(config.tilt_rate_limit_radps, config.tilt_rate_limit_radps,
                   config.yaw_rate_limit_radps);
  return rate.cwiseMax(-limit).cwiseMin(limit);
}

Mat3 limit_tilt(const Mat3& R, double limit_rad) {
  const Vec3 z = R.col(2);
  const double tilt = std::atan2(z.head<2>().norm(), z.z());
  if (tilt <= limit_rad) return R;
  const Vec3 axis = Vec3(z.y(), -z.x(), 0);  // z cross vertical: turns z upright
  const Vec3 unit = axis.norm() > 1e-9 ? Vec3(axis.normalized()) : Vec3(Vec3::UnitX());
  return Eigen::AngleAxisd(tilt - limit_rad, unit).toRotationMatrix() * R;
}

RateControl::RateControl(const AttitudeControlConfig& config)
    : config_(config), derivative_filter_(config.rate_loop_hz, config.derivative_cutoff_hz) {}

Vec3 RateControl::update(const Vec3& rate_setpoint, const Vec3& rate) {
  const Vec3 filtered = derivative_filter_.update(rate);
  const Vec3 acceleration = (filtered - filtered_rate_) * config_.rate_loop_hz;
  filtered_rate_ = filtered;
  error_ = rate_setpoint - rate;
  demand_ =
      config_.rate_p.cwiseProduct(error_ - config_.rate_derivative_s * acceleration) + integral_;
  return demand_;
}

void RateControl::integrate(const Vec3& achieved_torque_nm) {
  const Vec3 shortfall = demand_ - achieved_torque_nm;
  for (int i = 0; i < 3; ++i) {
    // A shortfall of rounding size is none.
    const bool saturated = std::abs(shortfall[i]) > 1e-6 * config_.rate_p[i];
    if (saturated && shortfall[i] * error_[i] > 0) continue;
    integral_[i] +=
        config_.rate_integral_per_s * config_.rate_p[i] * error_[i] / config_.rate_loop_hz;
    integral_[i] = std::clamp(integral_[i], -config_.integral_limit_nm, config_.integral_limit_nm);
  }
}

void RateControl::reset(const Vec3& rate) {
  integral_.setZero();
  derivative_filter_.reset(rate);
  filtered_rate_ = rate;
}

}  // namespace arex
