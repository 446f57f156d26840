#include "odometry/mocap_source.h"

namespace arex {

void MocapSource::add_mocap(const MocapSample& mocap) {
  odometry_.stamp = odometry_.correction_stamp = mocap.stamp;
  odometry_.X_OB = mocap.X_OB;
  odometry_.v_OB = mocap.v_OB;
  odometry_.status = OdometryStatus::kOk;
  poses_.add(odometry_);
}

std::optional<OdometrySource::Job> MocapSource::add_scan(const LidarScanPtr& scan) {
  if (!poses_.empty() && !scan->points.empty()) scans_.push_back(place_scan(*scan, poses_, X_BL_));
  return std::nullopt;
}

}  // namespace arex
