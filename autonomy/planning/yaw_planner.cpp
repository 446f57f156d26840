#include "planning/yaw_planner.h"

#include <algorithm>
#include <cmath>

#include "math/so3.h"

namespace arex {

double YawPlanner::wanted(const UniformBspline& spline, double t_s, double fallback_rad) const {
  if (spline.empty()) return fallback_rad;
  const Vec3 here = spline.position(t_s);
  const auto offset = [&](double ahead_s) {
    return Vec2((spline.position(t_s + ahead_s) - here).head<2>());
  };
  // A slow start or a near end: look further along the path before giving up.
  for (double ahead = config_.look_ahead_s; ahead <= 4 * config_.look_ahead_s; ahead *= 2) {
    const Vec2 d = offset(ahead);
    if (d.norm() >= config_.min_reach_m) return std::atan2(d.y(), d.x());
  }
  return fallback_rad;
}

double YawPlanner::towards(const Vec3& p, const Vec3& target, double fallback_rad) const {
  const Vec2 d = (target - p).head<2>();
  return d.norm() >= config_.min_reach_m ? std::atan2(d.y(), d.x()) : fallback_rad;
}

Heading YawPlanner::step(const Heading& now, double wanted_rad, double dt_s) const {
  const double error = so3::wrap(wanted_rad - now.yaw_rad);
  const double a = config_.max_acceleration_radps2;
  // The rate from which the error can still be braked away within whole steps.
  const double half = 0.5 * a * dt_s;
  const double braking = std::sqrt(half * half + 2 * a * std::abs(error)) - half;
  const double target =
      std::copysign(std::min({config_.max_rate_radps, braking, std::abs(error) / dt_s}), error);
  Heading next;
  next.rate_radps = std::clamp(target, now.rate_radps - a * dt_s, now.rate_radps + a * dt_s);
  next.rate_radps = std::clamp(next.rate_radps, -config_.max_rate_radps, config_.max_rate_radps);
  next.yaw_rad = so3::wrap(now.yaw_rad + next.rate_radps * dt_s);
  return next;
}

double YawPlanner::turn_time_s(double yaw_rad, double wanted_rad) const {
  const double offset = std::abs(so3::wrap(wanted_rad - yaw_rad)) - config_.max_offset_rad;
  if (offset <= 0) return 0.0;
  return offset / config_.max_rate_radps + config_.max_rate_radps / config_.max_acceleration_radps2;
}

}  // namespace arex
