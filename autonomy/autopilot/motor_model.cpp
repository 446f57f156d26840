#include "autopilot/motor_model.h"

#include <algorithm>
#include <cmath>

namespace arex {

double MotorModel::speed(double thrust_n) const {
  return std::sqrt(std::max(thrust_n, 0.0) / thrust_coefficient_);
}

double MotorModel::thrust(double speed_radps, double axial_mps) const {
  // Falls linearly with the advance ratio.
  const double lost = axial_mps / motor_.zero_thrust_pitch_m;
  return std::max(0.0, thrust_coefficient_ * speed_radps * (speed_radps - lost));
}

double MotorModel::throttle(double thrust_n, double voltage_v) const {
  const double w = speed(thrust_n);
  const double current =
      torque_coefficient_ * w * w / motor_.torque_constant + motor_.no_load_current_a;
  const double volts = motor_.torque_constant * w + motor_.resistance_ohm * current;
  return std::clamp(volts / voltage_v, 0.0, 1.0);
}

double MotorModel::full_thrust(double voltage_v) const {
  // a w^2 + Kt w - (V - R I0) = 0
  const double a = motor_.resistance_ohm * torque_coefficient_ / motor_.torque_constant;
  const double volts = std::max(voltage_v - motor_.resistance_ohm * motor_.no_load_current_a, 0.0);
  const double kt = motor_.torque_constant;
  const double speed = (std::sqrt(kt * kt + 4 * a * volts) - kt) / (2 * a);
  return thrust_coefficient_ * speed * speed;
}

}  // namespace arex
