#include "odometry/lidar_inertial_odometry.h"

#include <utility>

namespace arex {

LidarInertialOdometry::LidarInertialOdometry(const LidarInertialConfig& config,
                                             const VehicleConfig& vehicle)
    : LidarInertialOdometry(config, vehicle.X_BL(), vehicle.radius_m) {}

LidarInertialOdometry::LidarInertialOdometry(const LidarInertialConfig& config, const Pose& X_BL,
                                             double body_radius_m)
    : health_(config.health), corrector_(config, X_BL, body_radius_m) {}

Odometry LidarInertialOdometry::add_imu(const ImuSample& imu) {
  unhanded_.push_back(imu);
  newest_ = imu;
  publish(imu.stamp, predictor_.add(imu));
  return odometry_;
}

ScanJob LidarInertialOdometry::prepare(const LidarScanPtr& scan) {
  return {scan, std::exchange(unhanded_, {})};
}

void LidarInertialOdometry::apply(const ScanUpdate& update) {
  scan_status_ = update.status;
  odometry_.correction_stamp = update.correction_stamp;
  if (update.status == OdometryStatus::kInitialising) return;
  publish(newest_.stamp, predictor_.anchor(update.stamp, update.state, update.accel_scale));
}

ScanUpdate LidarInertialOdometry::add_scan(const LidarScanPtr& scan) {
  ScanUpdate update = correct(prepare(scan));
  apply(update);
  return update;
}

void LidarInertialOdometry::publish(Stamp stamp, const std::optional<NavigationState>& state) {
  odometry_.stamp = stamp;
  odometry_.status = scan_status_;
  if (!state) return;
  odometry_.X_OB = state->X_OB();
  odometry_.v_OB = state->v_OB;
  odometry_.w_OB_B = newest_.gyro_radps - state->b_g;
  const double silence_s = to_seconds(stamp - odometry_.correction_stamp);
  if (silence_s > health_.lost_silence_s) {
    odometry_.status = OdometryStatus::kLost;
  } else if (silence_s > health_.degenerate_silence_s && odometry_.status == OdometryStatus::kOk) {
    odometry_.status = OdometryStatus::kDegenerate;
  }
}

}  // namespace arex
