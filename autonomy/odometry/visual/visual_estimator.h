#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "math/lasting.h"
#include "messages/estimates.h"
#include "messages/odometry_need.h"
#include "odometry/inertial/imu_buffer.h"
#include "odometry/inertial/standstill.h"
#include "odometry/visual/sliding_window.h"
#include "odometry/visual/visual_inertial_config.h"

namespace arex {

/// What one exposure made of the estimate.
struct VisualUpdate {
  Stamp stamp = 0;             ///< of the exposure, by the camera's clock
  Stamp correction_stamp = 0;  ///< of the newest that corrected the estimate
  OdometryStatus status = OdometryStatus::kInitialising;
  OdometryNeed need = OdometryNeed::kNothing;
  NavigationState state;  ///< its t_d is the camera's: see CameraState
  double accel_scale = 1;
  /// Of [rotation, position, velocity, b_g, b_a].
  Eigen::Matrix<double, kFrameDim, kFrameDim> covariance =
      Eigen::Matrix<double, kFrameDim, kFrameDim>::Zero();
  WhiteNoise imu_noise;
  WindowUpdate window;
  CameraState camera;
  std::vector<std::string> faults;  ///< what has gone wrong, or was found to be, for events
};

/// From features and IMU to states: starts standing, keeps the sliding window, watches over it, and
/// begins anew in flight after it was lost.
class VisualEstimator {
 public:
  VisualEstimator(const VisualInertialConfig& config, const Pose& X_BC);

  void add_imu(std::span<const ImuSample> samples) { imu_.add(samples); }

  /// Turn of the left eye between two exposures by the gyro: takes a ray of the later one to where
  /// the earlier had it.
  [[nodiscard]] Mat3 camera_turn(Stamp from, Stamp to) const;

  /// Takes in an exposure; the IMU's samples up to it have been added.
  VisualUpdate add(const FeatureFrame& features);

  /// 1 sigma of a feature, with which states, landmarks and their numbers are found.
  [[nodiscard]] const SlidingWindow& window() const { return window_; }

 private:
  enum class Phase { kStanding, kTracking, kLost };

  void try_start(const FeatureFrame& features, VisualUpdate& update);
  void track(const FeatureFrame& features, VisualUpdate& update);
  void try_restart(const FeatureFrame& features, VisualUpdate& update);
  /// Why the window is not to be believed after `update`; nothing: it is.
  [[nodiscard]] std::optional<std::string> failure(const VisualUpdate& update) const;
  void judge(VisualUpdate& update);
  void lose(const std::string& why, VisualUpdate& update);
  void tell_once(const std::string& what, bool& told, VisualUpdate& update) const;
  void watch_camera(VisualUpdate& update);
  [[nodiscard]] Preintegration integrate(Stamp to, double t_d) const;
  /// The body's rate at an exposure, rad/s.
  [[nodiscard]] Vec3 rate_at(Stamp stamp, double t_d) const;
  void remember(const FrameState& state, Stamp stamp, double t_d);
  [[nodiscard]] CameraError camera_std() const;

  VisualInertialConfig config_;
  ImuNoiseConfig configured_imu_;
  CameraState nominal_;  ///< as configured
  ImuBuffer imu_;
  SlidingWindow window_;
  Phase phase_ = Phase::kStanding;
  double accel_scale_ = 1;

  // The newest state, by the window, or by the IMU alone while that is lost.
  FrameState state_;
  Eigen::Matrix<double, kFrameDim, kFrameDim> covariance_ =
      Eigen::Matrix<double, kFrameDim, kFrameDim>::Zero();
  CameraState camera_;
  Stamp stamp_ = 0;
  double placed_by_ = 0;  ///< t_d of the newest state

  Stamp correction_stamp_ = 0;
  int large_in_a_row_ = 0;
  int confirmations_left_ = 0;
  Lasting clock_off_, mount_off_;
  bool few_told_ = false, large_told_ = false, clock_told_ = false, mount_told_ = false;
};

}  // namespace arex
