#pragma once

#include <cmath>
#include <optional>

#include "messages/sensors.h"

namespace arex {

/// The inner resistance of a battery from how its voltage answers the current: the slope of the
/// differences between successive readings, over the last few seconds. The open-circuit voltage
/// falls far too slowly to matter in 5 ms; a fall that the current does not explain is a cell's
/// end, of which a vehicle that hovers may come down before the slope is known.
class PackWatch {
 public:
  /// @param resistance_ohm of the sound battery
  explicit PackWatch(double resistance_ohm) : sound_ohm_(resistance_ohm) {}

  /// @param noisy the power sensor is: its voltage falls and rises by itself
  void add(const BatterySample& sample, bool noisy = false) {
    const double open_v = sample.voltage_v + sound_ohm_ * sample.current_a;
    if (!has_last_) usual_open_v_ = open_v;
    const double missing_v = usual_open_v_ - open_v;
    low_in_a_row_ = missing_v > kFall_v && !noisy ? low_in_a_row_ + 1 : 0;
    if (low_in_a_row_ == kLowReadings) fall_v_ = missing_v;
    usual_open_v_ -= missing_v / kUsualReadings;
    if (has_last_) {
      const double dv = sample.voltage_v - last_.voltage_v;
      const double di = sample.current_a - last_.current_a;
      const double kept = 1 - to_seconds(sample.stamp - last_.stamp) / kMemory_s;
      // A cell that fails is a step of the voltage, not its answer to the current.
      const double counts = std::abs(dv) < kLargestStep_v ? 1 : 0;
      products_ = kept * products_ - counts * dv * di;
      squares_ = kept * squares_ + counts * di * di;
    }
    last_ = sample;
    has_last_ = true;
  }

  /// Nothing while the current has hardly changed.
  [[nodiscard]] std::optional<double> resistance_ohm() const {
    if (squares_ < kLeast_a2) return std::nullopt;
    return products_ / squares_;
  }

  /// By how much the open-circuit voltage has fallen at once, V; nothing of a sound one.
  [[nodiscard]] std::optional<double> fall_v() const { return fall_v_; }

 private:
  static constexpr double kMemory_s = 3;
  static constexpr double kLeast_a2 = 1;
  static constexpr double kLargestStep_v = 0.25;
  static constexpr double kFall_v = 1.5;  ///< 60 A at half of the sound resistance more
  static constexpr int kLowReadings = 5;  ///< in a row: a noisy sensor's hardly are
  static constexpr double kUsualReadings = 200;

  double sound_ohm_;
  double usual_open_v_ = 0;
  int low_in_a_row_ = 0;
  std::optional<double> fall_v_;
  BatterySample last_;
  bool has_last_ = false;
  double products_ = 0;  ///< sum of -dV dI, V A
  double squares_ = 0;   ///< sum of dI^2, A^2
};

}  // namespace arex
