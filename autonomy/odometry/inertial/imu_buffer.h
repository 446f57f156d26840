#pragma once

#include <span>
#include <vector>

#include "messages/sensors.h"

namespace arex {

/// IMU samples further apart than this, some ten of them missing, are no standstill.
inline constexpr Stamp kMaxImuGap = kNanosecondsPerSecond / 20;

/// Whether two neighbouring samples lie further apart than kMaxImuGap.
[[nodiscard]] bool has_gap(std::span<const ImuSample> samples);

/// Whether they have a gap, or end long before `until`.
[[nodiscard]] bool has_imu_gap(std::span<const ImuSample> samples, Stamp until);

/// The samples that an estimator still needs, in order of time.
class ImuBuffer {
 public:
  void add(std::span<const ImuSample> samples) {
    samples_.insert(samples_.end(), samples.begin(), samples.end());
  }
  [[nodiscard]] std::span<const ImuSample> samples() const { return samples_; }
  [[nodiscard]] bool empty() const { return samples_.empty(); }

  /// Those in (after, until].
  [[nodiscard]] std::span<const ImuSample> between(Stamp after, Stamp until) const;
  /// Those up to `until`, it included.
  [[nodiscard]] std::span<const ImuSample> until(Stamp until) const;

  /// Keeps what integration from `stamp` on reads: the newest sample at or before it, and the
  /// later.
  void forget_before(Stamp stamp);

 private:
  std::vector<ImuSample> samples_;
};

}  // namespace arex
