#pragma once

#include <optional>
#include <string>

#include "math/noise_watch.h"
#include "math/types.h"

namespace arex {

/// Watches the magnetometer as an IMU's nine axes hold it: its newest sample, again and again until
/// the next one comes. One that has gone silent looks like one that is stuck. An IMU without a
/// magnetometer gives zeros, of which nothing is said.
class FieldWatch {
 public:
  /// @param step_gauss RMS change between samples that is called noise
  explicit FieldWatch(double step_gauss) : noise_("imu's magnetometer", step_gauss) {}

  void add(const Vec3& field_gauss);

  /// @param in_air the vehicle turns and shakes: a field that stays the same is no sign of rest
  /// @return what has changed since the last call, for an event: "imu's magnetometer stuck"
  [[nodiscard]] std::optional<std::string> update(bool in_air);

 private:
  static constexpr int kLearnt = 200;  ///< readings, a second of them
  static constexpr int kStuck = 60;    ///< readings, and what a slow magnetometer takes for four
  static constexpr int kSlow = 4;

  NoiseWatch noise_;
  Vec3 last_ = Vec3::Zero();
  int readings_ = 0;  ///< learnt from
  int same_ = 0;      ///< in a row
  int usual_ = 0;     ///< longest such row while learning
  bool stuck_ = false;
};

}  // namespace arex
