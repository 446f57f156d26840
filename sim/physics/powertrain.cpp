#include "physics/powertrain.h"

#include <algorithm>
#include <cmath>

namespace arex::sim {
namespace {

constexpr double kSecondsPerHour = 3600;
constexpr std::size_t kRotors = 4;

}  // namespace

Powertrain::Powertrain(const MotorConfig& motor, const RotorConfig& rotor,
                       const BatteryConfig& battery)
    : motor_(motor), rotor_(rotor), battery_(battery), charge_(battery.initial_state_of_charge) {
  state_.state_of_charge = charge_;
  state_.voltage_v = open_circuit_v();
}

double Powertrain::open_circuit_v() const {
  const auto line = [](double x, double x0, double y0, double x1, double y1) {
    return y0 + (x - x0) / (x1 - x0) * (y1 - y0);
  };
  double cell_v = 0;
  if (charge_ >= battery_.middle_charge) {
    cell_v = line(charge_, battery_.middle_charge, battery_.cell_middle_v, 1, battery_.cell_full_v);
  } else if (charge_ >= 0) {
    cell_v =
        line(charge_, 0, battery_.cell_empty_v, battery_.middle_charge, battery_.cell_middle_v);
  } else {
    cell_v = line(charge_, -battery_.empty_tail_fraction, 0, 0, battery_.cell_empty_v);
  }
  return std::max(battery_.cells * std::max(cell_v, 0.0) - faults_.lost_voltage_v, 0.0);
}

double Powertrain::motor_current(double throttle, double bus_v, double speed) const {
  if (browned_out_ || throttle == kOpen) return 0;
  const double current =
      (throttle * bus_v - motor_.torque_constant_nm_per_a * speed) / motor_.resistance_ohm;
  return std::clamp(current, -motor_.current_limit_a, motor_.current_limit_a);
}

Powertrain::Load Powertrain::load(const std::array<double, 4>& throttle, double bus_v) const {
  // Below the controllers' own floor the avionics' converters no longer hold constant power.
  const double converter_v = std::max(bus_v, motor_.brownout_voltage_v);
  Load total;
  total.current_a = battery_.avionics_w / converter_v;
  if (bus_v > motor_.brownout_voltage_v) total.slope = -total.current_a / bus_v;
  if (browned_out_) return total;
  for (std::size_t i = 0; i < kRotors; ++i) {
    if (throttle[i] == kOpen) continue;
    const double current = motor_current(throttle[i], bus_v, speed_[i]);
    // A braking motor feeds the bus, and the controller takes its share of that too.
    const double gain =
        current >= 0 ? 1 / motor_.controller_efficiency : motor_.controller_efficiency;
    if (std::abs(current) < motor_.current_limit_a) {
      total.current_a += gain * throttle[i] * current;
      total.slope += gain * throttle[i] * throttle[i] / motor_.resistance_ohm;
    } else {
      // The limiter lowers the duty: power in stays power out.
      const double applied_v =
          motor_.torque_constant_nm_per_a * speed_[i] + motor_.resistance_ohm * current;
      total.current_a += gain * applied_v * current / converter_v;
      if (bus_v > motor_.brownout_voltage_v) {
        total.slope -= gain * applied_v * current / (bus_v * bus_v);
      }
    }
  }
  return total;
}

double Powertrain::solve_bus_voltage(const std::array<double, 4>& throttle) const {
  // Newton on E - R_b I(V) - V = 0: piecewise linear but for the constant powers, so few steps.
  const double open_circuit = open_circuit_v();
  double bus_v = std::min(state_.voltage_v, open_circuit);
  for (int iteration = 0; iteration < 8; ++iteration) {
    const Load at = load(throttle, bus_v);
    const double residual = open_circuit - battery_ohm() * at.current_a - bus_v;
    const double change = residual / (1 + battery_ohm() * at.slope);
    bus_v = std::max(bus_v + change, 0.0);
    if (std::abs(change) < 1e-10) break;
  }
  return bus_v;
}

double Powertrain::speed_after_tick(double throttle, double bus_v, double speed) const {
  const double drag = rotor_.thrust_coefficient * rotor_.torque_ratio_m;
  const auto acceleration = [&](double w) {
    const double current = motor_current(throttle, bus_v, w) - motor_.no_load_current_a;
    return (motor_.torque_constant_nm_per_a * current - drag * w * std::abs(w)) /
           rotor_.inertia_kgm2;
  };
  const double k1 = acceleration(speed);
  const double k2 = acceleration(speed + 0.5 * kSecondsPerTick * k1);
  const double k3 = acceleration(speed + 0.5 * kSecondsPerTick * k2);
  const double k4 = acceleration(speed + kSecondsPerTick * k3);
  // Friction stops a rotor; it does not turn it backwards.
  return std::max(0.0, speed + kSecondsPerTick / 6 * (k1 + 2 * k2 + 2 * k3 + k4));
}

// A weak motor turns as slowly as a sound one would at the throttle that this gives: speeds are
// nearly proportional to the voltage, thrust to their square.
double Powertrain::faulty_throttle(std::size_t motor, double throttle) const {
  if (faults_.stopped[motor]) return kOpen;
  const double share = faults_.thrust_share[motor];
  if (share == 1) return throttle;
  const double kt = motor_.torque_constant_nm_per_a;
  const double bend =
      motor_.resistance_ohm * rotor_.thrust_coefficient * rotor_.torque_ratio_m / kt;
  const double lost_v = motor_.resistance_ohm * motor_.no_load_current_a;
  const double volts = std::max(throttle * state_.voltage_v - lost_v, 0.0);
  const double speed = (std::sqrt(kt * kt + 4 * bend * volts) - kt) / (2 * bend);
  const double weak = std::sqrt(share) * speed;
  const double wanted_v = kt * weak + bend * weak * weak + lost_v;
  return state_.voltage_v > 0 ? std::min(throttle, wanted_v / state_.voltage_v) : throttle;
}

void Powertrain::step(const MotorCommand& command) {
  std::array<double, kRotors> throttle{};
  bool all_zero = true;
  for (std::size_t i = 0; i < kRotors; ++i) {
    throttle[i] = std::clamp(command.throttle[i], 0.0, 1.0);
    all_zero = all_zero && throttle[i] == 0;
    throttle[i] = faulty_throttle(i, throttle[i]);
  }

  double bus_v = solve_bus_voltage(throttle);
  if (bus_v < motor_.brownout_voltage_v && !browned_out_) {
    browned_out_ = true;
    bus_v = solve_bus_voltage(throttle);
  } else if (browned_out_ && all_zero && bus_v >= motor_.brownout_voltage_v) {
    browned_out_ = false;
    bus_v = solve_bus_voltage(throttle);
  }

  // From V = E - R_b I rather than from the load, so that charge and energy close exactly.
  state_.current_a = battery_ohm() > 0 ? (open_circuit_v() - bus_v) / battery_ohm()
                                       : load(throttle, bus_v).current_a;
  state_.voltage_v = bus_v;
  state_.used_wh += bus_v * state_.current_a * kSecondsPerTick / kSecondsPerHour;
  charge_ -= state_.current_a * kSecondsPerTick / (battery_.capacity_ah * kSecondsPerHour);
  charge_ = std::clamp(charge_, -battery_.empty_tail_fraction, 1.0);
  state_.state_of_charge = std::max(charge_, 0.0);

  for (std::size_t i = 0; i < kRotors; ++i) {
    current_[i] = motor_current(throttle[i], bus_v, speed_[i]);
    const double next = speed_after_tick(throttle[i], bus_v, speed_[i]);
    acceleration_[i] = (next - speed_[i]) / kSecondsPerTick;
    speed_[i] = next;
  }
}

}  // namespace arex::sim
