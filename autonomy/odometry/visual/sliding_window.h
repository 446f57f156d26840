#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "odometry/visual/marginalisation.h"
#include "odometry/visual/visual_inertial_config.h"
#include "odometry/visual/window.h"
#include "odometry/visual/window_solver.h"

namespace arex {

/// What a window begins with, and how sure it is, 1 sigma.
struct WindowStart {
  FrameState state;
  double yaw_std_rad = 1e-4;
  double tilt_std_rad = 0.02;
  double position_std_m = 1e-4;
  double velocity_std_mps = 0.01;
  double gyro_bias_std_radps = 3e-4;
  double accel_bias_std_mps2 = 0.05;
  /// Of what ties tilt and accelerometer bias together at rest, m/s^2: the force measured is
  /// gravity's; nothing in flight.
  std::optional<double> rest_force_std_mps2;
};

/// What a frame did to the window.
struct WindowUpdate {
  int tracked = 0;           ///< landmarks of known depth that the frame sees, outliers left out
  int fresh = 0;             ///< features that no earlier frame saw
  double innovation_px = 0;  ///< median distance of landmarks from where the IMU puts them
  double correction_m = 0;   ///< of the newest position against the IMU's
  bool keyframe = false;
  SolveReport solve;
  std::vector<std::int64_t> outliers;  ///< landmarks dropped: not worth following on
};

/// Visual-inertial odometry's back end: the states of the last keyframes and the newest frame, the
/// landmarks that they see, and a prior of what went before.
///
/// Source: Qin et al., VINS-Mono, T-RO 2018, with the differences that visual_inertial_odometry.h
/// names.
class SlidingWindow {
 public:
  explicit SlidingWindow(const SlidingWindowConfig& config);

  /// Begins anew with one keyframe. @param camera and how sure its states are
  void start(const WindowStart& start, const CameraState& camera, const CameraError& camera_std,
             const FeatureFrame& features);

  /// Adds a frame. @param imu since the newest, linearised at its biases
  WindowUpdate add(const FeatureFrame& features, const Preintegration& imu,
                   const FrameTiming& timing);

  /// @pre started
  [[nodiscard]] const WindowFrame& newest() const { return window_.newest(); }
  [[nodiscard]] const Window& window() const { return window_; }

 private:
  void make_room();
  void observe(const FeatureFrame& features, WindowUpdate& update);
  void triangulate_new();
  [[nodiscard]] double median_innovation_px() const;
  [[nodiscard]] bool is_keyframe(const WindowUpdate& update);
  void drop_outliers(WindowUpdate& update);
  void relinearise_imu();

  SlidingWindowConfig config_;
  double focal_px_ = 1;
  WindowNoise noise_;
  Window window_;
  std::int64_t next_number_ = 0;
  std::optional<Preintegration> dropped_imu_;  ///< of the frame that the next one replaces
  int waited_ = 0;                             ///< frames that would have been keyframes
};

/// The state that a frame's IMU leads to.
[[nodiscard]] FrameState predict(const FrameState& from, const Preintegration& imu);

}  // namespace arex
