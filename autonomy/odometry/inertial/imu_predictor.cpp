#include "odometry/inertial/imu_predictor.h"

#include <algorithm>

namespace arex {
namespace {
// An anchor older than this many samples (10 s) is not integrated from its own time on.
constexpr std::size_t kMaxSamples = 2000;
}  // namespace

void ImuPredictor::add(const ImuSample& imu) {
  if (samples_.size() >= kMaxSamples) {
    samples_.erase(samples_.begin(), samples_.begin() + kMaxSamples / 2);
  }
  samples_.push_back(imu);
  advance(imu.stamp);
}

void ImuPredictor::anchor(Stamp stamp, const NavigationState& state, double accel_scale,
                          const GyroCompletion& completion) {
  const auto after = std::upper_bound(samples_.begin(), samples_.end(), stamp,
                                      [](Stamp t, const ImuSample& s) { return t < s.stamp; });
  if (after != samples_.begin()) samples_.erase(samples_.begin(), after - 1);
  head_ = state;
  head_stamp_ = stamp;
  accel_scale_ = accel_scale;
  completion_ = completion;
  if (!samples_.empty()) advance(samples_.back().stamp);
}

std::optional<NavigationState> ImuPredictor::at(Stamp stamp) const {
  if (!head_ || samples_.empty() || stamp <= head_stamp_) return head_;
  return integrate(stamp);
}

void ImuPredictor::advance(Stamp to) {
  if (!head_ || to <= head_stamp_) return;
  head_ = integrate(to);
  head_stamp_ = to;
}

NavigationState ImuPredictor::integrate(Stamp to) const {
  const auto after = std::upper_bound(samples_.begin(), samples_.end(), head_stamp_,
                                      [](Stamp t, const ImuSample& s) { return t < s.stamp; });
  const auto first = after == samples_.begin() ? after : after - 1;
  NavigationState state = *head_;
  for (ImuInterval& imu : imu_intervals({first, samples_.end()}, head_stamp_, to, accel_scale_)) {
    completion_.complete(imu);
    state = propagate(state, imu);
  }
  return state;
}

}  // namespace arex
