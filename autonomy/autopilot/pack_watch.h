#pragma once

#include <cmath>
#include <optional>

#include "messages/sensors.h"

namespace arex {

/// The inner resistance of a battery from how its voltage answers the current: the slope of the
/// differences between successive readings, over the last few seconds. The open-circuit voltage
/// falls far too slowly to matter in 5 ms.
class PackWatch {
 public:
  void add(const BatterySample& sample) {
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

 private:
  static constexpr double kMemory_s = 3;
  static constexpr double kLeast_a2 = 1;
  static constexpr double kLargestStep_v = 0.25;

  BatterySample last_;
  bool has_last_ = false;
  double products_ = 0;  ///< sum of -dV dI, V A
  double squares_ = 0;   ///< sum of dI^2, A^2
};

}  // namespace arex
