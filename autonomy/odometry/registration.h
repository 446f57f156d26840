#pragma once

#include <vector>

#include "odometry/error_state_filter.h"
#include "odometry/map_drift.h"
#include "odometry/surfel_map.h"
#include "odometry/undistortion.h"

/// The iterated update of the filter by one undistorted scan: point to plane against the map, the
/// surfels' normals taken for what they are, measured with an error.
namespace arex {

/// How one scan met the map.
struct RegistrationReport {
  int points = 0;   ///< asked of the map
  int matched = 0;  ///< had a surfel and passed the gate, at the last iterate
  int iterations = 0;
  double residual_rms_sigma = 0;  ///< of the matched, in sigma
  bool accepted = false;          ///< the filter was corrected
  double innovation = 0;          ///< RMS of the pose's correction, in sigma of the prediction
  /// Standard deviation that this scan alone leaves, the worst direction first.
  Vec3 position_std_m = Vec3::Zero();
  Vec3 rotation_std_rad = Vec3::Zero();
  Vec3 worst_position_axis_O = Vec3::UnitZ();
  Vec3 worst_rotation_axis_B = Vec3::UnitZ();
  /// Of the corrected pose's error, in B and O: what came of this scan's noise, and what the prior
  /// brought. Together the filter's; nil if it was not corrected.
  PoseCovariance covariance = PoseCovariance::Zero();
  PoseCovariance carried = PoseCovariance::Zero();
  /// Where the LiDAR says that the vehicle is, X_OB: the filter's state but for the angle by which
  /// the IMU is shaken against the LiDAR.
  Pose X_OB;
  std::vector<int> born;  ///< of the surfels of the matched points, at the last iterate
};

/// One point per cell of a grid in L, the first in firing order; of these, evenly spaced ones,
/// at most `max_points`.
std::vector<ScanPoint> voxel_downsample(const std::vector<ScanPoint>& points, double voxel_m,
                                        int max_points);

/// Residual r = n . (p_O - mean), its derivative by [R_OB, p_OB, R_BL, p_BL] and its variance.
struct PlaneResidual {
  double r = 0;
  PoseInformation::Vector h = PoseInformation::Vector::Zero();
  double variance_m2 = 0;
};
PlaneResidual plane_residual(const NavigationState& x, const ScanPoint& point,
                             const SurfelMatch& match, const LidarNoiseConfig& noise);

/// Corrects `filter` with the points if enough of them match.
/// @param shaken_rad 1 sigma, each axis, of the angle by which the IMU is shaken against the LiDAR
RegistrationReport register_scan(const std::vector<ScanPoint>& points, const SurfelMap& map,
                                 const LidarInertialConfig& config, double shaken_rad,
                                 ErrorStateFilter& filter);

}  // namespace arex
