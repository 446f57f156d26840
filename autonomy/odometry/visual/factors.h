#pragma once

#include <Eigen/Core>

#include "odometry/visual/preintegration.h"
#include "odometry/visual/window_state.h"

/// Residuals of the window and their derivatives, apart from each other so that the latter may be
/// taken at another state (first-estimate Jacobians).
namespace arex {

/// Distance of what has no measurable disparity, m: at 200 m the pair's is a tenth of a pixel.
inline constexpr double kBackdrop = 200;

using ImuResidual = Eigen::Matrix<double, kFrameDim, 1>;
using ImuJacobian = Eigen::Matrix<double, kFrameDim, kFrameDim>;

/// [rotation, velocity, position, change of b_g, change of b_a], not whitened.
[[nodiscard]] ImuResidual imu_residual(const Preintegration& imu, const FrameState& from,
                                       const FrameState& to);
struct ImuJacobians {
  ImuJacobian from, to;
};
[[nodiscard]] ImuJacobians imu_jacobians(const Preintegration& imu, const FrameState& from,
                                         const FrameState& to);
/// Whitens the residual: with it, each component has unit variance. Lower triangular.
[[nodiscard]] ImuJacobian imu_whitening(const Preintegration& imu);

/// When a frame was exposed, as far as t_d tells: another t_d than the frame was placed by moves it
/// along the body's motion. That comes from the IMU and the state, not from how the features moved:
/// their noise would be in the residual, too, and drive t_d.
struct FrameTiming {
  double placed_by = 0;      ///< t_d
  Vec3 rate = Vec3::Zero();  ///< of the body, rad/s, in B
};

/// The body when a frame was exposed.
struct Exposure {
  Exposure(const FrameState& x, const FrameTiming& timing, double t_d);

  Mat3 R_OB;
  Vec3 p_OB;
  Vec3 v_OB, rate;  ///< how it moves with t_d
  Mat3 turn;        ///< takes an error of the placed attitude to one of this
};

/// One eye's view of a landmark.
struct Sight {
  const Observation& seen;
  bool own = false;  ///< by the frame whose ray the landmark lies on
  bool right = false;
  double baseline_m = 0;
};

/// Normalised coordinates predicted minus seen; nothing for what would lie behind the camera.
[[nodiscard]] std::optional<Vec2> sight_residual(const Sight& sight, const Exposure& anchor,
                                                 const Exposure& seen, const CameraState& camera,
                                                 const LandmarkState& landmark);
struct SightJacobians {
  Eigen::Matrix<double, 2, kPoseDim> anchor, seen;  ///< by the placed poses
  Eigen::Matrix<double, 2, kCameraDim> camera;
  Eigen::Matrix<double, 2, kLandmarkDim> landmark;
};
/// Of the anchor's own sights, the landmark's part alone is set: on the rest they do not hang.
/// @pre sight_residual() has a value there
[[nodiscard]] SightJacobians sight_jacobians(const Sight& sight, const Exposure& anchor,
                                             const Exposure& seen, const CameraState& camera,
                                             const LandmarkState& landmark);

/// The inverse depth that brings a landmark's rays together best, 1/m, by linear least squares;
/// that of kBackdrop where they meet behind it, infinity included, by no more than noise; nothing
/// where they do not tell or contradict each other.
/// @param frames of each observation, in order
[[nodiscard]] std::optional<double> triangulate(const Landmark& landmark,
                                                const std::vector<const FrameState*>& frames,
                                                const CameraState& camera, double baseline_m);

}  // namespace arex
