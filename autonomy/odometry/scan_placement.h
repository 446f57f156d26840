#pragma once

#include "messages/registered_scan.h"
#include "messages/sensors.h"
#include "odometry/pose_history.h"

namespace arex {

/// A frame placed in O by the poses of the vehicle while it was taken, one a millisecond: at
/// 3 rad/s and 20 m that is 3 cm at most. @pre `poses` is not empty
RegisteredScan place_scan(const LidarScan& scan, const PoseHistory& poses, const Pose& X_BL);

}  // namespace arex
