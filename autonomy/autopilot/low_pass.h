#pragma once

#include <cmath>
#include <numbers>

#include "math/types.h"

namespace arex {

/// Second-order Butterworth low-pass of a vector signal, bilinear transform, direct form II.
/// Source: Oppenheim and Schafer, Discrete-Time Signal Processing, 7.1.
class LowPass {
 public:
  /// @pre 0 < cutoff_hz < sample_hz / 2.
  LowPass(double sample_hz, double cutoff_hz) {
    const double k = std::tan(std::numbers::pi * cutoff_hz / sample_hz);
    const double scale = 1 / (1 + std::numbers::sqrt2 * k + k * k);
    b_ = k * k * scale;
    a1_ = 2 * (k * k - 1) * scale;
    a2_ = (1 - std::numbers::sqrt2 * k + k * k) * scale;
  }

  Vec3 update(const Vec3& input) {
    const Vec3 state = input - a1_ * delay1_ - a2_ * delay2_;
    const Vec3 output = b_ * (state + 2 * delay1_ + delay2_);
    delay2_ = delay1_;
    delay1_ = state;
    return output;
  }

  /// The state in which a constant input gives itself.
  void reset(const Vec3& value) { delay1_ = delay2_ = value / (1 + a1_ + a2_); }

 private:
  double b_ = 0, a1_ = 0, a2_ = 0;
  Vec3 delay1_ = Vec3::Zero(), delay2_ = Vec3::Zero();
};

}  // namespace arex
