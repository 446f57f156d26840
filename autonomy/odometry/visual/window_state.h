#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "math/pose.h"
#include "math/so3.h"
#include "math/types.h"
#include "messages/stereo_image.h"
#include "odometry/inertial/navigation_state.h"

/// What the visual-inertial window estimates. Frames: O odometry origin, B body = IMU, C left eye.
namespace arex {

/// A corner followed from image to image, in the left eye's normalised coordinates (x/z, y/z).
struct TrackedFeature {
  std::int64_t id = 0;
  Vec2 left = Vec2::Zero();
  std::optional<Vec2> right;  ///< in the right eye, where that was read and it was found there
};

/// What the front end makes of one exposure, in order of id.
struct FeatureFrame {
  Stamp stamp = 0;                                ///< by the camera's clock
  double f_px = StereoCamera{}.f_px;              ///< of the eyes: what a pixel is
  double baseline_m = StereoCamera{}.baseline_m;  ///< from the left eye to the right
  std::vector<TrackedFeature> features;
};

/// State of one frame. Error, 15x1: [rotation, position, velocity, b_g, b_a], the first blocks of
/// NavigationState's; rotation on the right.
struct FrameState {
  Mat3 R_OB = Mat3::Identity();
  Vec3 p_OB = Vec3::Zero();
  Vec3 v_OB = Vec3::Zero();  ///< m/s, in O
  Vec3 b_g = Vec3::Zero();   ///< rad/s
  Vec3 b_a = Vec3::Zero();   ///< m/s^2
};
inline constexpr int kPoseDim = 6;    ///< of a frame's error: rotation and position
inline constexpr int kMotionDim = 9;  ///< velocity and biases
inline constexpr int kFrameDim = kPoseDim + kMotionDim;
using FrameError = Eigen::Matrix<double, kFrameDim, 1>;

inline FrameState retract(const FrameState& x, const FrameError& d) {
  return {x.R_OB * so3::Exp(d.segment<3>(kRotation)), x.p_OB + d.segment<3>(kPosition),
          x.v_OB + d.segment<3>(kVelocity), x.b_g + d.segment<3>(kGyroBias),
          x.b_a + d.segment<3>(kAccelBias)};
}

inline FrameError local(const FrameState& x, const FrameState& y) {
  FrameError d;
  d << so3::Log(x.R_OB.transpose() * y.R_OB), y.p_OB - x.p_OB, y.v_OB - x.v_OB, y.b_g - x.b_g,
      y.b_a - x.b_a;
  return d;
}

/// The camera's mounting and clock. Error, 7x1: [rotation of C, its position in B, t_d].
struct CameraState {
  Pose X_BC;
  double t_d = 0;  ///< s: what the camera stamps t, the IMU stamps t + t_d
};
inline constexpr int kCameraDim = 7;
inline constexpr int kCameraTime = 6;  ///< index of t_d
using CameraError = Eigen::Matrix<double, kCameraDim, 1>;

inline CameraState retract(const CameraState& x, const CameraError& d) {
  return {{x.X_BC.R * so3::Exp(d.segment<3>(0)), x.X_BC.p + d.segment<3>(3)},
          x.t_d + d[kCameraTime]};
}

inline CameraError local(const CameraState& x, const CameraState& y) {
  CameraError d;
  d << so3::Log(x.X_BC.R.transpose() * y.X_BC.R), y.X_BC.p - x.X_BC.p, y.t_d - x.t_d;
  return d;
}

/// Where a landmark was seen in one frame.
struct Observation {
  std::int64_t frame = 0;    ///< its number
  Vec2 left = Vec2::Zero();  ///< normalised coordinates
  std::optional<Vec2> right;
};

/// A point fixed in O, as the left eye of the frame that saw it first has it. Its ray is estimated,
/// too: a sight that were taken as exact there would lend its noise to all others. Error, 3x1:
/// [ray, inverse depth].
struct LandmarkState {
  Vec2 ray = Vec2::Zero();   ///< normalised coordinates
  double inverse_depth = 0;  ///< 1/m, along the optical axis; 0: not known yet
};
inline constexpr int kLandmarkDim = 3;

struct Landmark {
  std::int64_t id = 0;
  std::vector<Observation> seen;  ///< in order of frames, the anchor first
  LandmarkState state;

  /// Images of either eye.
  [[nodiscard]] int images() const {
    int n = 0;
    for (const Observation& o : seen) n += o.right ? 2 : 1;
    return n;
  }
};

}  // namespace arex
