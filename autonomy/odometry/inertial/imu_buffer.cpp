#include "odometry/inertial/imu_buffer.h"

#include <algorithm>

namespace arex {
namespace {

bool later(Stamp t, const ImuSample& s) { return t < s.stamp; }

}  // namespace

bool has_gap(std::span<const ImuSample> samples) {
  return std::adjacent_find(samples.begin(), samples.end(),
                            [](const ImuSample& a, const ImuSample& b) {
                              return b.stamp - a.stamp > kMaxImuGap;
                            }) != samples.end();
}

bool has_imu_gap(std::span<const ImuSample> samples, Stamp until) {
  // By as much again the IMU's clock may be off.
  const Stamp lag = 2 * kMaxImuGap;
  return samples.empty() || until - samples.back().stamp > lag || has_gap(samples);
}

std::span<const ImuSample> ImuBuffer::between(Stamp after, Stamp until) const {
  const auto begin = std::upper_bound(samples_.begin(), samples_.end(), after, later);
  return {begin, std::upper_bound(begin, samples_.end(), until, later)};
}

std::span<const ImuSample> ImuBuffer::until(Stamp until) const {
  return {samples_.begin(), std::upper_bound(samples_.begin(), samples_.end(), until, later)};
}

void ImuBuffer::forget_before(Stamp stamp) {
  const auto after = std::upper_bound(samples_.begin(), samples_.end(), stamp, later);
  if (after != samples_.begin()) samples_.erase(samples_.begin(), after - 1);
}

}  // namespace arex
