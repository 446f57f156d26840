#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>

#include "math/types.h"

namespace arex {

/// Tells when the readings of a sensor jump about more than what it measures can: by the root mean
/// square of the steps from one reading to the next, over a second or so.
class NoiseWatch {
 public:
  /// @param limit of the steps' RMS, in the reading's unit
  NoiseWatch(std::string_view name, double limit) : name_(name), limit_(limit) {}

  void add(const Vec3& value) {
    // One jump, as when a stuck sensor comes back, is no noise: it counts for little at first.
    constexpr double kMemory = 50;  // readings
    constexpr double kOutlier = 25, kLeast = 1e-9;
    const double step = (value - last_).squaredNorm();
    if (squares_ >= 0) {
      squares_ += (std::min(step, kOutlier * std::max(squares_, kLeast)) - squares_) / kMemory;
    }
    squares_ = std::max(squares_, 0.0);
    last_ = value;
  }

  /// @return what has changed since the last call, for an event: "NAME noisy", "NAME quiet again"
  [[nodiscard]] std::optional<std::string> update() {
    constexpr double kOver = 0.5;  // of the limit: it has ended
    if (!noisy_ && step_rms() > limit_) {
      noisy_ = true;
      return name_ + " noisy";
    }
    if (noisy_ && step_rms() < kOver * limit_) {
      noisy_ = false;
      return name_ + " quiet again";
    }
    return std::nullopt;
  }

  /// Whether it was last told to be noisy.
  [[nodiscard]] bool noisy() const { return noisy_; }
  /// Of the steps, summed over the axes.
  [[nodiscard]] double step_rms() const { return std::sqrt(std::max(squares_, 0.0)); }

 private:
  std::string name_;
  double limit_;
  Vec3 last_ = Vec3::Zero();
  double squares_ = -1;  ///< mean; -1: no reading yet
  bool noisy_ = false;
};

}  // namespace arex
