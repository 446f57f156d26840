#pragma once

#include <string>
#include <utility>
#include <vector>

#include "odometry/inertial/imu_watch.h"
#include "odometry/lidar_inertial_odometry.h"
#include "odometry/odometry_source.h"
#include "odometry/pose_history.h"

namespace arex {

/// LiDAR-inertial odometry behind the seam: scans in, placed scans out.
class LidarInertialSource : public OdometrySource {
 public:
  LidarInertialSource(const LidarInertialConfig& config, const VehicleConfig& vehicle)
      : odometry_(config, vehicle),
        X_BL_(vehicle.X_BL()),
        imu_watch_(config.health.imu, config.imu.delay_s) {}

  void add_imu(const ImuSample& imu) override { poses_.add(odometry_.add_imu(imu)); }
  std::optional<Job> add_scan(const LidarScanPtr& scan) override;
  void suggest(const Odometry& odometry) override { odometry_.suggest(odometry); }

  [[nodiscard]] const Odometry& odometry() const override { return odometry_.odometry(); }
  [[nodiscard]] OdometryNeed need() const override { return odometry_.need(); }
  std::vector<RegisteredScan> take_scans() override { return std::exchange(scans_, {}); }
  std::vector<std::string> take_faults() override { return std::exchange(faults_, {}); }

 private:
  void apply(const ScanUpdate& update);

  LidarInertialOdometry odometry_;
  Pose X_BL_;
  ImuWatch imu_watch_;
  PoseHistory poses_;
  std::vector<RegisteredScan> scans_;
  std::vector<std::string> faults_;
};

}  // namespace arex
