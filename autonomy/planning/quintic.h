#pragma once

#include <array>

#include "planning/uniform_bspline.h"

namespace arex {

/// The minimum-jerk motion between two states: a quintic per axis over [0, T].
class Quintic {
 public:
  Quintic(const MotionState& from, const MotionState& to, double duration_s)
      : from_(from), duration_s_(duration_s) {
    const double T = duration_s, T2 = T * T, T3 = T2 * T;
    const Vec3 dp = to.p - from.p - from.v * T - from.a * (T2 / 2);
    const Vec3 dv = to.v - from.v - from.a * T;
    const Vec3 da = to.a - from.a;
    c3_ = (10 * dp - 4 * T * dv + T2 / 2 * da) / T3;
    c4_ = (-15 * dp + 7 * T * dv - T2 * da) / (T3 * T);
    c5_ = (6 * dp - 3 * T * dv + T2 / 2 * da) / (T3 * T2);
  }
  [[nodiscard]] double duration_s() const { return duration_s_; }
  [[nodiscard]] Vec3 position(double t) const {
    const double t3 = t * t * t;
    return from_.p + from_.v * t + from_.a * (t * t / 2) + c3_ * t3 + c4_ * (t3 * t) +
           c5_ * (t3 * t * t);
  }

 private:
  MotionState from_;
  double duration_s_;
  Vec3 c3_, c4_, c5_;
};

}  // namespace arex
