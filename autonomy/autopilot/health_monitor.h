#pragma once

#include <string>
#include <vector>

#include "autopilot/motor_watch.h"
#include "autopilot/pack_watch.h"
#include "math/stream_watch.h"
#include "math/vibration_watch.h"
#include "messages/events.h"
#include "messages/sensors.h"

namespace arex {

/// What an autopilot calls wrong with its vehicle.
struct HealthConfig {
  VibrationWatchConfig vibration;
  MotorWatchConfig motor;
  double tilt_limit_rad = to_radians(60);  ///< PX4's FD_FAIL_P and FD_FAIL_R
  double tilt_s = 0.1;                     ///< PX4 waits 0.3 s; a stopped motor does not
  double pack_resistance_ohm = 0.028;      ///< of the sound battery with its wiring
  double weak_pack_factor = 1.8;           ///< a worn cell of four has some ten times a sound one's
  double field_step_gauss = 0.05;  ///< RMS between readings 5 ms apart; the fastest turn gives 0.01
  double pressure_step_pa = 8;     ///< RMS between readings 20 ms apart; climbing at 2 m/s gives 0.5

  void fields(auto& f) {
    f("vibration", vibration, "when the airframe is called shaking");
    f("motor", motor, "when a motor is called weak");
    f("tilt_limit_rad", tilt_limit_rad, "a vehicle that leans further is out of control (PX4)");
    f("tilt_s", tilt_s, "for so long");
    f("pack_resistance_ohm", pack_resistance_ohm, "inner resistance of the sound battery");
    f("weak_pack_factor", weak_pack_factor, "a battery of more than this times that has a weak cell");
    f("field_step_gauss", field_step_gauss,
      "RMS change between magnetometer readings that is called noise");
    f("pressure_step_pa", pressure_step_pa,
      "RMS change between barometer readings that is called noise");
    f.check(tilt_limit_rad > 0 && tilt_s >= 0, "tilt_limit_rad > 0, tilt_s >= 0");
    f.check(pack_resistance_ohm > 0, "pack_resistance_ohm > 0");
    f.check(weak_pack_factor > 1, "weak_pack_factor > 1");
    f.check(field_step_gauss > 0 && pressure_step_pa > 0,
            "field_step_gauss, pressure_step_pa > 0");
  }
};

/// What the autopilot finds to be wrong with its sensors, its motors, its battery and its airframe.
/// It tells and does nothing: what becomes of the flight is the mission's to decide.
class HealthMonitor {
 public:
  HealthMonitor(const HealthConfig& config, const Eigen::Matrix4d& mix, double weight_n);

  // What arrives, between two calls of update.
  void add_imu(Stamp now, const ImuSample& imu);
  void add_magnetometer(Stamp now, const MagnetometerSample& sample);
  void add_barometer(Stamp now, const BarometerSample& sample);
  void add_battery(Stamp now, const BatterySample& sample);

  /// How it flies, as the autopilot knows it.
  struct Flight {
    bool armed = false;
    bool in_air = false;  ///< flying, and nothing but its rotors carries it
    double tilt_rad = 0;
    MotorWatch::Missing missing;  ///< of thrust and torque
  };
  /// @param dt_s since the last call
  void update(Stamp now, const Flight& flight, double dt_s);

  /// What is new since the last call.
  std::vector<Event> take_notices();

  [[nodiscard]] const MotorWatch& motors() const { return motors_; }
  [[nodiscard]] const VibrationWatch& vibration() const { return vibration_; }

 private:
  /// Mean square of the steps between readings of a sensor, over a second or so.
  struct Steps {
    Vec3 last = Vec3::Zero();
    double squares = -1;  ///< -1: no reading yet
    bool told = false;
    void add(const Vec3& value, double share);
  };

  void report(Stamp now, EventKind kind, std::string detail);
  void watch_streams(Stamp now, bool in_air);
  void watch_noise(Stamp now, Steps& steps, double limit, const std::string& name);
  void watch_tilt(Stamp now, const Flight& flight, double dt_s);
  void watch_battery(Stamp now);

  HealthConfig config_;
  StreamWatch imu_, magnetometer_, barometer_, power_;
  VibrationWatch vibration_;
  MotorWatch motors_;
  PackWatch pack_;
  Steps field_, pressure_;
  double tilted_s_ = 0;
  bool tilt_told_ = false;
  bool pack_told_ = false;
  std::vector<Event> notices_;
};

}  // namespace arex
