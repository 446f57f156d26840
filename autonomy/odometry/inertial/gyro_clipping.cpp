#include "odometry/inertial/gyro_clipping.h"

#include <algorithm>
#include <cmath>

namespace arex {
namespace {

constexpr double kAtFullScale = 0.998;   // share of it that counts as clipped
constexpr double kBeyond = 1.01;         // a reading that far above it refutes what was learned
constexpr double kLeastFullScale = 1.0;  // rad/s; a slower axis may well repeat itself
constexpr double kSameReading = 1e-4;    // rad/s, far below the noise of a sample
constexpr int kRepeats = 3;
constexpr double kShortest = 0.02;   // s of clipping that tell a rate
constexpr double kMostMissing = 20;  // rad/s

}  // namespace

bool GyroCompletion::clipped(double reading_radps) const {
  return std::abs(reading_radps) >= kAtFullScale * full_scale_radps;
}

void GyroCompletion::complete(ImuInterval& imu) const {
  for (Vec3* gyro : {&imu.gyro_begin, &imu.gyro_end}) {
    for (int i = 0; i < 3; ++i) {
      double& reading = (*gyro)[i];
      if (!clipped(reading)) continue;
      reading += std::copysign(missing_radps[i], reading);
      imu.gyro_clipped[static_cast<std::size_t>(i)] = true;
    }
  }
}

void GyroFullScale::add(const Vec3& gyro_radps) {
  for (int i = 0; i < 3; ++i) {
    const double reading = std::abs(gyro_radps[i]);
    if (reading > kBeyond * learned_) learned_ = nominal_;
    int& repeats = repeats_[static_cast<std::size_t>(i)];
    const bool same = std::abs(gyro_radps[i] - last_[i]) < kSameReading;
    repeats = same && reading > kLeastFullScale ? repeats + 1 : 0;
    if (repeats >= kRepeats) learned_ = std::min(learned_, reading);
  }
  last_ = gyro_radps;
}

void ClippedTime::add(const ImuInterval& imu) {
  for (int i = 0; i < 3; ++i) {
    if (!imu.gyro_clipped[static_cast<std::size_t>(i)]) continue;
    seconds[i] += imu.dt_s();
    side[i] = std::copysign(1.0, imu.gyro_end[i]);
  }
}

Vec3 missing_rates(const Vec3& missing_radps, const ClippedTime& clipped, const Vec3& turn_rad) {
  Vec3 missing = Vec3::Zero();
  for (int i = 0; i < 3; ++i) {
    if (clipped.seconds[i] < kShortest) continue;
    const double lacking = 2 * clipped.side[i] * turn_rad[i] / clipped.seconds[i];
    missing[i] = std::clamp(missing_radps[i] + lacking, 0.0, kMostMissing);
  }
  return missing;
}

}  // namespace arex
