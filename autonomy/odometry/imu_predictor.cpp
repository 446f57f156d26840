#include "odometry/imu_predictor.h"

#include <algorithm>

namespace arex {
namespace {
// An anchor older than this many samples (10 s) is not integrated from its own time on.
constexpr std::size_t kMaxSamples = 2000;
}  // namespace

std::optional<NavigationState> ImuPredictor::add(const ImuSample& imu) {
  if (samples_.size() >= kMaxSamples) {
    samples_.erase(samples_.begin(), samples_.begin() + kMaxSamples / 2);
  }
  samples_.push_back(imu);
  advance(imu.stamp);
  return head_;
}

const std::optional<NavigationState>& ImuPredictor::anchor(Stamp stamp,
                                                           const NavigationState& state,
                                                           double accel_scale) {
  const auto after = std::upper_bound(samples_.begin(), samples_.end(), stamp,
                                      [](Stamp t, const ImuSample& s) { return t < s.stamp; });
  if (after != samples_.begin()) samples_.erase(samples_.begin(), after - 1);
  head_ = state;
  head_stamp_ = stamp;
  accel_scale_ = accel_scale;
  if (!samples_.empty()) advance(samples_.back().stamp);
  return head_;
}

void ImuPredictor::advance(Stamp to) {
  if (!head_ || to <= head_stamp_) return;
  const auto after = std::upper_bound(samples_.begin(), samples_.end(), head_stamp_,
                                      [](Stamp t, const ImuSample& s) { return t < s.stamp; });
  const auto first = after == samples_.begin() ? after : after - 1;
  for (const ImuInterval& imu :
       imu_intervals({first, samples_.end()}, head_stamp_, to, accel_scale_)) {
    head_ = propagate(*head_, imu);
  }
  head_stamp_ = to;
}

}  // namespace arex
