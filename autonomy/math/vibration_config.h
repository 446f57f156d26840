#pragma once

namespace arex {

/// When an airframe is called shaking: well beyond what the roughest of the recorded airframes
/// reads in hover (imu.vibration.level rough: 0.35 rad/s and 5.8 m/s^2 RMS of 1 kHz).
struct VibrationWatchConfig {
  double gyro_limit_radps = 0.6;  ///< RMS of the strongest axis
  double accel_limit_mps2 = 9;    ///< RMS of the strongest axis
  double window_s = 0.5;

  void fields(auto& f) {
    f("gyro_limit_radps", gyro_limit_radps, "RMS of the strongest axis above 5 Hz that is told");
    f("accel_limit_mps2", accel_limit_mps2, "RMS of the strongest axis above 5 Hz that is told");
    f("window_s", window_s, "over which it is measured");
    f.check(gyro_limit_radps > 0, "gyro_limit_radps > 0");
    f.check(accel_limit_mps2 > 0, "accel_limit_mps2 > 0");
    f.check(window_s >= 0.1 && window_s <= 60, "0.1 <= window_s <= 60");
  }
};

}  // namespace arex
