#include "sensors/imu_vibration.h"

#include <cmath>
#include <numbers>

namespace arex::sim {
namespace {

constexpr double kShareOfRotor = 0.5;
// Seen from above, in MotorCommand's order.
constexpr std::array<double, 4> kTurningSense{1, 1, -1, -1};

}  // namespace

VibrationModel::VibrationModel(const VibrationConfig& config, std::uint64_t seed)
    : config_(config), stream_(seed, "imu.vibration") {
  for (double& phase : phase_rad_) phase = stream_.uniform(0, 2 * std::numbers::pi);
  // q'' + 2 z w q' + w^2 q = alpha, alpha constant over the tick.
  const double w = 2 * std::numbers::pi * config.frame_mode_hz, z = config.frame_mode_damping;
  const double wd = w * std::sqrt(1 - z * z), decay = std::exp(-z * w * kSecondsPerTick);
  const double c = std::cos(wd * kSecondsPerTick), s = std::sin(wd * kSecondsPerTick);
  transition_ << decay * (c + z * w / wd * s), decay * s / wd, -decay * w * w / wd * s,
      decay * (c - z * w / wd * s);
  const Eigen::Vector2d rest(1 / (w * w), 0);  // where a constant unit alpha ends
  input_ = rest - transition_ * rest;
}

VibrationModel::Shake VibrationModel::step(const std::array<double, 4>& rotor_radps,
                                           const Vec3& alpha_B) {
  Shake shake;
  Vec3 shake_alpha = Vec3::Zero();
  double mean_growth = 0;
  for (std::size_t i = 0; i < rotor_radps.size(); ++i) {
    const double speed = rotor_radps[i];
    phase_rad_[i] = std::fmod(phase_rad_[i] + speed * kSecondsPerTick, 2 * std::numbers::pi);
    const double ratio = speed / config_.reference_speed_radps;
    const double growth = kShareOfRotor * ratio * ratio;
    mean_growth += ratio * ratio / static_cast<double>(rotor_radps.size());
    const double c = std::cos(phase_rad_[i]), s = kTurningSense[i] * std::sin(phase_rad_[i]);
    shake.accel_mps2 += growth * Vec3(config_.once_per_rev_mps2 * c, config_.once_per_rev_mps2 * s,
                                      config_.blade_pass_mps2 * std::cos(2 * phase_rad_[i]));
    // The moment of the unbalance about the IMU: a quarter turn behind the force.
    shake.gyro_radps += growth * config_.gyro_radps * Vec3(s, -c, 0);
    shake_alpha +=
        growth * config_.gyro_radps * speed * Vec3(kTurningSense[i] * c, kTurningSense[i] * s, 0);
  }
  shake.accel_mps2 += mean_growth * config_.broadband_mps2 * stream_.normal3();
  rock(alpha_B + shake_alpha);
  shake.gyro_radps += config_.frame_coupling * mount_rate_;
  return shake;
}

void VibrationModel::rock(const Vec3& alpha_B) {
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector2d next =
        transition_ * Eigen::Vector2d(mount_angle_[axis], mount_rate_[axis]) +
        input_ * alpha_B[axis];
    mount_angle_[axis] = next[0];
    mount_rate_[axis] = next[1];
  }
}

}  // namespace arex::sim
