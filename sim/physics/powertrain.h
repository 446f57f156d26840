#pragma once

#include <array>

#include "messages/commands.h"
#include "physics/physics_config.h"

namespace arex::sim {

struct BatteryState {
  double voltage_v = 0;        ///< at the terminals
  double current_a = 0;        ///< out of the battery
  double state_of_charge = 0;  ///< 1 full, 0 empty
  double used_wh = 0;          ///< delivered at the terminals
};

/// What is broken of the drive. As made: nothing is.
struct DriveFaults {
  /// Of each motor's static thrust at a throttle, what it still gives: 1 all of it.
  std::array<double, 4> thrust_share{1, 1, 1, 1};
  std::array<bool, 4> stopped{};  ///< its controller gives no current
  double added_resistance_ohm = 0;
  double lost_voltage_v = 0;  ///< of the open circuit
};

/// Battery, speed controllers, motors and rotor speeds: throttle in, rotor speeds out.
///
/// Motor: u V = Kt w + R i, limited to +-i_max; J dw/dt = Kt (i - I0) - kQ w^2. The bus voltage
/// V = E(q) - R_b I follows from all currents at once. Rotor speeds are integrated by RK4 with the
/// bus voltage held over a tick.
class Powertrain {
 public:
  Powertrain(const MotorConfig& motor, const RotorConfig& rotor, const BatteryConfig& battery);

  /// Holds until they are set anew.
  void set_faults(const DriveFaults& faults) { faults_ = faults; }

  /// Advances by one tick (1 ms).
  void step(const MotorCommand& command);

  [[nodiscard]] const BatteryState& battery() const { return state_; }
  [[nodiscard]] const std::array<double, 4>& rotor_radps() const { return speed_; }
  /// Over the last tick, rad/s^2.
  [[nodiscard]] const std::array<double, 4>& rotor_acceleration() const { return acceleration_; }
  [[nodiscard]] const std::array<double, 4>& motor_current_a() const { return current_; }
  /// Open-circuit voltage of the battery at its present charge, V.
  [[nodiscard]] double open_circuit_v() const;
  /// The controllers have lost their supply and wait for zero throttle.
  [[nodiscard]] bool browned_out() const { return browned_out_; }
  /// Sets the rotors' speeds, rad/s (a start in the air, a test).
  void set_rotor_radps(const std::array<double, 4>& speed) { speed_ = speed; }

 private:
  static constexpr double kOpen = -1;  ///< the throttle of a controller that has stopped

  /// What the bus has to deliver at one voltage, and how that changes with it (A, A/V).
  struct Load {
    double current_a = 0;
    double slope = 0;
  };
  /// @param throttle kOpen: the controller gives none
  [[nodiscard]] double motor_current(double throttle, double bus_v, double speed) const;
  [[nodiscard]] double faulty_throttle(std::size_t motor, double throttle) const;
  [[nodiscard]] Load load(const std::array<double, 4>& throttle, double bus_v) const;
  [[nodiscard]] double battery_ohm() const {
    return battery_.resistance_ohm + faults_.added_resistance_ohm;
  }
  [[nodiscard]] double solve_bus_voltage(const std::array<double, 4>& throttle) const;
  [[nodiscard]] double speed_after_tick(double throttle, double bus_v, double speed) const;

  MotorConfig motor_;
  RotorConfig rotor_;
  BatteryConfig battery_;
  DriveFaults faults_;
  BatteryState state_;
  double charge_ = 1;  ///< may fall below 0 by the empty tail
  bool browned_out_ = false;
  std::array<double, 4> speed_{};
  std::array<double, 4> acceleration_{};
  std::array<double, 4> current_{};
};

}  // namespace arex::sim
