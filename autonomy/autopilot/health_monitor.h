#pragma once

#include <string>
#include <vector>

#include "autopilot/health_config.h"
#include "autopilot/motor_watch.h"
#include "autopilot/pack_watch.h"
#include "math/noise_watch.h"
#include "math/stream_watch.h"
#include "math/vibration_watch.h"
#include "messages/events.h"
#include "messages/sensors.h"

namespace arex {

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
  /// Whether nothing tells the height, and the vertical speed is the integral of the IMU's errors.
  [[nodiscard]] bool barometer_silent() const { return barometer_.silent(); }
  /// RMS of a barometer reading that was told to be noisy, Pa; 0 of a sound one.
  [[nodiscard]] double pressure_noise_pa() const;

 private:
  void report(Stamp now, EventKind kind, std::string detail);
  void watch_streams(Stamp now, bool in_air);
  void watch_noise(Stamp now, NoiseWatch& watch);
  void watch_tilt(Stamp now, const Flight& flight, double dt_s);
  void watch_battery(Stamp now);

  HealthConfig config_;
  StreamWatch imu_, magnetometer_, barometer_, power_;
  VibrationWatch vibration_;
  MotorWatch motors_;
  PackWatch pack_;
  NoiseWatch field_, pressure_, voltage_;
  double tilted_s_ = 0;
  bool tilt_told_ = false;
  bool pack_told_ = false;
  std::vector<Event> notices_;
};

}  // namespace arex
