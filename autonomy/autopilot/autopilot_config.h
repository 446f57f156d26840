#pragma once

#include "autopilot/health_config.h"
#include "math/types.h"

namespace arex {

/// Attitude filter. Noise figures are the filter's belief, continuous-time densities.
struct AhrsConfig {
  double initialisation_s = 2.0;   ///< length of the static window
  double still_gyro_radps = 0.02;  ///< largest standard deviation of a static window
  double still_accel_mps2 = 0.4;
  double correction_hz = 50;     ///< covariance and drag updates, on means of the raw samples
  double gyro_noise = 2e-4;      ///< rad/s/sqrt(Hz); twice the sensor's, for vibration
  double gyro_walk = 3e-5;       ///< rad/s^2/sqrt(Hz)
  double gust_noise = 0.5;       ///< m/s^2/sqrt(Hz): how fast the airspeed changes unforeseen
  double vertical_noise = 0.1;   ///< m/s^2/sqrt(Hz)
  double drag_s_per_m = 0.02;    ///< rotor drag in the rotor plane per thrust and airspeed
                                 ///< (RotorS, Hummingbird)
  double drag_noise_mps2 = 0.4;  ///< of one window's mean specific force about that line
  double airspeed_at_takeoff_mps = 3.0;  ///< unknown wind when the feet leave the ground
  double takeoff_s = 1.0;  ///< from the take-off's begin until only air touches the vehicle
  double magnetic_heading_noise_rad = 0.05;
  double barometer_noise_m = 0.2;
  double still_noise_mps = 0.02;  ///< of the zero velocity on the ground
  double gate_sigma = 4;          ///< innovations beyond this are refused

  void fields(auto& f) {
    f("initialisation_s", initialisation_s, "length of the static initialisation window");
    f("still_gyro_radps", still_gyro_radps, "largest gyro deviation of a static window");
    f("still_accel_mps2", still_accel_mps2, "largest accelerometer deviation of a static window");
    f("correction_hz", correction_hz, "rate of the filter's corrections");
    f("gyro_noise", gyro_noise, "believed gyro density, rad/s/sqrt(Hz)");
    f("gyro_walk", gyro_walk, "believed gyro bias walk, rad/s^2/sqrt(Hz)");
    f("gust_noise", gust_noise, "believed density of airspeed changes, m/s^2/sqrt(Hz)");
    f("vertical_noise", vertical_noise, "believed vertical acceleration noise, m/s^2/sqrt(Hz)");
    f("drag_s_per_m", drag_s_per_m, "in-plane rotor drag per thrust and airspeed");
    f("drag_noise_mps2", drag_noise_mps2, "believed error of the drag line, one window");
    f("airspeed_at_takeoff_mps", airspeed_at_takeoff_mps, "unknown wind at take-off, 1 sigma");
    f("takeoff_s", takeoff_s, "time after the begin of the take-off without drag measurements");
    f("magnetic_heading_noise_rad", magnetic_heading_noise_rad, "of one magnetometer sample");
    f("barometer_noise_m", barometer_noise_m, "of one barometer sample");
    f("still_noise_mps", still_noise_mps, "of the zero velocity while on the ground");
    f("gate_sigma", gate_sigma, "innovations beyond this many sigma are refused");
    f.check(initialisation_s > 0 && initialisation_s <= 60, "0 < initialisation_s <= 60");
    f.check(correction_hz > 0 && correction_hz <= 500, "0 < correction_hz <= 500");
    f.check(drag_s_per_m > 0, "drag_s_per_m > 0");
    f.check(gate_sigma > 0, "gate_sigma > 0");
  }
};

/// What the autopilot believes of its motors; models/arex holds the truth. X2216 KV880 with APC
/// 9x4.5 (reference: 60 / (2 pi KV), the maker's winding resistance and no-load current).
struct MotorBelief {
  double torque_constant = 0.01085;  ///< Kt, N m/A and V/(rad/s)
  double resistance_ohm = 0.085;
  double no_load_current_a = 0.5;
  double time_constant_s = 0.028;        ///< at hover
  double zero_thrust_pitch_m = 0.02256;  ///< axial air speed per rotor speed at which the thrust is
                                         ///< gone: 0.62 diameters a turn
  double idle_speed_radps = 150;         ///< the rotors never turn slower while armed
  double nominal_voltage_v = 14.8;       ///< until the battery has been read
  double voltage_filter_s = 0.05;

