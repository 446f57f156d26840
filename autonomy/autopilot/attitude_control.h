#pragma once

#include "autopilot/autopilot_config.h"
#include "autopilot/low_pass.h"
#include "math/types.h"

namespace arex {

/// Body rate setpoint (rad/s, in B) from an attitude error: quaternion P that turns the thrust's
/// direction first and the heading with less weight.
/// Source: Brescianini, Hehn and D'Andrea, Nonlinear quadrocopter attitude control, 2013; PX4.
Vec3 attitude_rate_setpoint(const AttitudeControlConfig& config, const Mat3& R_AB,
                            const Mat3& R_AB_desired, double yaw_rate_radps);

/// `R` with its z axis brought to within `limit_rad` of the vertical by the shortest way.
Mat3 limit_tilt(const Mat3& R, double limit_rad);

/// Rate PID: torque from body rates. D acts on the measurement, so that setpoint steps don't kick.
class RateControl {
 public:
  explicit RateControl(const AttitudeControlConfig& config);

  /// Torque demand (N m, in B); call at rate_loop_hz.
  Vec3 update(const Vec3& rate_setpoint, const Vec3& rate);

  /// Integrates the error just given, except on axes where the torque `achieved` fell short of the
  /// demand and the error would ask for still more.
  void integrate(const Vec3& achieved_torque_nm);

  /// Forgets the integral and the past; the rate is the present one.
  void reset(const Vec3& rate);

  [[nodiscard]] const Vec3& integral_nm() const { return integral_; }
  /// The newest demand, N m.
  [[nodiscard]] const Vec3& demand_nm() const { return demand_; }

 private:
  AttitudeControlConfig config_;
  LowPass derivative_filter_;
  Vec3 filtered_rate_ = Vec3::Zero();
  Vec3 error_ = Vec3::Zero();
  Vec3 demand_ = Vec3::Zero();
  Vec3 integral_ = Vec3::Zero();
};

}  // namespace arex
