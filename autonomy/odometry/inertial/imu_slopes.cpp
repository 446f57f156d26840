#include "odometry/inertial/imu_slopes.h"

#include <algorithm>
#include <cmath>

namespace arex {
namespace {

/// The mean of the readings about an instant.
struct Level {
  Vec3 gyro = Vec3::Zero();   ///< rad/s
  Vec3 accel = Vec3::Zero();  ///< m/s^2
};

/// @param half_window of the mean; symmetric about `stamp`, so less where the newest sample is near
Level level_at(std::span<const ImuSample> samples, Stamp stamp, Stamp half_window) {
  constexpr Stamp kLeast = kNanosecondsPerSecond / 100;
  stamp = std::min(stamp, samples.back().stamp);
  const Stamp half = std::max(kLeast, std::min(half_window, samples.back().stamp - stamp));
  const auto first =
      std::lower_bound(samples.begin(), samples.end(), stamp - half,
                       [](const ImuSample& sample, Stamp t) { return sample.stamp < t; });
  Level level;
  double n = 0;
  for (auto sample = first; sample != samples.end() && sample->stamp <= stamp + half; ++sample) {
    level.gyro += sample->gyro_radps;
    level.accel += sample->accel_mps2;
    ++n;
  }
  if (n == 0) return {samples.back().gyro_radps, samples.back().accel_mps2};
  return {level.gyro / n, level.accel / n};
}

/// `slope` as far as it is none of the noise.
Vec3 sure_part(const Vec3& slope, double std) {
  const double noise = 3 * std * std / std::max(slope.squaredNorm(), 1e-12);
  return std::max(0.0, 1 - noise) * slope;
}

}  // namespace

void add_slopes(std::vector<ImuInterval>& intervals, std::span<const ImuSample> samples,
                double accel_scale, double delay_s, Stamp window, const WhiteNoise& shaking) {
  if (intervals.empty()) return;
  const Stamp delay = from_seconds(delay_s);
  const Stamp begin = intervals.front().begin, end = intervals.back().end;
  const double seconds = to_seconds(end - begin);
  const Level before = level_at(samples, begin + delay, window / 2);
  const Level after = level_at(samples, end + delay, window / 2);
  // The two means share what was shaken between them: -1, 2, -1 of three instants.
  const double share = std::sqrt(6.0) / (to_seconds(window) * seconds);
  const double gyro_std = share * scatter_of_integral(shaking.gyro);
  const double accel_std = share * scatter_of_integral(shaking.accel);
  const Vec3 gyro = sure_part((after.gyro - before.gyro) / seconds, gyro_std);
  // What an error of scale does to a turn. By the readings themselves, which turn as they are
  // shaken, the scale would be learned from the shaking: by a tenth wrong.
  const double level_std = std::sqrt(2.0) / to_seconds(window) * scatter_of_integral(shaking.gyro);
  const Vec3 level = sure_part(0.5 * (before.gyro + after.gyro), level_std);
  const Vec3 accel = accel_scale * sure_part((after.accel - before.accel) / seconds, accel_std);
  for (ImuInterval& imu : intervals) {
    imu.gyro_level = level;
    imu.gyro_slope = gyro;
    imu.accel_slope = accel;
    imu.gyro_slope_noise.setConstant(std::sqrt(seconds) * gyro_std);
    imu.accel_slope_noise.setConstant(std::sqrt(seconds) * accel_scale * accel_std);
  }
}

}  // namespace arex
