#include "odometry/inertial/imu_predictor.h"

#include <algorithm>

namespace arex {
namespace {
// An anchor older than this many samples (10 s) is not integrated from its own time on.
constexpr std::size_t kMaxSamples = 2000;
// By so much at most the readings lie ahead of their stamps.
constexpr Stamp kMostAhead = kNanosecondsPerSecond / 5;
}  // namespace

void ImuPredictor::add(const ImuSample& imu) {
  if (samples_.size() >= kMaxSamples) {
    samples_.erase(samples_.begin(), samples_.begin() + kMaxSamples / 2);
  }
  samples_.push_back(imu);
  advance();
}

void ImuPredictor::anchor(Stamp stamp, const NavigationState& state, double accel_scale,
                          const GyroCompletion& completion) {
  const auto after = std::upper_bound(samples_.begin(), samples_.end(), stamp - kMostAhead,
                                      [](Stamp t, const ImuSample& s) { return t < s.stamp; });
  if (after != samples_.begin()) samples_.erase(samples_.begin(), after - 1);
  head_ = state;
  head_stamp_ = stamp;
  accel_scale_ = accel_scale;
  const double known_full_scale = completion_.full_scale_radps;
  completion_ = completion;
  if (known_full_scale > 0) completion_.full_scale_radps = known_full_scale;
  advance();
}

std::optional<NavigationState> ImuPredictor::at(Stamp stamp) const {
  if (!head_ || samples_.empty() || stamp <= head_stamp_) return head_;
  NavigationState state = *head_;
  GyroCompletion completion = completion_;
  integrate(stamp, state, completion);
  return state;
}

void ImuPredictor::advance() {
  if (!head_ || samples_.empty()) return;
  // To where a reading was taken, so that no interval is cut; not to where the newest would have to
  // be held, nor further than is asked for.
  const Stamp delay = from_seconds(head_->t_d);
  const Stamp newest = samples_.back().stamp;
  const auto after =
      std::upper_bound(samples_.begin(), samples_.end(), newest + std::min<Stamp>(0, delay),
                       [](Stamp t, const ImuSample& s) { return t < s.stamp; });
  if (after == samples_.begin()) return;
  const Stamp to = (after - 1)->stamp - delay;
  if (to <= head_stamp_) return;
  integrate(to, *head_, completion_);
  head_stamp_ = to;
}

void ImuPredictor::integrate(Stamp to, NavigationState& state, GyroCompletion& completion) const {
  for (ImuInterval& imu : imu_intervals(samples_, head_stamp_, to, accel_scale_, state.t_d)) {
    completion.complete(imu, state.R_OB);
    state = propagate(state, imu);
  }
}

}  // namespace arex
