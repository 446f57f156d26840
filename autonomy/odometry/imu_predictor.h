#pragma once

#include <optional>
#include <vector>

#include "messages/estimates.h"
#include "odometry/navigation_state.h"

namespace arex {

/// The 200 Hz output: every IMU sample integrated by the midpoint from the newest scan update
/// (paper, eqs. (5)-(9)). An update that arrives late is anchored at its own time and the samples
/// since are integrated again.
class ImuPredictor {
 public:
  /// The state after `imu`; nothing before the first anchor.
  std::optional<NavigationState> add(const ImuSample& imu);

  /// Starts anew from the state at `stamp`.
  /// @returns the state after the newest sample.
  const std::optional<NavigationState>& anchor(Stamp stamp, const NavigationState& state,
                                               double accel_scale);

 private:
  void advance(Stamp to);

  std::vector<ImuSample> samples_;  ///< from one at or before the anchor on
  std::optional<NavigationState> head_;
  Stamp head_stamp_ = 0;
  double accel_scale_ = 1;
};

}  // namespace arex
