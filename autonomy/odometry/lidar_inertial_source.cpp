#include "odometry/lidar_inertial_source.h"

#include <utility>

namespace arex {

std::optional<OdometrySource::Job> LidarInertialSource::add_scan(const LidarScanPtr& scan) {
  return [this, job = odometry_.prepare(scan)]() -> Delivery {
    return [this, update = odometry_.correct(job)] { apply(update); };
  };
}

void LidarInertialSource::apply(const ScanUpdate& update) {
  odometry_.apply(update);
  for (std::string& fault : imu_watch_.update(update.state, update.covariance)) {
    faults_.push_back(std::move(fault));
  }
  if (update.recovered) poses_.clear();
  poses_.add(odometry_.odometry());
  RegisteredScan scan;
  scan.begin = update.begin;
  scan.stamp = update.end;
  scan.jumped = update.recovered;
  if (const int points = update.registration.points; points > 0) {
    scan.matched_share = static_cast<double>(update.registration.matched) / points;
  }
  // The frame of a recovery began at a pose that nobody knows.
  if (update.points_O && !update.points_O->empty() && !poses_.empty() && !update.recovered) {
    scan.p_OB = poses_.at(update.end).p;
    scan.origin_end_O = (poses_.at(update.end) * X_BL_).p;
    scan.origin_begin_O = (poses_.at(update.begin) * X_BL_).p;
    scan.points_O = update.points_O;
    scan.fractions = update.fractions;
  }
  scans_.push_back(std::move(scan));
}

}  // namespace arex
