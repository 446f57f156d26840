#include "odometry/visual/visual_inertial_odometry.h"

#include <algorithm>
#include <utility>

namespace arex {
namespace {

/// Pictures of nothing, black or white all over, are alike and repeat nothing.
bool repeats(const StereoImage& image, const StereoImage& before) {
  if (image.left != before.left || image.left.empty()) return false;
  const auto [least, most] = std::minmax_element(image.left.begin(), image.left.end());
  return *least < *most;
}

}  // namespace

VisualInertialOdometry::VisualInertialOdometry(const VisualInertialConfig& config, const Pose& X_BC,
                                               std::uint64_t seed)
    : health_(config.health),
      imu_delay_s_(config.imu.delay_s),
      tracker_(config.tracker, seed),
      estimator_(config, X_BC) {
  update_.need = OdometryNeed::kImages;
}

const Odometry& VisualInertialOdometry::add_imu(const ImuSample& imu) {
  newest_ = imu;
  unhanded_.push_back(imu);
  predictor_.add(imu);
  publish();
  return odometry_;
}

std::optional<ImageJob> VisualInertialOdometry::prepare(const StereoImagePtr& images) {
  if (handed_ && repeats(*images, *handed_)) return std::nullopt;
  handed_ = images;
  return ImageJob{images, std::exchange(unhanded_, {})};
}

VisualUpdate VisualInertialOdometry::correct(const ImageJob& job) {
  estimator_.add_imu(job.imu);
  const Stamp stamp = job.images->time_ns;
  const FeatureFrame features =
      tracker_.track(*job.images, estimator_.camera_turn(tracked_stamp_, stamp));
  tracked_stamp_ = stamp;
  VisualUpdate update = estimator_.add(features);
  tracker_.forget(update.window.outliers);
  return update;
}

VisualUpdate VisualInertialOdometry::correct(const FeatureFrame& features,
                                             const std::vector<ImuSample>& imu) {
  estimator_.add_imu(imu);
  return estimator_.add(features);
}

void VisualInertialOdometry::apply(const VisualUpdate& update) {
  update_ = update;
  odometry_.correction_stamp = update.correction_stamp;
  odometry_.status = update.status;
  silence_.end_interval();
  if (update.status == OdometryStatus::kInitialising) return;
  predictor_.anchor(update.stamp, update.state, update.accel_scale, {});
  publish();
}

OdometryNeed VisualInertialOdometry::need() const {
  if (odometry_.status == OdometryStatus::kOk) return OdometryNeed::kNothing;
  // Images without features are no silence of the camera; late ones, which lack nothing else, are.
  const bool silent = to_seconds(newest_.stamp - update_.stamp) > health_.degenerate_silence_s;
  return silent || update_.need == OdometryNeed::kNothing ? OdometryNeed::kImages : update_.need;
}

void VisualInertialOdometry::publish() {
  odometry_.stamp = newest_.stamp;
  odometry_.status = update_.status;
  if (update_.status == OdometryStatus::kInitialising) return;
  // What the IMU stamps now, the camera stamps so much later.
  const Stamp camera_ahead = from_seconds(imu_delay_s_ - update_.state.t_d);
  const std::optional<NavigationState> state = predictor_.at(odometry_.stamp + camera_ahead);
  if (!state) return;
  odometry_.X_OB = state->X_OB();
  odometry_.v_OB = state->v_OB;
  odometry_.w_OB_B = state->rate(newest_.gyro_radps);
  odometry_.covariance = covariance_at(odometry_.stamp + camera_ahead);
  // The images may have stopped, too.
  const double silence_s = to_seconds(odometry_.stamp + camera_ahead - odometry_.correction_stamp);
  const bool silent = silence_.wait(silence_s);
  if (silence_s > health_.lost_silence_s) {
    odometry_.status = OdometryStatus::kLost;
  } else if (silent && odometry_.status == OdometryStatus::kOk) {
    odometry_.status = OdometryStatus::kDegenerate;
  }
}

Eigen::Matrix<double, 6, 6> VisualInertialOdometry::covariance_at(Stamp stamp) const {
  const double dt = std::max(0.0, to_seconds(stamp - update_.stamp));
  const WhiteNoise& imu = update_.imu_noise;
  Eigen::Matrix<double, 6, 6> covariance = update_.covariance.topLeftCorner<6, 6>();
  covariance.topLeftCorner<3, 3>() += dt * imu.gyro * imu.gyro * Mat3::Identity();
  covariance.bottomRightCorner<3, 3>() +=
      dt * dt * update_.covariance.block<3, 3>(kVelocity, kVelocity) +
      dt * dt * dt / 3 * imu.accel * imu.accel * Mat3::Identity();
  return covariance;
}

}  // namespace arex
