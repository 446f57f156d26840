#pragma once

#include <utility>
#include <vector>

#include "messages/vehicle.h"
#include "odometry/odometry_source.h"
#include "odometry/pose_history.h"
#include "odometry/scan_placement.h"

namespace arex {

/// The pose of an external tracking system, taken as it is: the oracle, for ablations.
class MocapSource : public OdometrySource {
 public:
  explicit MocapSource(const VehicleConfig& vehicle) : X_BL_(vehicle.X_BL()) {}

  void add_imu(const ImuSample& imu) override { odometry_.w_OB_B = imu.gyro_radps; }
  std::optional<Job> add_scan(const LidarScanPtr& scan) override;
  void add_mocap(const MocapSample& mocap) override;

  [[nodiscard]] const Odometry& odometry() const override { return odometry_; }
  [[nodiscard]] OdometryNeed need() const override { return OdometryNeed::kMocap; }
  std::vector<RegisteredScan> take_scans() override { return std::exchange(scans_, {}); }

 private:
  Pose X_BL_;
  Odometry odometry_;
  PoseHistory poses_;
  std::vector<RegisteredScan> scans_;
};

}  // namespace arex
