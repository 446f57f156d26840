#pragma once

#include "autopilot/autopilot_config.h"
#include "messages/vehicle.h"

namespace arex {

/// The believed static curve of one motor and propeller: thrust <-> throttle at a battery voltage.
/// throttle * voltage = Kt w + R (kQ w^2 / Kt + I0), thrust = kT w^2.
class MotorModel {
 public:
  MotorModel(const MotorBelief& motor, const VehicleConfig& vehicle)
      : motor_(motor),
        thrust_coefficient_(vehicle.thrust_coefficient),
        torque_coefficient_(vehicle.thrust_coefficient * vehicle.torque_ratio_m) {}

  /// Throttle 0..1 that holds `thrust_n` at `voltage_v`.
  [[nodiscard]] double throttle(double thrust_n, double voltage_v) const;

  /// Rotor speed, rad/s, of a static thrust.
  [[nodiscard]] double speed(double thrust_n) const;

  /// Thrust (N) of a rotor that moves along its axis through the air.
  [[nodiscard]] double thrust(double speed_radps, double axial_mps) const;

  /// Thrust (N) at full throttle.
  [[nodiscard]] double full_thrust(double voltage_v) const;

  /// Thrust (N) at the idle speed.
  [[nodiscard]] double idle_thrust() const {
    return thrust_coefficient_ * motor_.idle_speed_radps * motor_.idle_speed_radps;
  }

 private:
  MotorBelief motor_;
  double thrust_coefficient_;
  double torque_coefficient_;
};

}  // namespace arex