  void fields(auto& f) {
    f("torque_constant", torque_constant, "motor constant Kt, N m/A");
    f("resistance_ohm", resistance_ohm, "winding resistance");
    f("no_load_current_a", no_load_current_a, "no-load current");
    f("time_constant_s", time_constant_s, "rotor speed lag at hover");
    f("zero_thrust_pitch_m", zero_thrust_pitch_m, "axial air speed per rotor speed, thrust gone");
    f("idle_speed_radps", idle_speed_radps, "slowest rotor speed while armed");
    f("nominal_voltage_v", nominal_voltage_v, "battery voltage until it has been read");
    f("voltage_filter_s", voltage_filter_s, "time constant of the battery voltage filter");
    f.check(torque_constant > 0, "torque_constant > 0");
    f.check(resistance_ohm > 0, "resistance_ohm > 0");
    f.check(zero_thrust_pitch_m > 0, "zero_thrust_pitch_m > 0");
    f.check(idle_speed_radps > 0, "idle_speed_radps > 0");
    f.check(voltage_filter_s > 0, "voltage_filter_s > 0");
  }
};

/// Attitude P and rate PID, the structure of PX4's multicopter controllers.
struct AttitudeControlConfig {
  Vec3 attitude_p{6.5, 6.5, 2.8};    ///< 1/s
  double yaw_weight = 0.4;           ///< of heading against tilt in the attitude error (PX4)
  Vec3 rate_p{0.25, 0.23, 0.13};     ///< N m/(rad/s): inertia times 18, 18, 6 1/s
  double rate_integral_per_s = 2.0;  ///< I = this * P
  double rate_derivative_s = 0.015;  ///< D = this * P
  double integral_limit_nm = 0.3;    ///< each axis
  double tilt_rate_limit_radps = to_radians(220);
  double yaw_rate_limit_radps = to_radians(200);
  double tilt_limit_rad = to_radians(45);
  double rate_loop_hz = 500;
  double attitude_loop_hz = 250;
  double gyro_cutoff_hz = 60;        ///< below one per revolution at hover, 109-120 Hz
  double derivative_cutoff_hz = 30;  ///< PX4's default for the D term

  void fields(auto& f) {
    f("attitude_p", attitude_p, "attitude gain, 1/s");
    f("yaw_weight", yaw_weight, "weight of heading against tilt (PX4)");
    f("rate_p", rate_p, "rate gain, N m/(rad/s)");
    f("rate_integral_per_s", rate_integral_per_s, "rate I gain over rate P gain, 1/s");
    f("rate_derivative_s", rate_derivative_s, "rate D gain over rate P gain");
    f("integral_limit_nm", integral_limit_nm, "bound of the rate integrator, each axis, N m");
    f("tilt_rate_limit_radps", tilt_rate_limit_radps, "limit of roll and pitch rate setpoints");
    f("yaw_rate_limit_radps", yaw_rate_limit_radps, "limit of the yaw rate setpoint");
    f("tilt_limit_rad", tilt_limit_rad, "largest commanded tilt");
    f("rate_loop_hz", rate_loop_hz, "rate loop");
    f("attitude_loop_hz", attitude_loop_hz, "attitude loop");
    f("gyro_cutoff_hz", gyro_cutoff_hz, "second-order low-pass on the gyro");
    f("derivative_cutoff_hz", derivative_cutoff_hz, "second-order low-pass on the D term");
    f.check(yaw_weight > 0 && yaw_weight <= 1, "0 < yaw_weight <= 1");
    f.check(rate_loop_hz > 0 && rate_loop_hz <= 1000, "0 < rate_loop_hz <= 1000");
    f.check(attitude_loop_hz > 0 && attitude_loop_hz <= rate_loop_hz,
            "0 < attitude_loop_hz <= rate_loop_hz");
    f.check(gyro_cutoff_hz > 0 && gyro_cutoff_hz < 500, "0 < gyro_cutoff_hz < 500");
    f.check(derivative_cutoff_hz > 0 && 2 * derivative_cutoff_hz < rate_loop_hz,
            "0 < derivative_cutoff_hz < rate_loop_hz / 2");
    f.check(tilt_limit_rad > 0 && tilt_limit_rad < 1.5, "0 < tilt_limit_rad < 1.5");
  }
};

/// Touchdown, from what carries the weight.
struct LandDetectorConfig {
  double contact_fraction = 0.2;     ///< of the weight: this much support means feet on the ground
  double contact_s = 0.1;            ///< and must last
  double support_fraction = 0.35;    ///< of the weight: support of a vehicle that has landed
  double low_thrust_fraction = 0.5;  ///< of the weight: less demanded thrust ends the flight
  double still_speed_mps = 0.4;      ///< vertical
  double still_rate_radps = 0.6;
  double persistence_s = 0.5;

