#include "control/tracker.h"

#include <algorithm>
#include <cmath>

#include "math/so3.h"

namespace arex {

Tracker::Tracker(const TrackerConfig& config, const VehicleConfig& vehicle)
    : config_(config), mass_kg_(vehicle.mass_kg) {
  reset();
}

void Tracker::reset() {
  disturbance_.setZero();
  flying_ = false;
}

TrackerOutput Tracker::update(const TrajectorySetpoint& setpoint, const Odometry& odometry,
                              bool in_flight) {
  if (!in_flight) {
    flying_ = false;
  } else if (config_.observe_disturbance) {
    observe(odometry.v_OB);
  }

  const Vec3 e_p = setpoint.p_OB - odometry.X_OB.p;
  const Vec3 e_v = setpoint.v_OB - odometry.v_OB;
  const Vec3 force = mass_kg_ * (Vec3(0, 0, kGravity) + setpoint.a_OB) +
                     config_.position_gain.cwiseProduct(e_p) +
                     config_.velocity_gain.cwiseProduct(e_v) - disturbance_;
  TrackerOutput out;
  out.force_O = limit(force);
  out.R_OB_desired = attitude_from_force(out.force_O, setpoint.yaw_rad);
  out.yaw_rate_radps = setpoint.yaw_rate_radps;
  out.thrust_n = std::max(out.force_O.dot(odometry.X_OB.R.col(2)), 0.0);
  last_force_ = out.force_O;
  return out;
}

void Tracker::observe(const Vec3& v_OB) {
  const double dt = 1 / config_.rate_hz;
  if (!flying_) {
    flying_ = true;
    lagged_force_ = last_force_;
  } else {
    // The inner loop's lag, exactly for a force held over the step.
    lagged_force_ += (last_force_ - lagged_force_) * -std::expm1(-dt / config_.attitude_lag_s);
    const Vec3 momentum_change = mass_kg_ * (v_OB - last_velocity_);
    const Vec3 known = (lagged_force_ - Vec3(0, 0, mass_kg_ * kGravity) + disturbance_) * dt;
    disturbance_ += config_.observer_bandwidth_radps * (momentum_change - known);
    const double bound = config_.observer_limit_n;
    disturbance_ = disturbance_.cwiseMax(-bound).cwiseMin(bound);
  }
  last_velocity_ = v_OB;
}

Vec3 Tracker::limit(const Vec3& force) const {
  const double weight = mass_kg_ * kGravity;
  const double lift =
      std::clamp(force.z(), config_.min_lift_fraction * weight, config_.max_lift_fraction * weight);
  const Vec2 horizontal = force.head<2>();
  const double most = lift * std::tan(config_.tilt_limit_rad);
  const double scale = std::min(1.0, most / std::max(horizontal.norm(), 1e-9));
  return {scale * horizontal.x(), scale * horizontal.y(), lift};
}

Mat3 attitude_from_force(const Vec3& force, double yaw_rad) {
  Mat3 R;
  R.col(2) = force.normalized();
  R.col(1) = R.col(2).cross(Vec3(std::cos(yaw_rad), std::sin(yaw_rad), 0)).normalized();
  R.col(0) = R.col(1).cross(R.col(2));
  return R;
}

Mat3 heading_between(const Mat3& R_AB, const Mat3& R_OB) {
  const Mat3 R_AO = R_AB * R_OB.transpose();
  // Maximises trace(Rz(yaw)^T R_AO).
  return so3::from_yaw(std::atan2(R_AO(1, 0) - R_AO(0, 1), R_AO(0, 0) + R_AO(1, 1)));
}

}  // namespace arex
