#pragma once

#include <deque>

#include "math/pose.h"
#include "messages/estimates.h"

namespace arex {

/// The newest second of an odometry's estimates: where the vehicle was when a frame was taken.
class PoseHistory {
 public:
  /// Estimates in order; one of the same moment replaces the one before. None are kept before the
  /// odometry has begun.
  void add(const Odometry& odometry);
  void clear() { poses_.clear(); }

  [[nodiscard]] bool empty() const { return poses_.empty(); }
  /// @pre not empty
  [[nodiscard]] Stamp begin() const { return poses_.front().stamp; }
  /// @pre not empty
  [[nodiscard]] Stamp end() const { return poses_.back().stamp; }
  /// X_OB, interpolated; before the first and after the last it stands still. @pre not empty
  [[nodiscard]] Pose at(Stamp stamp) const;

 private:
  struct StampedPose {
    Stamp stamp = 0;
    Pose X_OB;
  };
  std::deque<StampedPose> poses_;
};

}  // namespace arex
