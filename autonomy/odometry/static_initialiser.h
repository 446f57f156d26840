#pragma once

#include <optional>
#include <span>

#include "odometry/error_state_filter.h"
#include "odometry/inertial/standstill.h"

namespace arex {

/// What standing still tells: where down is, what the gyro reads at rest, how the accelerometer is
/// scaled.
struct StaticStart {
  Stamp stamp = 0;  ///< of the last sample used
  NavigationState state;
  ErrorMatrix covariance = ErrorMatrix::Zero();
  double accel_scale = 1;  ///< G / |mean static a|
  WhiteNoise white_noise;
};

/// How well the start defines O, rad, m and m/s, 1 sigma: only keeps the filter's algebra regular.
inline constexpr double kDefinedStd = 1e-5;

/// Averages a window of standstill. O is placed at B, its z axis against the mean specific force,
/// B's heading as x: by definition without error. So what an accelerometer bias makes of "down" is
/// an error of gravity in O, correlated with that of the bias: gravity and bias are conditioned
/// on what was measured and on gravity's known magnitude.
///
/// The readings of a standing IMU are its bias and its noise, so the noise is measured as well: a
/// filter that took a worse IMU for a good one would follow it.
///
/// @param samples the newest last; @returns nothing while they are too few or shake or turn.
std::optional<StaticStart> start_from_standstill(std::span<const ImuSample> samples,
                                                 const Pose& X_BL,
                                                 const LidarInertialConfig& config);

}  // namespace arex
