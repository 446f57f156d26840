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
// An acceleration is averaged over so long, and lasts so long: drives turn a vehicle to a new rate
// within a tenth of a second or two.
constexpr double kSlopeTime = 0.04, kLasting = 0.12;  // s
// Gains of an alpha-beta filter for an angle that errs by 11 mrad a sample of 5 ms and drives that
// turn a vehicle by 12 rad/s^2 (Kalata's tracking index 0.03), 1/s and 1/s^2.
constexpr double kFollowAngle = 42, kFollowRate = 1000;
constexpr double kLeastField = 0.1;  // gauss across an axis, to tell a turn about it

}  // namespace

bool GyroCompletion::clipped(double reading_radps) const {
  return std::abs(reading_radps) >= kAtFullScale * full_scale_radps;
}

double GyroCompletion::missing(int axis, double side) const {
  if (missing_radps[axis] >= 0) return missing_radps[axis];
  const double gain = kLasting * (1 - std::exp(-clipped_s_[axis] / kLasting));
  return std::clamp(side * acceleration_radps2_[axis] * gain, 0.0, kMostMissing);
}

double GyroCompletion::follow_field(int axis, double side, const ImuInterval& imu,
                                    const Mat3& R_OB) {
  const Vec3 e = Vec3::Unit(axis);
  const Vec3 expected = R_OB.transpose() * field_O, measured = imu.field_begin;
  const Vec3 a = expected - expected[axis] * e, b = measured - measured[axis] * e;
  if (a.norm() < kLeastField || b.norm() < kLeastField) return missing(axis, side);
  // The field turns in B against the vehicle.
  const double still_to_turn = side * std::atan2(e.dot(b.cross(a)), a.dot(b));
  double& followed = followed_radps_[axis];
  const double added = std::clamp(followed + kFollowAngle * still_to_turn, 0.0, kMostMissing);
  followed = std::clamp(followed + kFollowRate * imu.dt_s() * still_to_turn, 0.0, kMostMissing);
  return added;
}

void GyroCompletion::complete(ImuInterval& imu, const Mat3& R_OB) {
  const double dt = imu.dt_s();
  for (int i = 0; i < 3; ++i) {
    double &begin = imu.gyro_begin[i], &end = imu.gyro_end[i];
    const bool begin_clipped = clipped(begin), end_clipped = clipped(end);
    if (!begin_clipped && !end_clipped) {
      const double share = dt / (dt + kSlopeTime);
      if (dt > 0) acceleration_radps2_[i] += share * ((end - begin) / dt - acceleration_radps2_[i]);
      clipped_s_[i] = followed_radps_[i] = 0;
      continue;
    }
    imu.gyro_clipped[static_cast<std::size_t>(i)] = true;
    const double side = std::copysign(1.0, begin_clipped ? begin : end);
    if (by_field() && !imu.field_begin.isZero(0)) {
      const double added = follow_field(i, side, imu, R_OB);
      if (begin_clipped) begin += side * added;
      if (end_clipped) end += side * added;
      clipped_s_[i] += dt;
      continue;
    }
    if (begin_clipped) begin += std::copysign(missing(i, std::copysign(1.0, begin)), begin);
    clipped_s_[i] += dt;
    if (end_clipped) end += std::copysign(missing(i, std::copysign(1.0, end)), end);
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

void ClippedTime::add(const ImuInterval& imu, double full_scale_radps) {
  for (int i = 0; i < 3; ++i) {
    if (!imu.gyro_clipped[static_cast<std::size_t>(i)]) continue;
    seconds[i] += imu.dt_s();
    side[i] = std::copysign(1.0, imu.gyro_end[i]);
    for (const double reading : {imu.gyro_begin[i], imu.gyro_end[i]}) {
      added_rad[i] += 0.5 * imu.dt_s() * std::max(0.0, std::abs(reading) - full_scale_radps);
    }
  }
}

Vec3 missing_rates(const ClippedTime& clipped, const Vec3& turn_rad) {
  Vec3 missing = Vec3::Constant(GyroCompletion::kUntold);
  for (int i = 0; i < 3; ++i) {
    if (clipped.seconds[i] < kShortest) continue;
    const double lacking_rad = clipped.side[i] * turn_rad[i];
    missing[i] =
        std::clamp((clipped.added_rad[i] + lacking_rad) / clipped.seconds[i], 0.0, kMostMissing);
  }
  return missing;
}

}  // namespace arex
