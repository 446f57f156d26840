#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <limits>
#include <numbers>

namespace arex {

using Vec2 = Eigen::Vector2d;
using Vec3 = Eigen::Vector3d;
using Vec3f = Eigen::Vector3f;
using Vec4 = Eigen::Vector4d;
using Mat3 = Eigen::Matrix3d;
using Quat = Eigen::Quaterniond;

/// A point in time or a duration, integer nanoseconds since the start of the run.
using Stamp = std::int64_t;

inline constexpr Stamp kNanosecondsPerSecond = 1'000'000'000;
inline constexpr Stamp kNanosecondsPerTick = 1'000'000;  ///< lockstep: 1 kHz

/// Seconds as a double, for algebra and for writing; never for comparing times.
constexpr double to_seconds(Stamp stamp) {
  return static_cast<double>(stamp) / static_cast<double>(kNanosecondsPerSecond);
}
inline constexpr double kSecondsPerTick = to_seconds(kNanosecondsPerTick);

/// Longer than any run, 73 years; sums of a few still are Stamps.
inline constexpr Stamp kForever = std::numeric_limits<Stamp>::max() / 4;

/// The nearest nanosecond; of what is longer than kForever, that. The only conversion.
/// @pre seconds is a number
constexpr Stamp from_seconds(double seconds) {
  const double nanoseconds = seconds * static_cast<double>(kNanosecondsPerSecond);
  if (!(nanoseconds < static_cast<double>(kForever))) return kForever;
  if (nanoseconds < -static_cast<double>(kForever)) return -kForever;
  return static_cast<Stamp>(nanoseconds + (seconds < 0 ? -0.5 : 0.5));
}

constexpr double to_radians(double degrees) { return degrees * std::numbers::pi / 180; }

/// Standard gravity, m/s^2; the only definition of it.
inline constexpr double kGravity = 9.80665;

}  // namespace arex
