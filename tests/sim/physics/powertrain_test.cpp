#include "physics/powertrain.h"

#include <cmath>

#include "messages/vehicle.h"

namespace arex::sim {
namespace {

constexpr double kTick_s = 1e-3;

struct HoverPoint {
  double speed = 0, current = 0, applied_v = 0;
};

/// The motor's steady state at one rotor speed, from its equations.
HoverPoint steady(const MotorConfig& motor, const RotorConfig& rotor, double speed) {
  HoverPoint point;
  point.speed = speed;
  const double torque = rotor.thrust_coefficient * rotor.torque_ratio_m * speed * speed;
  point.current = torque / motor.torque_constant_nm_per_a + motor.no_load_current_a;
  point.applied_v = motor.torque_constant_nm_per_a * speed + motor.resistance_ohm * point.current;
  return point;
}

double hover_speed(const RotorConfig& rotor) {
  return std::sqrt(VehicleConfig{}.mass_kg * kGravity / 4 / rotor.thrust_coefficient);
}

MotorCommand all(double throttle) { return {{throttle, throttle, throttle, throttle}}; }

/// Energy that a battery gives between two charges, Wh: the integral of its open-circuit voltage,
/// by the trapezium rule on many points of the definition.
double stored_wh(const BatteryConfig& config, double charge) {
  const int n = 9000;  // a multiple of 9, so that the knee at 5/9 is a point
  double sum = 0;
  const auto voltage = [&](double q) {
    const double knee = config.middle_charge;
    return q < knee ? config.cell_empty_v + (config.cell_middle_v - config.cell_empty_v) * q / knee
                    : config.cell_middle_v +
                          (config.cell_full_v - config.cell_middle_v) * (q - knee) / (1 - knee);
  };
  for (int i = 0; i < n; ++i) {
    sum += 0.5 * (voltage(charge * i / n) + voltage(charge * (i + 1) / n)) * charge / n;
  }
  return config.cells * config.capacity_ah * sum;
}

TEST(Powertrain, FullBatteryStoresItsRatedEnergy) { EXPECT_NEAR(stored_wh({}, 1.0), 59.2, 0.01); }

TEST(Powertrain, HoverTakesTheReferenceSpeedCurrentAndPower) {
  const MotorConfig motor;
  const RotorConfig rotor;
  Powertrain powertrain(motor, rotor, {});
  const HoverPoint hover = steady(motor, rotor, hover_speed(rotor));
  for (int i = 0; i < 1000; ++i) {
    powertrain.step(all(hover.applied_v / powertrain.battery().voltage_v));
  }
  const BatteryState& battery = powertrain.battery();
  EXPECT_NEAR(powertrain.rotor_radps()[2], 716, 0.03 * 716);
  EXPECT_NEAR(powertrain.rotor_radps()[2], hover.speed, 0.1);
  EXPECT_NEAR(powertrain.motor_current_a()[1], 6.6, 0.03 * 6.6);
  EXPECT_NEAR(battery.voltage_v * battery.current_a, 258, 0.03 * 258);
}

TEST(Powertrain, FollowsTheExactSolutionOfAStepAtConstantVoltage) {
  const MotorConfig motor;
  const RotorConfig rotor;
  BatteryConfig battery;
  battery.resistance_ohm = 1e-9;  // constant voltage, but for the charge used
  battery.capacity_ah = 1e6;
  Powertrain powertrain(motor, rotor, battery);
  const double start = 660;  // near enough that the current stays below its limit
  powertrain.set_rotor_radps({start, start, start, start});
  const double throttle = 0.6, bus_v = battery.cells * battery.cell_full_v;
  // dw/dt = c - b w - a w^2, a Riccati equation: w = (r tanh(r (t + t0)) - b/2) / a.
  const double j = rotor.inertia_kgm2, kt = motor.torque_constant_nm_per_a;
  const double a = rotor.thrust_coefficient * rotor.torque_ratio_m / j;
  const double b = kt * kt / motor.resistance_ohm / j;
  const double c = kt * (throttle * bus_v / motor.resistance_ohm - motor.no_load_current_a) / j;
  const double r = std::sqrt(a * c + b * b / 4);
  const double t0 = std::atanh((a * start + b / 2) / r) / r;
  for (int i = 1; i <= 300; ++i) {
    powertrain.step(all(throttle));
    const double exact = (r * std::tanh(r * (i * kTick_s + t0)) - b / 2) / a;
    ASSERT_NEAR(powertrain.rotor_radps()[0], exact, 1e-4) << i;
  }
}

/// Time constant of a small step by the area over the response.
double measured_time_constant(const BatteryConfig& battery, const std::array<double, 4>& change) {
  const MotorConfig motor;
  const RotorConfig rotor;
  Powertrain powertrain(motor, rotor, battery);
  const HoverPoint hover = steady(motor, rotor, hover_speed(rotor));
  double throttle = 0.55;
  for (int i = 0; i < 2000; ++i) {
    throttle = hover.applied_v / powertrain.battery().voltage_v;
    powertrain.step(all(throttle));
  }
  for (int i = 0; i < 500; ++i) powertrain.step(all(throttle));
  MotorCommand command = all(throttle);
  for (std::size_t i = 0; i < 4; ++i) command.throttle[i] += 0.002 * change[i];
  std::vector<double> response{powertrain.rotor_radps()[0]};
  for (int i = 0; i < 400; ++i) {
    powertrain.step(command);
    response.push_back(powertrain.rotor_radps()[0]);
  }
  double area = 0;
  for (std::size_t i = 0; i + 1 < response.size(); ++i) {
    area += kTick_s * (response.back() - 0.5 * (response[i] + response[i + 1]));
  }
  return area / (response.back() - response.front());
}

TEST(Powertrain, RotorLagAtHoverIsThatOfTheLinearisedMotor) {
  const MotorConfig motor;
  const RotorConfig rotor;
  const double w = hover_speed(rotor);
  const auto lag = [&](double effective_resistance) {
    const double kt = motor.torque_constant_nm_per_a;
    return rotor.inertia_kgm2 / (kt * kt / effective_resistance +
                                 2 * rotor.thrust_coefficient * rotor.torque_ratio_m * w);
  };
  BatteryConfig large;  // the charge must not move while the response is measured
  large.capacity_ah = 1e6;
  // Two rotors up and two down leave the bus alone; all four together pull it down, which works
  // like a further resistance u^2 R_b / efficiency for each.
  const double differential = measured_time_constant(large, {1, -1, 1, -1});
  const double collective = measured_time_constant(large, {1, 1, 1, 1});
  const HoverPoint hover = steady(motor, rotor, w);
  const double throttle = hover.applied_v / (258.0 / 16.3);  // bus near 15.8 to 16.4 V
  const double sag = 4 * throttle * throttle * large.resistance_ohm / motor.controller_efficiency;
  EXPECT_NEAR(differential, lag(motor.resistance_ohm), 0.01 * differential);
  EXPECT_NEAR(collective, lag(motor.resistance_ohm + sag), 0.03 * collective);
  // The reference's 28 ms lies between the two.
  EXPECT_LT(differential, 0.028);
  EXPECT_GT(collective, 0.028);
}

TEST(Powertrain, ReachesTheReferenceThrustToWeight) {
  const RotorConfig rotor;
  const double weight = VehicleConfig{}.mass_kg * kGravity;
  // Charge 5/9 is 3.7 V/cell, 14.8 V.
  for (const auto& [charge, expected] : {std::pair{1.0, 2.8}, std::pair{5.0 / 9, 2.3}}) {
    BatteryConfig battery;
    battery.initial_state_of_charge = charge;
    Powertrain powertrain({}, rotor, battery);
    for (int i = 0; i < 400; ++i) powertrain.step(all(1.0));
    const double w = powertrain.rotor_radps()[0];
    EXPECT_NEAR(4 * rotor.thrust_coefficient * w * w / weight, expected, 0.05 * expected);
  }
}

TEST(Powertrain, LimitsTheCurrentBothWays) {
  const MotorConfig motor;
  Powertrain powertrain(motor, {}, {});
  double highest = 0, lowest = 0;
  for (int i = 0; i < 600; ++i) {
    powertrain.step(all(i < 300 ? 1.0 : 0.0));
    highest = std::max(highest, powertrain.motor_current_a()[0]);
    lowest = std::min(lowest, powertrain.motor_current_a()[0]);
  }
  EXPECT_DOUBLE_EQ(highest, motor.current_limit_a);
  EXPECT_DOUBLE_EQ(lowest, -motor.current_limit_a);
  EXPECT_EQ(powertrain.rotor_radps()[0], 0) << "friction stops a rotor, it does not turn it back";
}

TEST(Powertrain, EnergyAndChargeBalance) {
  const MotorConfig motor;
  const RotorConfig rotor;
  const BatteryConfig battery;
  Powertrain powertrain(motor, rotor, battery);
  double delivered = 0, heat = 0, charge = 0;  // battery, J and As
  double avionics = 0, controllers = 0, copper = 0, shaft = 0, kinetic_gain = 0;
  for (int i = 0; i < 60'000; ++i) {
    const double t = i * kTick_s;
    MotorCommand command;
    for (std::size_t k = 0; k < 4; ++k) {
      command.throttle[k] = 0.5 + 0.15 * std::sin(2.1 * t + static_cast<double>(k));
    }
    const auto before = powertrain.rotor_radps();
    powertrain.step(command);
    const BatteryState& now = powertrain.battery();
    delivered += now.voltage_v * now.current_a * kTick_s;
    heat += now.current_a * now.current_a * battery.resistance_ohm * kTick_s;
    charge += now.current_a * kTick_s;
    avionics += battery.avionics_w * kTick_s;
    for (std::size_t k = 0; k < 4; ++k) {
      const double current = powertrain.motor_current_a()[k];
      const double w = 0.5 * (before[k] + powertrain.rotor_radps()[k]);
      const double electrical = command.throttle[k] * now.voltage_v * current * kTick_s;
      controllers +=
          electrical *
          (current > 0 ? 1 / motor.controller_efficiency - 1 : 1 - motor.controller_efficiency) *
          (current > 0 ? 1 : -1);
      copper += current * current * motor.resistance_ohm * kTick_s;
      shaft += (motor.torque_constant_nm_per_a * motor.no_load_current_a +
                rotor.thrust_coefficient * rotor.torque_ratio_m * w * w) *
               w * kTick_s;
      kinetic_gain += 0.5 * rotor.inertia_kgm2 *
                      (std::pow(powertrain.rotor_radps()[k], 2) - std::pow(before[k], 2));
    }
  }
  const double soc = powertrain.battery().state_of_charge;
  const double drop = 3600 * (stored_wh(battery, 1) - stored_wh(battery, soc));
  EXPECT_NEAR(delivered + heat, drop, 1e-5 * drop);
  EXPECT_NEAR(charge, (1 - soc) * battery.capacity_ah * 3600, 1e-6 * charge);
  EXPECT_NEAR(powertrain.battery().used_wh * 3600, delivered, 1e-9 * delivered);
  EXPECT_GT(kinetic_gain, 0);
  EXPECT_NEAR(avionics + controllers + copper + shaft + kinetic_gain, delivered, 2e-3 * delivered);
}

TEST(Powertrain, HoversForTheReferenceTimeAndThenBrownsOut) {
  const MotorConfig motor;
  const RotorConfig rotor;
  Powertrain powertrain(motor, rotor, {});
  const HoverPoint hover = steady(motor, rotor, hover_speed(rotor));
  double eighty_percent_s = 0, end_s = 0;
  for (int i = 0; i < 900'000 && end_s == 0; ++i) {
    powertrain.step(all(hover.applied_v / powertrain.battery().voltage_v));
    if (eighty_percent_s == 0 && powertrain.battery().state_of_charge <= 0.2) {
      eighty_percent_s = i * kTick_s;
    }
    if (powertrain.browned_out()) end_s = i * kTick_s;
  }
  // Endurance: hovering from full to 80 % discharge.
  EXPECT_GT(eighty_percent_s, 10.0 * 60);
  EXPECT_LT(eighty_percent_s, 11.5 * 60);
  EXPECT_GT(end_s, eighty_percent_s);
  EXPECT_LT(end_s, 14.0 * 60);
  for (int i = 0; i < 2000; ++i) powertrain.step(all(0.6));
  EXPECT_LT(powertrain.rotor_radps()[0], 0.05 * hover.speed);
}

TEST(Powertrain, ControllersComeBackOnlyAfterZeroThrottle) {
  MotorConfig motor;
  motor.brownout_voltage_v = 15.0;  // within reach of a full battery's sag
  Powertrain powertrain(motor, {}, {});
  for (int i = 0; i < 300; ++i) powertrain.step(all(1.0));
  EXPECT_TRUE(powertrain.browned_out());
  EXPECT_GT(powertrain.battery().voltage_v, motor.brownout_voltage_v);
  powertrain.step(all(0.1));
  EXPECT_TRUE(powertrain.browned_out());
  powertrain.step(all(0.0));
  EXPECT_FALSE(powertrain.browned_out());
}

TEST(Powertrain, AWeakMotorGivesItsShareOfTheThrustAtAnyThrottle) {
  for (const double throttle : {0.3, 0.5, 0.9}) {
    for (const double share : {0.9, 0.7}) {
      Powertrain powertrain({}, {}, {});
      DriveFaults faults;
      faults.thrust_share[1] = share;
      powertrain.set_faults(faults);
      for (int i = 0; i < 1000; ++i) powertrain.step(all(throttle));
      const auto& speed = powertrain.rotor_radps();
      EXPECT_NEAR(std::pow(speed[1] / speed[0], 2), share, 0.005) << throttle;
      EXPECT_EQ(speed[0], speed[3]);
    }
  }
}

TEST(Powertrain, AStoppedControllerGivesNoCurrentAndItsRotorRunsOut) {
  Powertrain powertrain({}, {}, {});
  powertrain.set_rotor_radps({716, 716, 716, 716});
  DriveFaults faults;
  faults.stopped[2] = true;
  powertrain.set_faults(faults);
  for (int i = 0; i < 300; ++i) powertrain.step(all(0.5));
  EXPECT_EQ(powertrain.motor_current_a()[2], 0);
  // J w' = -kQ w^2 - Kt I0, from 716 rad/s.
  const RotorConfig rotor;
  const MotorConfig motor;
  double speed = 716;
  for (int i = 0; i < 30000; ++i) {
    speed -= 1e-5 / rotor.inertia_kgm2 *
             (rotor.thrust_coefficient * rotor.torque_ratio_m * speed * speed +
              motor.torque_constant_nm_per_a * motor.no_load_current_a);
  }
  EXPECT_NEAR(powertrain.rotor_radps()[2], speed, 0.5);
  EXPECT_GT(powertrain.rotor_radps()[0], 600);
  faults.stopped[2] = false;
  powertrain.set_faults(faults);
  for (int i = 0; i < 1000; ++i) powertrain.step(all(0.5));
  EXPECT_NEAR(powertrain.rotor_radps()[2], powertrain.rotor_radps()[0], 1);
}

TEST(Powertrain, AWornCellCostsVoltageAndMoreUnderLoad) {
  Powertrain sound({}, {}, {}), worn({}, {}, {});
  DriveFaults faults;
  faults.added_resistance_ohm = 0.05;
  faults.lost_voltage_v = 0.3;
  worn.set_faults(faults);
  for (int i = 0; i < 1000; ++i) {
    sound.step(all(0.55));
    worn.step(all(0.55));
  }
  const BatteryState &a = sound.battery(), &b = worn.battery();
  EXPECT_NEAR(worn.open_circuit_v(), sound.open_circuit_v() - 0.3, 0.01);
  EXPECT_NEAR(worn.open_circuit_v() - b.voltage_v, 0.078 * b.current_a, 1e-4);
  EXPECT_NEAR(sound.open_circuit_v() - a.voltage_v, 0.028 * a.current_a, 1e-4);
}

}  // namespace
}  // namespace arex::sim
