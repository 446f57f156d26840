#include "physics/flexible_frame.h"

#include <cmath>
#include <numbers>

#include "math/random.h"
#include "math/so3.h"

namespace arex::sim {
namespace {

constexpr double kTwoPi = 2 * std::numbers::pi;

}  // namespace

FlexibleFrame::FlexibleFrame(const FrameConfig& config, const Airframe& airframe,
                             std::uint64_t seed)
    : config_(config),
      p_BR_(airframe.p_BR),
      mass_kg_(airframe.mass_kg),
      inverse_inertia_(airframe.inertia_kgm2.inverse()) {
  RandomStream stream(seed, "physics.frame");
  for (double& angle : angle_rad_) angle = stream.uniform(0, kTwoPi);
  // q'' + 2 z w q' + w^2 q = a, a constant over the tick.
  const double w = kTwoPi * config.mode_hz, z = config.mode_damping;
  const double wd = w * std::sqrt(1 - z * z), decay = std::exp(-z * w * kSecondsPerTick);
  const double c = std::cos(wd * kSecondsPerTick), s = std::sin(wd * kSecondsPerTick);
  transition_ << decay * (c + z * w / wd * s), decay * s / wd, -decay * w * w / wd * s,
      decay * (c - z * w / wd * s);
  const Eigen::Vector2d rest(1 / (w * w), 0);  // where a constant unit acceleration ends
  input_ = rest - transition_ * rest;
}

FlexibleFrame::Drive FlexibleFrame::unbalance(const std::array<double, 4>& rotor_radps) {
  Vec3 force = Vec3::Zero(), torque = Vec3::Zero();
  for (std::size_t i = 0; i < 4; ++i) {
    const double speed = rotor_radps[i], ratio = speed / config_.reference_speed_radps;
    angle_rad_[i] = std::fmod(angle_rad_[i] + kRotorSpin[i] * speed * kSecondsPerTick, kTwoPi);
    const double pull = config_.unbalance_n * ratio * ratio;
    const Vec3 pulled(pull * std::cos(angle_rad_[i]), pull * std::sin(angle_rad_[i]), 0);
    force += pulled;
    torque += (p_BR_[i] + Vec3(0, 0, config_.unbalance_height_m)).cross(pulled);
  }
  return {force / mass_kg_, inverse_inertia_ * torque};
}

void FlexibleFrame::swing(Mode& mode, const Vec3& drive) const {
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector2d next =
        transition_ * Eigen::Vector2d(mode.value[axis], mode.rate[axis]) + input_ * drive[axis];
    mode.value[axis] = next[0];
    mode.rate[axis] = next[1];
  }
}

void FlexibleFrame::step(const Truth& rigid) {
  // The specific force: what the load's weight and its acceleration ask of the spring.
  const Vec3 force = rigid.X_WB.R.transpose() * (rigid.a_WB + Vec3(0, 0, kGravity));
  if (!begun_) {  // it has hung in its spring for long
    const double w = kTwoPi * config_.mode_hz;
    shift_.value = force / (w * w);
  }
  const Drive shaken = unbalance(rigid.rotor_radps);
  swing(shift_, force + shaken.linear);
  swing(turn_, rigid.alpha_WB_B + shaken.angular);
  plate_before_ = plate_;
  move_plate(rigid);
  if (!begun_) plate_before_ = plate_;
  begun_ = true;
}

void FlexibleFrame::move_plate(const Truth& rigid) {
  const double r = config_.load_ratio;
  const Vec3 turn = r * turn_.value, shift = r * shift_.value;
  const Truth before = plate_;
  plate_ = rigid;
  plate_.X_WB.R = rigid.X_WB.R * so3::Exp(turn);
  plate_.X_WB.p = rigid.X_WB.p + rigid.X_WB.R * shift;
  plate_.w_WB_B = so3::Exp(-turn) * rigid.w_WB_B + so3::right_jacobian(turn) * (r * turn_.rate);
  plate_.v_WB = rigid.v_WB + rigid.X_WB.R * (r * shift_.rate + rigid.w_WB_B.cross(shift));
  if (!begun_) return;
  plate_.a_WB = (plate_.v_WB - before.v_WB) / kSecondsPerTick;
  plate_.alpha_WB_B = (plate_.w_WB_B - before.w_WB_B) / kSecondsPerTick;
}

}  // namespace arex::sim
