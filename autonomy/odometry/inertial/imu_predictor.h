#pragma once

#include <optional>
#include <vector>

#include "messages/estimates.h"
#include "odometry/inertial/gyro_clipping.h"
#include "odometry/inertial/navigation_state.h"

namespace arex {

/// The 200 Hz output: every IMU sample integrated by the midpoint from the newest scan update
/// (paper, eqs. (5)-(9)). An update that arrives late is anchored at its own time and the samples
/// since are integrated again.
class ImuPredictor {
 public:
  void add(const ImuSample& imu);
  /// Of the gyro, as soon as it is known; from the next sample on.
  void set_gyro_full_scale(double radps) { completion_.full_scale_radps = radps; }
  /// Starts anew from the state at `stamp`.
  void anchor(Stamp stamp, const NavigationState& state, double accel_scale,
              const GyroCompletion& completion);

  /// The state at `stamp`, the newest sample held if that lies behind; nothing before the first
  /// anchor.
  [[nodiscard]] std::optional<NavigationState> at(Stamp stamp) const;
  /// NavigationState::t_d of the anchor, s.
  [[nodiscard]] std::optional<double> time_offset() const {
    return head_ ? std::optional(head_->t_d) : std::nullopt;
  }

 private:
  void advance();
  void integrate(Stamp to, NavigationState& state, GyroCompletion& completion) const;

  std::vector<ImuSample> samples_;  ///< from one at or before the anchor on
  std::optional<NavigationState> head_;
  Stamp head_stamp_ = 0;
  double accel_scale_ = 1;
  GyroCompletion completion_;
};

}  // namespace arex
