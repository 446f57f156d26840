#include "control/timed_path.h"

#include <algorithm>
#include <cmath>

#include "math/so3.h"

namespace arex {
namespace {

// A leg whose horizontal part is shorter than this has no heading.
constexpr double kVerticalLeg = 0.05;  // m

/// The first moment at which no more than `rest` of the turn is left.
double time_until_remaining(const SCurve& turn, double rest) {
  if (turn.distance() <= rest) return 0;
  double low = 0;
  double high = turn.duration_s();
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (turn.distance() - turn.sample(middle).position > rest ? low : high) = middle;
  }
  return high;
}

}  // namespace

TimedPath::TimedPath(const TimedPathConfig& config, const Vec3& start_p_O, double start_yaw_rad)
    : config_(config), p_(start_p_O), yaw_(start_yaw_rad) {
  append(p_, config.max_speed_mps, yaw_, 0);
}

void TimedPath::fly_to(const Vec3& p_O) {
  const Vec3 leg = p_O - p_;
  const bool vertical = leg.head<2>().norm() < kVerticalLeg;
  const double yaw = vertical ? yaw_ : std::atan2(leg.y(), leg.x());
  append(p_O, vertical ? config_.climb_speed_mps : config_.max_speed_mps, yaw, 0);
}

void TimedPath::climb_to(double z_m) {
  append({p_.x(), p_.y(), z_m}, config_.climb_speed_mps, yaw_, 0);
}

void TimedPath::land_to(double z_m) {
  append({p_.x(), p_.y(), z_m}, config_.landing_speed_mps, yaw_, 0);
}

void TimedPath::wait(double duration_s) { append(p_, config_.max_speed_mps, yaw_, duration_s); }

void TimedPath::append(const Vec3& p_O, double speed_mps, double yaw_rad, double duration_s) {
  Leg leg;
  leg.begin = duration_;
  leg.from = p_;
  leg.direction = (p_O - p_).normalized();
  leg.motion =
      SCurve((p_O - p_).norm(), {speed_mps, config_.max_acceleration_mps2, config_.max_jerk_mps3});
  const double turn = so3::wrap(yaw_rad - yaw_);
  leg.yaw_from = yaw_;
  leg.yaw_sign = turn < 0 ? -1 : 1;
  leg.turn =
      SCurve(std::abs(turn), {config_.max_yaw_rate_radps, config_.max_yaw_acceleration_radps2,
                              config_.max_yaw_jerk_radps3});
  leg.move_begin = time_until_remaining(leg.turn, config_.moving_heading_rad);
  duration_ +=
      std::max({leg.move_begin + leg.motion.duration_s(), leg.turn.duration_s(), duration_s});
  legs_.push_back(leg);
  p_ = p_O;
  yaw_ = so3::wrap(yaw_ + turn);
}

TrajectorySetpoint TimedPath::sample(double time_s) const {
  const auto after = std::upper_bound(legs_.begin(), legs_.end(), time_s,
                                      [](double t, const Leg& leg) { return t < leg.begin; });
  const Leg& leg = after == legs_.begin() ? legs_.front() : *(after - 1);
  const double t = time_s - leg.begin;
  const SCurve::State motion = leg.motion.sample(t - leg.move_begin);
  const SCurve::State turn = leg.turn.sample(t);
  TrajectorySetpoint out;
  out.p_OB = leg.from + motion.position * leg.direction;
  out.v_OB = motion.speed * leg.direction;
  out.a_OB = motion.acceleration * leg.direction;
  out.yaw_rad = so3::wrap(leg.yaw_from + leg.yaw_sign * turn.position);
  out.yaw_rate_radps = leg.yaw_sign * turn.speed;
  return out;
}

}  // namespace arex
