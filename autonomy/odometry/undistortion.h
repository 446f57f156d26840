#pragma once

#include <vector>

#include "odometry/inertial/navigation_state.h"
#include "odometry/lidar_inertial_config.h"

/// Every point of a scan as it would have been measured at one instant. Source: AREX paper, eq.
/// (4), whose instant is the scan's end.
namespace arex {

/// The motion over one IMU interval: constant body rate, constant acceleration in O.
struct MotionSegment {
  Stamp begin = 0;
  Stamp end = 0;
  Pose X_OB;                   ///< at `begin`
  Vec3 v_OB = Vec3::Zero();    ///< at `begin`, m/s
  Vec3 w_OB_B = Vec3::Zero();  ///< rad/s, bias removed
  Vec3 a_OB = Vec3::Zero();    ///< m/s^2, gravity included

  [[nodiscard]] Pose pose_at(double since_begin_s) const;
};

/// The segment that propagate(x, imu) follows.
MotionSegment motion_segment(const NavigationState& x, const ImuInterval& imu);

/// A point in L at the instant that its scan was undistorted to.
struct ScanPoint {
  Vec3f p_L = Vec3f::Zero();
  float range_m = 0;        ///< as measured
  std::uint32_t index = 0;  ///< of the point in its scan
};

/// Undistorts a scan whose motion is covered by `segments` (in order, contiguous, up to the scan's
/// end); points before the first segment follow it backwards. Drops what is not the world: returns
/// of the airframe (nearer to B than `body_radius_m`), in the blind zone, too far, not finite.
/// @param X_OB of the instant, on the segments' path
std::vector<ScanPoint> undistort(const LidarScan& scan, const std::vector<MotionSegment>& segments,
                                 const Pose& X_OB, const Pose& X_BL, const LidarNoiseConfig& config,
                                 double body_radius_m);

}  // namespace arex
