#include "odometry/lidar_inertial_source.h"

namespace arex {

std::optional<OdometrySource::Job> LidarInertialSource::add_scan(const LidarScanPtr& scan) {
  return [this, job = odometry_.prepare(scan)]() -> Delivery {
    return [this, update = odometry_.correct(job)] { apply(update); };
  };
}

void LidarInertialSource::apply(const ScanUpdate& update) {
  odometry_.apply(update);
  if (update.recovered) poses_.clear();
  poses_.add(odometry_.odometry());
  RegisteredScan scan;
  scan.begin = update.begin;
  scan.stamp = update.stamp;
  scan.jumped = update.recovered;
  if (const int points = update.registration.points; points > 0) {
    scan.matched_share = static_cast<double>(update.registration.matched) / points;
  }
  // The frame of a recovery began at a pose that nobody knows.
  if (update.points_O && !update.points_O->empty() && !poses_.empty() && !update.recovered) {
    scan.p_OB = update.state.p_OB;
    scan.origin_end_O = (update.state.X_OB() * X_BL_).p;
    scan.origin_begin_O = (poses_.at(update.begin) * X_BL_).p;
    scan.points_O = update.points_O;
    scan.fractions = update.fractions;
  }
  scans_.push_back(std::move(scan));
}

}  // namespace arex
