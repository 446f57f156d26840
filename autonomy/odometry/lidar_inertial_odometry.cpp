#include "odometry/lidar_inertial_odometry.h"

#include <algorithm>
#include <utility>

namespace arex {

LidarInertialOdometry::LidarInertialOdometry(const LidarInertialConfig& config,
                                             const VehicleConfig& vehicle)
    : LidarInertialOdometry(config, vehicle.X_BL(), vehicle.radius_m) {}

LidarInertialOdometry::LidarInertialOdometry(const LidarInertialConfig& config, const Pose& X_BL,
                                             double body_radius_m)
    : health_(config.health),
      corrector_(config, X_BL, body_radius_m),
      imu_delay_s_(config.imu.delay_s),
      full_scale_(config.imu.gyro_range_radps) {}

Odometry LidarInertialOdometry::add_imu(const ImuSample& imu) {
  newest_ = imu;
  full_scale_.add(imu.gyro_radps);
  predictor_.set_gyro_full_scale(full_scale_.radps());
  unhanded_.push_back(imu);
  predictor_.add(unhanded_.back());
  publish();
  return odometry_;
}

ScanJob LidarInertialOdometry::prepare(const LidarScanPtr& scan) {
  std::optional<Odometry> suggested = std::exchange(suggested_, {});
  if (odometry_.status != OdometryStatus::kLost) suggested.reset();
  return {scan, std::exchange(unhanded_, {}), full_scale_.radps(), suggested};
}

void LidarInertialOdometry::apply(const ScanUpdate& update) {
  scan_status_ = update.status;
  scan_need_ = update.need;
  odometry_.correction_stamp = update.correction_stamp;
  silence_.end_interval();
  corrected_ = update.pose_covariance;
  corrected_velocity_ = update.covariance.block<3, 3>(kVelocity, kVelocity);
  imu_noise_ = update.imu_noise;
  corrected_at_ = update.stamp;
  if (update.status == OdometryStatus::kInitialising) {
    predictor_ = {};  // of a start that is taken back
    odometry_.status = update.status;
    return;
  }
  predictor_.anchor(update.stamp, update.state, update.accel_scale, update.gyro);
  publish();
}

ScanUpdate LidarInertialOdometry::add_scan(const LidarScanPtr& scan) {
  ScanUpdate update = correct(prepare(scan));
  apply(update);
  return update;
}

OdometryNeed LidarInertialOdometry::need() const {
  if (odometry_.status == OdometryStatus::kOk) return OdometryNeed::kNothing;
  const bool silent = silence_.lasts() && scan_status_ != OdometryStatus::kInitialising;
  return silent ? OdometryNeed::kScan : scan_need_;
}

void LidarInertialOdometry::publish() {
  // By the LiDAR's clock, as far as the IMU's is known to be off; it never runs backwards.
  const std::optional<double> t_d = predictor_.time_offset();
  const Stamp clock_offset = t_d ? from_seconds(*t_d - imu_delay_s_) : 0;
  odometry_.stamp = std::max(odometry_.stamp, newest_.stamp - clock_offset);
  odometry_.status = scan_status_;
  const std::optional<NavigationState> state = predictor_.at(odometry_.stamp);
  if (!state) return;
  odometry_.X_OB = state->X_OB();
  odometry_.v_OB = state->v_OB;
  odometry_.w_OB_B = state->rate(newest_.gyro_radps);
  odometry_.covariance = covariance_at(odometry_.stamp);
  const double silence_s = to_seconds(odometry_.stamp - odometry_.correction_stamp);
  const bool silent = silence_.wait(silence_s);
  if (silence_s > health_.lost_silence_s) {
    odometry_.status = OdometryStatus::kLost;
  } else if (silent && odometry_.status == OdometryStatus::kOk) {
    odometry_.status = OdometryStatus::kDegenerate;
  }
}

PoseCovariance LidarInertialOdometry::covariance_at(Stamp stamp) const {
  const double dt = std::max(0.0, to_seconds(stamp - corrected_at_));
  PoseCovariance covariance = corrected_;
  covariance.topLeftCorner<3, 3>() += dt * imu_noise_.gyro * imu_noise_.gyro * Mat3::Identity();
  covariance.bottomRightCorner<3, 3>() +=
      dt * dt * corrected_velocity_ +
      dt * dt * dt / 3 * imu_noise_.accel * imu_noise_.accel * Mat3::Identity();
  return covariance;
}

}  // namespace arex
