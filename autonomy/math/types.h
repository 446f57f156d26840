#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>

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
/// The nearest nanosecond.
constexpr Stamp from_seconds(double seconds) {
  return static_cast<Stamp>(seconds * static_cast<double>(kNanosecondsPerSecond) +
                            (seconds < 0 ? -0.5 : 0.5));
}

/// Standard gravity, m/s^2; the only definition of it.
inline constexpr double kGravity = 9.80665;

}  // namespace arex
