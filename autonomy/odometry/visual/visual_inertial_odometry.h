#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "messages/estimates.h"
#include "messages/stereo_image.h"
#include "odometry/inertial/imu_predictor.h"
#include "odometry/inertial/silence.h"
#include "odometry/visual/feature_tracker.h"
#include "odometry/visual/visual_estimator.h"
#include "odometry/visual/visual_inertial_config.h"

namespace arex {

/// An exposure, and the IMU's samples since the one before.
struct ImageJob {
  StereoImagePtr images;
  std::vector<ImuSample> imu;
};

/// Tightly coupled visual-inertial odometry on a stereo pair: keyframes in a sliding window,
/// corrected by exposures at the camera's rate, propagated by every IMU sample at 200 Hz.
///
/// Frames: O gravity-aligned, origin at start-up; B body = IMU; C left eye. X_BC and the camera's
/// clock are estimated from what is configured.
/// Source: Qin et al., VINS-Mono, T-RO 2018; AREX paper, eqs. (1), (5)-(9). Departures from it: it
/// starts standing, by its two eyes, not moving; its prior is a square root; a landmark that has
/// gone into the prior starts afresh, so that no sight is counted twice; the prior holds position
/// and yaw, nothing is put back after a solution.
///
/// An exposure is handled in three steps, as LidarInertialOdometry handles scans.
class VisualInertialOdometry {
 public:
  /// @param seed of the outlier test's random stream
  VisualInertialOdometry(const VisualInertialConfig& config, const Pose& X_BC, std::uint64_t seed);

  /// Propagates by one sample and returns the estimate at its stamp.
  /// @pre imu.stamp is later than every stamp seen so far.
  const Odometry& add_imu(const ImuSample& imu);

  /// Hands the exposure and the IMU samples since the last call to a job. @return nothing for the
  /// same picture once more: a camera that hangs exposes nothing, and no scene stands as still.
  [[nodiscard]] std::optional<ImageJob> prepare(const StereoImagePtr& images);
  /// Front and back end; heavy, any thread, beside add_imu().
  [[nodiscard]] VisualUpdate correct(const ImageJob& job);
  /// The back end alone, on features followed elsewhere. @param imu samples since the last call
  [[nodiscard]] VisualUpdate correct(const FeatureFrame& features,
                                     const std::vector<ImuSample>& imu);
  /// Anchors the output at the update and integrates the later samples again.
  void apply(const VisualUpdate& update);

  /// The newest estimate; kInitialising before the first exposure at rest.
  [[nodiscard]] const Odometry& odometry() const { return odometry_; }
  /// What keeps it from being ok; no image has come yet, as long as nothing else is known.
  [[nodiscard]] OdometryNeed need() const;
  /// Of correct(): belongs to its thread.
  [[nodiscard]] const FeatureTracker& tracker() const { return tracker_; }
  [[nodiscard]] const VisualEstimator& estimator() const { return estimator_; }

 private:
  void publish();
  [[nodiscard]] Eigen::Matrix<double, 6, 6> covariance_at(Stamp stamp) const;

  VisualHealthConfig health_;
  Silence silence_{health_.degenerate_silence_s};
  double imu_delay_s_;
  FeatureTracker tracker_;
  VisualEstimator estimator_;
  Stamp tracked_stamp_ = 0;  ///< of the newest exposure that was followed

  ImuPredictor predictor_;
  std::vector<ImuSample> unhanded_;  ///< samples that no job has got yet
  StereoImagePtr handed_;            ///< the newest exposure that a job has got
  ImuSample newest_;
  VisualUpdate update_;  ///< the newest applied
  Odometry odometry_;
};

}  // namespace arex
