#pragma once

#include <algorithm>
#include <cmath>

#include "physics/truth.h"

namespace arex::sim {

/// How a flight turned about the world's vertical: what rapid yaw costs an odometry is held against
/// this.
class YawMeter {
 public:
  /// A rate beyond which a turn counts as a spin: half as fast again as headings are planned
  /// (planning.yaw), so that one that overshoots is none.
  static constexpr double kSpin_radps = 2.25;

  /// After each physics tick.
  void add(const Truth& truth) {
    const double rate = std::abs(truth.X_WB.R.row(2).dot(truth.w_WB_B));
    turned_rad_ += rate * kSecondsPerTick;
    fastest_radps_ = std::max(fastest_radps_, rate);
    const bool spins = rate > (spinning_ ? kOver * kSpin_radps : kSpin_radps);
    spins_ += spins && !spinning_;
    spinning_ = spins;
  }

  [[nodiscard]] double turned_rad() const { return turned_rad_; }
  [[nodiscard]] double fastest_radps() const { return fastest_radps_; }
  [[nodiscard]] int spins() const { return spins_; }

 private:
  static constexpr double kOver = 0.7;  ///< of kSpin_radps: slower than this the spin has ended

  double turned_rad_ = 0;
  double fastest_radps_ = 0;
  int spins_ = 0;
  bool spinning_ = false;
};

}  // namespace arex::sim
