#pragma once

#include <array>
#include <optional>
#include <string>

#include "math/types.h"
#include "math/vibration_config.h"

namespace arex {

/// How much one window shook, above 5 Hz.
struct Vibration {
  double gyro_radps = 0;    ///< RMS of the strongest axis
  double accel_mps2 = 0;    ///< likewise
  double frequency_hz = 0;  ///< of the strongest axis of the gyro, by its zero crossings
};

/// Measures vibration by an IMU's samples: RMS of what a first-order high-pass leaves, and how
/// often it crosses zero. A resonance is one line that stands out, and the crossings are its
/// frequency; of broadband shaking they are a middle one. At a stack's 200 Hz, lines above 100 Hz
/// alias.
class VibrationWatch {
 public:
  /// @param sample_hz of what add() is given
  VibrationWatch(const VibrationWatchConfig& config, double sample_hz);

  void add(const Vec3& gyro_radps, const Vec3& accel_mps2);

  /// @return what is new since the last call, for an event: "gyro 2.31 rad/s RMS at 79 Hz,
  /// accelerometer 14.0 m/s^2 RMS", once it shakes, again when it shakes twice as much
  [[nodiscard]] std::optional<std::string> update();

  /// Of the newest whole window.
  [[nodiscard]] const Vibration& newest() const { return newest_; }
  /// Whether the newest window is beyond the limits.
  [[nodiscard]] bool shakes() const { return excess() > 1; }

 private:
  static constexpr double kHighPass_hz = 5;

  [[nodiscard]] double excess() const;  ///< over the limits, the larger of the two ratios
  void close_window();

  VibrationWatchConfig config_;
  double sample_hz_;
  double share_;  ///< of a sample in the mean that the high-pass takes off
  int window_;    ///< samples
  int samples_ = 0;
  bool primed_ = false;
  Vec3 gyro_mean_ = Vec3::Zero(), accel_mean_ = Vec3::Zero();
  Vec3 gyro_squares_ = Vec3::Zero(), accel_squares_ = Vec3::Zero();
  Vec3 gyro_before_ = Vec3::Zero();
  std::array<int, 3> crossings_{};
  Vibration newest_;
  bool fresh_ = false;  ///< a window has closed since the last update
  double told_ = 0;     ///< excess when last told; 0: not
};

}  // namespace arex
