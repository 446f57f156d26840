#include "stack/leg_motion.h"

#include <algorithm>

#include "planning/free_space.h"

namespace arex {
namespace {

// A landing aims this far below where it starts: touchdown ends it, wherever the ground is.
constexpr double kLandingDepth = 100;
// Path seconds looked ahead: the clock takes one to stop, the vehicle half a one to follow.
constexpr double kLookAhead_s = 2.0;
constexpr double kLookStep_s = 0.1;

bool holds_position(MotionRequest::Kind kind) {
  return kind != MotionRequest::Kind::kNone && kind != MotionRequest::Kind::kLevel &&
         kind != MotionRequest::Kind::kDescend;
}

}  // namespace

LegMotion::LegMotion(const TimedPathConfig& path, const CautionConfig& caution)
    : path_config_(path), caution_(caution), path_(path, Vec3::Zero(), 0) {}

void LegMotion::take_over(const TrajectorySetpoint& from) {
  path_ = TimedPath(path_config_, from.p_OB, from.yaw_rad);
  spin_yaw_rad_ = spin_rate_radps_ = 0;
  path_time_s_ = 0;
}

void LegMotion::start_again(const TrajectorySetpoint& from) {
  take_over(from);
  request_ = {};
}

void LegMotion::look_ahead(const GridView& grid, double radius_m) {
  blocked_ = false;
  if (request_.kind != MotionRequest::Kind::kLeg) return;
  // What is that near already is not ahead.
  const double here = clearance(grid, path_.sample(path_time_s_).p_OB, radius_m);
  for (double ahead = kLookStep_s; ahead <= kLookAhead_s && !blocked_; ahead += kLookStep_s) {
    blocked_ = clearance(grid, path_.sample(path_time_s_ + ahead).p_OB, radius_m) < here;
  }
}

TrajectorySetpoint LegMotion::update(Stamp now, const MotionRequest& request,
                                     const Odometry& odometry, bool follows) {
  // In the air without a position to hold, the setpoint goes with the vehicle: whoever takes over
  // starts there.
  const bool drifts =
      request.kind == MotionRequest::Kind::kLevel || request.kind == MotionRequest::Kind::kDescend;
  if (!(request == request_) || drifts) plan(request, odometry);
  // The path begins once the autopilot follows: the spin-up is not flown.
  if (started_) {
    advance_clock(now, odometry);
  } else if (follows) {
    started_ = true;
  }
  last_ = now;
  return sample();
}

void LegMotion::plan(const MotionRequest& request, const Odometry& odometry) {
  if (request.kind == MotionRequest::Kind::kHold && holds_position(request_.kind)) {
    request_ = request;  // on the same path, whose clock comes to rest
    blocked_ = false;
    return;
  }
  if (request_.kind == MotionRequest::Kind::kHold) {
    const TrajectorySetpoint held = path_.sample(path_time_s_);
    path_ = TimedPath(path_config_, held.p_OB, held.yaw_rad + spin_yaw_rad_);
    spin_yaw_rad_ = spin_rate_radps_ = 0;
    path_time_s_ = 0;
  }
  if (!holds_position(request_.kind)) {
    path_ = TimedPath(path_config_, odometry.X_OB.p, so3::yaw(odometry.X_OB.R));
    spin_yaw_rad_ = spin_rate_radps_ = 0;
    clock_rate_ = 1;
  } else if (request.kind != MotionRequest::Kind::kSpin) {
    path_ = TimedPath(path_config_, path_.end(), path_.end_yaw_rad() + spin_yaw_rad_);
    spin_yaw_rad_ = spin_rate_radps_ = 0;
  }
  if (request.kind != MotionRequest::Kind::kSpin) {
    started_ = false;
    path_time_s_ = 0;
  }
  request_ = request;
  blocked_ = false;
  switch (request.kind) {
    case MotionRequest::Kind::kTakeoff:
      path_.climb_to(request.goal_O.z());
      break;
    case MotionRequest::Kind::kLeg:
      path_.fly_to(request.goal_O);
      break;
    case MotionRequest::Kind::kLand:
      path_.land_to(path_.end().z() - kLandingDepth);
      break;
    default:
      break;
  }
}

void LegMotion::advance_clock(Stamp now, const Odometry& odometry) {
  const double dt = to_seconds(now - last_);
  const bool degenerate = odometry.status == OdometryStatus::kDegenerate;
  const bool rests = blocked_ || request_.kind == MotionRequest::Kind::kHold;
  const double wanted = rests ? 0.0 : degenerate ? caution_.degenerate_speed_fraction : 1.0;
  const double limit = caution_.change_per_s;
  const double change = std::clamp((wanted - clock_rate_) / std::max(dt, 1e-3), -limit, limit);
  clock_acceleration_ = change;
  clock_rate_ += change * dt;
  path_time_s_ += clock_rate_ * dt;

  const double wanted_spin =
      request_.kind == MotionRequest::Kind::kSpin ? request_.yaw_rate_radps : 0.0;
  const double step = path_config_.max_yaw_acceleration_radps2 * dt;
  spin_rate_radps_ += std::clamp(wanted_spin - spin_rate_radps_, -step, step);
  spin_yaw_rad_ += spin_rate_radps_ * dt;
}

TrajectorySetpoint LegMotion::sample() const {
  TrajectorySetpoint setpoint = path_.sample(path_time_s_);
  setpoint.a_OB = clock_rate_ * clock_rate_ * setpoint.a_OB + clock_acceleration_ * setpoint.v_OB;
  setpoint.v_OB *= clock_rate_;
  setpoint.yaw_rad = so3::wrap(setpoint.yaw_rad + spin_yaw_rad_);
  setpoint.yaw_rate_radps = setpoint.yaw_rate_radps * clock_rate_ + spin_rate_radps_;
  return setpoint;
}

}  // namespace arex
