#include "odometry/pose_history.h"

#include <algorithm>
#include <iterator>

namespace arex {
namespace {

// Long enough for a LiDAR frame and every device's latency.
constexpr Stamp kKept = kNanosecondsPerSecond;

}  // namespace

void PoseHistory::add(const Odometry& odometry) {
  if (odometry.status == OdometryStatus::kInitialising) return;
  if (!poses_.empty() && poses_.back().stamp >= odometry.stamp) {
    poses_.back().X_OB = odometry.X_OB;  // the same moment, corrected
    return;
  }
  poses_.push_back({odometry.stamp, odometry.X_OB});
  while (poses_.back().stamp - poses_.front().stamp > kKept) poses_.pop_front();
}

Pose PoseHistory::at(Stamp stamp) const {
  const auto after =
      std::lower_bound(poses_.begin(), poses_.end(), stamp,
                       [](const StampedPose& pose, Stamp s) { return pose.stamp < s; });
  if (after == poses_.begin()) return poses_.front().X_OB;
  if (after == poses_.end()) return poses_.back().X_OB;
  const StampedPose& before = *std::prev(after);
  return interpolate(
      before.X_OB, after->X_OB,
      static_cast<double>(stamp - before.stamp) / static_cast<double>(after->stamp - before.stamp));
}

}  // namespace arex
