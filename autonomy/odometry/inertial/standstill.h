#pragma once

#include <optional>
#include <span>

#include "messages/odometry_need.h"
#include "odometry/inertial/imu_buffer.h"
#include "odometry/inertial/inertial_config.h"
#include "odometry/inertial/navigation_state.h"

namespace arex {

/// Densities of the white noise in the readings of an IMU.
struct WhiteNoise {
  double gyro = 0;   ///< rad/s/sqrt(Hz)
  double accel = 0;  ///< m/s^2/sqrt(Hz)
};

/// Mean and scatter of IMU readings.
struct ImuMoments {
  Vec3 gyro_mean = Vec3::Zero();   ///< rad/s
  Vec3 accel_mean = Vec3::Zero();  ///< m/s^2
  double gyro_std = 0;             ///< of one sample, the largest axis
  double accel_std = 0;
};
[[nodiscard]] ImuMoments moments(std::span<const ImuSample> samples);

/// A window of standstill.
struct Standstill {
  Stamp stamp = 0;          ///< of its last sample
  std::size_t samples = 0;  ///< averaged
  ImuMoments moments;
  WhiteNoise white_noise;
};

/// What keeps the samples from being a window of standstill; kNothing: they are one.
/// @param samples the newest last.
[[nodiscard]] OdometryNeed missing_for_start(std::span<const ImuSample> samples,
                                             const StaticInitialiserConfig& config);

/// Averages the newest window of standstill; nothing while the samples are none.
/// @param samples the newest last.
[[nodiscard]] std::optional<Standstill> measure_standstill(std::span<const ImuSample> samples,
                                                           const StaticInitialiserConfig& config);

/// Roll and pitch that turn the specific force f_B to z; yaw zero.
[[nodiscard]] Mat3 level(const Vec3& f_B);

/// Whether the samples, those between two corrections, are those of a vehicle that still stands as
/// in `x`: no vibration, no rate, no other specific force.
[[nodiscard]] bool stands_still(std::span<const ImuSample> samples, const NavigationState& x,
                                double accel_scale, const StaticInitialiserConfig& config,
                                const WhiteNoise& noise);

/// By the second differences of the means of blocks of a few samples (the Hadamard deviation), all
/// axes alike: the filters of the sensor, which correlate neighbours, and its bias, which moves
/// slowly, leave it alone; so does a steady change of rate or force, that is, most of how a vehicle
/// flies. In flight it is the density of what shakes the IMU, vibration above all.
///
/// @returns zeros for too few samples.
[[nodiscard]] WhiteNoise white_noise(std::span<const ImuSample> samples);

/// The configured noise for an IMU with this white noise. Where it is noisier than configured it is
/// of a worse grade, and its bias, which standing for a second cannot tell, walks in proportion.
[[nodiscard]] ImuNoiseConfig scaled_to_measured(ImuNoiseConfig imu, const WhiteNoise& measured);

/// The same for an accelerometer that is shaken so now: its bias is none the worse for it.
[[nodiscard]] ImuNoiseConfig shaken_by(ImuNoiseConfig imu, const WhiteNoise& measured);

/// What is shaken stays where it is: its spectrum ends at some frequency, and its integral is
/// bounded. 1 sigma, each axis, of the integral of readings of such a density: of density D above f
/// it scatters by D / (2 pi sqrt(f)).
[[nodiscard]] double scatter_of_integral(double density);

/// 1 sigma, each axis, of the angle by which an IMU is shaken so against the vehicle, rad. It does
/// not add up: the gyro's integral follows the shaking, and the vehicle stays where it is. So it is
/// noise of whatever compares the two, and not of the motion; taken for the latter, every scan
/// would turn the attitude as it likes, which is how a map gets tilted at lift-off.
///
/// @param mean_over_s of the mean of the angle over so long, as a scan sees it; 0: at an instant
[[nodiscard]] double shaken_angle(const WhiteNoise& measured, double mean_over_s = 0);

/// The same of the accelerometer's integral, m/s.
[[nodiscard]] double shaken_speed(const WhiteNoise& measured);

}  // namespace arex
