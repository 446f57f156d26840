#pragma once

#include "math/types.h"
#include "math/vibration_config.h"

namespace arex {

/// Rate of the flight controller's own IMU.
inline constexpr double kFlightImuHz = 1000;

/// When a motor is called weak.
struct MotorWatchConfig {
  double weak_fraction = 0.07;  ///< of a hovering rotor's thrust; sound flights stay below 0.04
  double weak_s = 1.0;          ///< and for so long
  double fallen_fraction =
      0.08;               ///< the same against before; sound flights stay below 0.05, in wind
  double fallen_s = 1.5;  ///< and for so long
  /// Of a hovering rotor's thrust. One that is weak by 30 % misses 60 % of it where it is told to
  /// give twice as much, one that stands still all that it is told.
  double stopped_fraction = 0.75;
  double stopped_s = 0.05;

  void fields(auto& f) {
    f("weak_fraction", weak_fraction,
      "a rotor that gives this part of its hover thrust less than the others do is weak");
    f("weak_s", weak_s, "for so long");
    f("fallen_fraction", fallen_fraction,
      "one that gives this part less than it did before in the flight is weak, whatever the others "
      "give");
    f("fallen_s", fallen_s, "for so long");
    f("stopped_fraction", stopped_fraction, "one that gives this part less has stopped");
    f("stopped_s", stopped_s, "for so long");
    f.check(weak_fraction > 0 && stopped_fraction > weak_fraction,
            "0 < weak_fraction < stopped_fraction");
    f.check(fallen_fraction > 0 && fallen_s > 0, "fallen_fraction, fallen_s > 0");
    f.check(weak_s > 0 && stopped_s > 0, "weak_s, stopped_s > 0");
  }
};

/// What an autopilot calls wrong with its vehicle.
struct HealthConfig {
  VibrationWatchConfig vibration;
  MotorWatchConfig motor;
  double tilt_limit_rad = to_radians(60);  ///< PX4's FD_FAIL_P and FD_FAIL_R
  double tilt_s = 0.1;                     ///< PX4 waits 0.3 s; a stopped motor does not
  double pack_resistance_ohm = 0.028;      ///< of the sound battery with its wiring
  double weak_pack_factor = 1.8;           ///< a worn cell of four has some ten times a sound one's
  double field_step_gauss = 0.05;  ///< RMS between readings 5 ms apart; the fastest turn gives 0.01
  double pressure_step_pa = 8;  ///< RMS between readings 20 ms apart; climbing at 2 m/s gives 0.5
  double voltage_step_v =
      0.35;  ///< RMS between power readings 10 ms apart; a 10 A step is 0.28 once

  void fields(auto& f) {
    f("vibration", vibration, "when the airframe is called shaking");
    f("motor", motor, "when a motor is called weak");
    f("tilt_limit_rad", tilt_limit_rad, "a vehicle that leans further is out of control (PX4)");
    f("tilt_s", tilt_s, "for so long");
    f("pack_resistance_ohm", pack_resistance_ohm, "inner resistance of the sound battery");
    f("weak_pack_factor", weak_pack_factor,
      "a battery of more than this times that has a weak cell");
    f("field_step_gauss", field_step_gauss,
      "RMS change between magnetometer readings that is called noise");
    f("pressure_step_pa", pressure_step_pa,
      "RMS change between barometer readings that is called noise");
    f.check(tilt_limit_rad > 0 && tilt_s >= 0, "tilt_limit_rad > 0, tilt_s >= 0");
    f("voltage_step_v", voltage_step_v,
      "RMS change between power readings' voltages that is called noise");
    f.check(pack_resistance_ohm > 0, "pack_resistance_ohm > 0");
    f.check(weak_pack_factor > 1, "weak_pack_factor > 1");
    f.check(field_step_gauss > 0 && pressure_step_pa > 0 && voltage_step_v > 0,
            "field_step_gauss, pressure_step_pa, voltage_step_v > 0");
  }
};

}  // namespace arex
