#pragma once

#include <optional>
#include <span>

#include "messages/odometry_need.h"
#include "odometry/error_state_filter.h"

namespace arex {

/// Densities of the white noise in the readings of a standing IMU.
struct WhiteNoise {
  double gyro = 0;   ///< rad/s/sqrt(Hz)
  double accel = 0;  ///< m/s^2/sqrt(Hz)
};

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

/// IMU samples further apart than this, some ten of them missing, are no standstill.
inline constexpr Stamp kMaxImuGap = kNanosecondsPerSecond / 20;

/// What keeps the samples from being a window of standstill; kNothing: they are one.
/// @param samples the newest last.
[[nodiscard]] OdometryNeed missing_for_start(std::span<const ImuSample> samples,
                                             const StaticInitialiserConfig& config);

/// Whether two neighbouring samples lie further apart than kMaxImuGap.
[[nodiscard]] bool has_gap(std::span<const ImuSample> samples);

/// Averages a window of standstill. O is placed at B, its z axis against the mean specific force,
/// B's heading as x: by definition without error. So what an accelerometer bias makes of "down" is
/// doubt about gravity in O, and tied to the doubt about the bias: gravity and bias are conditioned
/// on what was measured and on gravity's known magnitude.
///
/// The readings of a standing IMU are its bias and its noise, so the noise is measured as well: a
/// filter that took a worse IMU for a good one would follow it.
///
/// @param samples the newest last; @returns nothing while they are too few or shake or turn.
std::optional<StaticStart> start_from_standstill(std::span<const ImuSample> samples,
                                                 const Pose& X_BL,
                                                 const LidarInertialConfig& config);

/// Whether the samples, those of one scan, are those of a vehicle that still stands as in `x`: no
/// vibration, no rate, no other specific force.
bool stands_still(std::span<const ImuSample> samples, const NavigationState& x, double accel_scale,
                  const StaticInitialiserConfig& config, const WhiteNoise& noise);

/// By the Allan deviation over blocks of a few samples, all axes alike: the filters of the sensor,
/// which correlate neighbours, and its bias, which moves slowly, leave it alone.
///
/// @pre the vehicle stands; @returns zeros for too few samples.
WhiteNoise white_noise(std::span<const ImuSample> samples);

}  // namespace arex
