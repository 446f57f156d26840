#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <vector>

#include "odometry/visual/factors.h"
#include "odometry/visual/window_state.h"

namespace arex {

/// Where the blocks of a window's error stand: poses first, then the camera, then velocities and
/// biases, so that what landmarks touch is one block.
struct WindowLayout {
  int frames = 0;

  [[nodiscard]] int pose(int frame) const { return kPoseDim * frame; }
  [[nodiscard]] int camera() const { return kPoseDim * frames; }
  [[nodiscard]] int motion(int frame) const { return visual_size() + kMotionDim * frame; }
  [[nodiscard]] int visual_size() const { return kPoseDim * frames + kCameraDim; }
  [[nodiscard]] int size() const { return visual_size() + kMotionDim * frames; }
  /// Where component i of a frame's error stands.
  [[nodiscard]] int at(int frame, int i) const {
    return i < kPoseDim ? pose(frame) + i : motion(frame) + i - kPoseDim;
  }
};

/// Rows of a linear least-squares problem: |r + J d|^2.
struct LinearRows {
  Eigen::MatrixXd J;
  Eigen::VectorXd r;
};

/// What is known of the window's first frames and of the camera beside their factors: rows, in
/// units of 1 sigma, linearised where the states were then. Kept as a square root of the
/// information, which has twice the digits of the information itself.
struct WindowPrior {
  std::vector<FrameState> frames;  ///< the first estimates, of the window's first frames
  CameraState camera;
  LinearRows rows;  ///< columns: WindowLayout of these frames
};

struct WindowFrame {
  std::int64_t number = 0;
  Stamp stamp = 0;     ///< by the camera's clock
  FrameTiming timing;  ///< the IMU's stamp is stamp + timing.placed_by
  bool keyframe = false;
  FrameState state;
  std::optional<Preintegration> imu;  ///< since the frame before
};

struct Window {
  std::vector<WindowFrame> frames;  ///< in order of time
  CameraState camera;
  std::map<std::int64_t, Landmark> landmarks;  ///< by id: sums are taken in this order
  WindowPrior prior;

  [[nodiscard]] WindowLayout layout() const { return {static_cast<int>(frames.size())}; }
  [[nodiscard]] const WindowFrame& newest() const { return frames.back(); }
  /// Place of the frame of that number. @pre it is there
  [[nodiscard]] int slot(std::int64_t number) const {
    int i = 0;
    while (frames[static_cast<std::size_t>(i)].number != number) ++i;
    return i;
  }
};

/// How its measurements are weighed.
struct WindowNoise {
  double ray_std = 1.0 / 423;         ///< of a feature, in normalised coordinates
  double disparity_std = 0.15 / 423;  ///< of what the eyes differ by, likewise
  double huber_sigma = 1.5;
  double baseline_m = 0.05;
  int least_images = 3;
  bool first_estimates = true;

  /// Whether the landmark counts.
  [[nodiscard]] bool uses(const Landmark& landmark) const {
    return landmark.state.inverse_depth > 0 && landmark.seen.size() >= 2 &&
           landmark.images() >= least_images;
  }
};

}  // namespace arex
