#pragma once

#include "math/so3.h"
#include "math/types.h"

namespace arex {

/// A rigid transform X_AB: the pose of frame B in frame A. Inner letters cancel: X_AC = X_AB *
/// X_BC.
struct Pose {
  Mat3 R = Mat3::Identity();  ///< R_AB: columns are B's axes in A
  Vec3 p = Vec3::Zero();      ///< p_AB: B's origin in A, m

  Pose operator*(const Pose& other) const { return {R * other.R, R * other.p + p}; }
  /// A point given in B, in A.
  Vec3 operator*(const Vec3& point) const { return R * point + p; }
  [[nodiscard]] Pose inverse() const { return {R.transpose(), -(R.transpose() * p)}; }
  [[nodiscard]] Quat quaternion() const { return Quat(R).normalized(); }
};

/// The pose a fraction of the way from `from` to `to`: constant body rate, straight line.
inline Pose interpolate(const Pose& from, const Pose& to, double fraction) {
  return {from.R * so3::Exp(fraction * so3::Log(from.R.transpose() * to.R)),
          from.p + fraction * (to.p - from.p)};
}

}  // namespace arex