  void fields(auto& f) {
    f("contact_fraction", contact_fraction, "part of the weight carried by the ground: contact");
    f("contact_s", contact_s, "how long contact must last");
    f("support_fraction", support_fraction, "part of the weight carried by the ground: landed");
    f("low_thrust_fraction", low_thrust_fraction, "demanded part of the weight: landed");
    f("still_speed_mps", still_speed_mps, "vertical speed below this is none");
    f("still_rate_radps", still_rate_radps, "body rate below this is none");
    f("persistence_s", persistence_s, "how long all of it must hold");
    f.check(contact_fraction > 0 && contact_fraction < 1, "0 < contact_fraction < 1");
    f.check(low_thrust_fraction > 0 && low_thrust_fraction < 1, "0 < low_thrust_fraction < 1");
    f.check(support_fraction >= contact_fraction && support_fraction < 1,
            "contact_fraction <= support_fraction < 1");
    f.check(persistence_s > 0, "persistence_s > 0");
  }
};

struct AutopilotConfig {
  AhrsConfig ahrs;
  MotorBelief motor;
  AttitudeControlConfig control;
  LandDetectorConfig land;
  HealthConfig health;
  double arming_tilt_rad = 0.45;  ///< no arming beyond
  double spin_up_s = 1.0;         ///< idle before thrust is given
  double takeoff_thrust_fraction =
      0.5;                         ///< of the weight: demanded thrust that ends the ground run
  double command_timeout_s = 0.5;  ///< then the autopilot descends by itself
  double descent_speed_mps = 0.5;
  double descent_p = 4.0;  ///< vertical acceleration per speed error, 1/s
  double descent_i = 3.0;  ///< and per its integral, 1/s^2

  void fields(auto& f) {
    f("ahrs", ahrs, "attitude filter");
    f("motor", motor, "believed motor constants");
    f("control", control, "attitude and rate loops");
    f("land", land, "touchdown detector");
    f("health", health, "what it calls wrong with the vehicle");
    f("arming_tilt_rad", arming_tilt_rad, "largest tilt at which the motors may be armed");
    f("spin_up_s", spin_up_s, "idle before thrust is given");
    f("takeoff_thrust_fraction", takeoff_thrust_fraction, "demanded part of the weight: take-off");
    f("command_timeout_s", command_timeout_s, "silence after which the autopilot descends");
    f("descent_speed_mps", descent_speed_mps, "of the autopilot's own descent");
    f("descent_p", descent_p, "vertical acceleration per speed error, 1/s");
    f("descent_i", descent_i, "vertical acceleration per integral of the speed error, 1/s^2");
    f.check(command_timeout_s > 0, "command_timeout_s > 0");
    f.check(descent_speed_mps > 0, "descent_speed_mps > 0");
    f.check(spin_up_s >= 0, "spin_up_s >= 0");
  }
};

}  // namespace arex
