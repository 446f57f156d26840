#pragma once

#include <string>
#include <utility>
#include <vector>

#include "odometry/odometry_source.h"
#include "odometry/visual/visual_inertial_odometry.h"

namespace arex {

/// Visual-inertial odometry behind the seam: images in. The maps' scans are placed by its poses.
class VisualInertialSource : public OdometrySource {
 public:
  VisualInertialSource(const VisualInertialConfig& config, const Pose& X_BC, std::uint64_t seed)
      : odometry_(config, X_BC, seed), report_features_(config.report_features) {}

  void add_imu(const ImuSample& imu) override { odometry_.add_imu(imu); }
  std::optional<Job> add_images(const StereoImagePtr& images) override;

  [[nodiscard]] const Odometry& odometry() const override { return odometry_.odometry(); }
  [[nodiscard]] OdometryNeed need() const override { return odometry_.need(); }
  [[nodiscard]] bool places_scans() const override { return false; }
  std::vector<std::string> take_faults() override { return std::exchange(faults_, {}); }
  [[nodiscard]] std::optional<VisualTally> visual_tally() const override { return tally_; }
  std::vector<FeatureSight> take_features() override { return std::exchange(features_, {}); }

 private:
  void apply(const VisualUpdate& update, std::vector<FeatureSight> features);

  VisualInertialOdometry odometry_;
  bool report_features_;
  std::vector<std::string> faults_;
  std::vector<FeatureSight> features_;  ///< of the newest exposure
  VisualTally tally_;
};

}  // namespace arex
