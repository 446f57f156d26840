#include "mission/mission.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace arex {
namespace {

std::string describe(const Vec3& p) {
  return fmt::format("{:.2f} {:.2f} {:.2f}", p.x(), p.y(), p.z());
}

/// What keeps the vehicle from arming; empty: nothing.
std::string_view missing(const Mission::Inputs& inputs) {
  if (inputs.odometry.status != OdometryStatus::kOk) {
    return kOdometryNeedNames[static_cast<std::size_t>(inputs.need)];
  }
  return inputs.autopilot_ready ? "" : "autopilot";
}

}  // namespace

Mission::Mission(const MissionConfig& config, EventSink events)
    : config_(config), events_(std::move(events)) {
  events_(EventKind::kMissionState, "initialise");
}

MotionRequest Mission::update(const Inputs& inputs) {
  if (inputs.armed != was_armed_) {
    events_(inputs.armed ? EventKind::kArmed : EventKind::kDisarmed, "");
    was_armed_ = inputs.armed;
  }
  watch_odometry(inputs);
  watch_sight(inputs);
  watch_link(inputs);
  obey(inputs);
  switch (state_) {
    case MissionState::kInitialise:
      wait_until_ready(inputs);
      break;
    case MissionState::kTakeoff:
      take_off(inputs);
      break;
    case MissionState::kEntry:
      enter_area(inputs);
      break;
    case MissionState::kFly:
      fly(inputs);
      break;
    case MissionState::kExplore:
      explore(inputs);
      break;
    case MissionState::kHold:
      hold(inputs);
      break;
    case MissionState::kReturn:
      fly_to_landing(inputs);
      break;
    case MissionState::kLand:
      land(inputs);
      break;
    case MissionState::kLost:
      if (!inputs.armed) {
        lost_ = !lands_blind_;
        enter(MissionState::kDone, inputs);
      } else if (inputs.now - lost_since_ >= from_seconds(config_.lost_hover_s)) {
        request_ = {MotionRequest::Kind::kDescend, Vec3::Zero()};
      }
      break;
    case MissionState::kDone:
      break;
  }
  return request_;
}

void Mission::wait_until_ready(const Inputs& inputs) {
  const Stamp settled = from_seconds(config_.settle_s);
  if (inputs.now < settled) return;
  const std::string_view lacks = missing(inputs);
  if (lacks.empty()) {
    enter(MissionState::kTakeoff, inputs);
  } else if (inputs.now - settled >= from_seconds(config_.ready_timeout_s)) {
    end_stuck("not_ready: " + std::string(lacks));
    enter(MissionState::kDone, inputs);
  }
}

// What hovers too high has taken off as well: more thrust than was reckoned with, and a controller
// that leaves its share of it.
void Mission::take_off(const Inputs& inputs) {
  const Vec3 beside = inputs.odometry.X_OB.p - request_.goal_O;
  const Vec3 error(beside.x(), beside.y(), std::min(beside.z(), 0.0));
  if (rests(inputs, error.norm() < config_.arrival_radius_m)) {
    const bool explores = config_.kind == MissionConfig::Kind::kExplore;
    enter(explores ? MissionState::kEntry : MissionState::kFly, inputs);
  } else if (stalls(inputs, (request_.goal_O - inputs.odometry.X_OB.p).norm(),
                    config_.takeoff_timeout_s)) {
    const std::string cause = inputs.armed ? "takeoff: height not reached" : "takeoff: not armed";
    end_stuck(inputs.trouble.empty() ? cause : cause + ": " + std::string(inputs.trouble));
    enter(inputs.armed ? MissionState::kLand : MissionState::kDone, inputs);
  }
}

// A landing that ends in mid-air, by what it knows, is handed to the autopilot, which comes down by
// thrust alone; then there is nothing left to try.
void Mission::land(const Inputs& inputs) {
  if (!inputs.armed) {
    enter(MissionState::kDone, inputs);
  } else if (stalls(inputs, inputs.odometry.X_OB.p.z(), config_.leg_timeout_s)) {
    if (request_.kind != MotionRequest::Kind::kDescend) {
      events_(EventKind::kRecovery, "the autopilot lands");
      request_ = {MotionRequest::Kind::kDescend, request_.goal_O};
      progress_.begin(inputs.now);
    } else {
      end_stuck("landing: not disarmed");
      enter(MissionState::kDone, inputs);
    }
  }
}

void Mission::end_stuck(const std::string& cause) {
  events_(EventKind::kStuck, cause);
  if (stuck_.empty()) stuck_ = cause;
}

void Mission::drop_target(const std::string& cause) {
  end_stuck(cause);
  events_(EventKind::kTargetDropped, describe(request_.goal_O));
}

bool Mission::stalls(const Inputs& inputs, double remaining_m, double timeout_s) {
  progress_.update(remaining_m, inputs.now);
  return inputs.now - progress_.since() >= from_seconds(timeout_s);
}

// One that holds at its end has not stalled, however long it has to.
bool Mission::leg_stalls(const Inputs& inputs) {
  return inside_since_ < 0 &&
         stalls(inputs, (request_.goal_O - inputs.odometry.X_OB.p).norm(), config_.leg_timeout_s);
}

void Mission::watch_odometry(const Inputs& inputs) {
  const bool flying = inputs.armed && state_ != MissionState::kDone;
  const bool missing = inputs.odometry.status == OdometryStatus::kLost;
  if (flying && missing && state_ != MissionState::kLost) {
    lost_since_ = inputs.now;
    interrupted_ = state_;
    interrupted_request_ = request_;
    enter(MissionState::kLost, inputs);
  } else if (state_ == MissionState::kLost && !missing &&
             request_.kind == MotionRequest::Kind::kLevel) {
    events_(EventKind::kRecovery, "odometry is back");
    state_ = interrupted_;
    request_ = interrupted_request_;
    inside_since_ = -1;
    progress_.begin(inputs.now);
  }
}

// Blind it flies on by what it remembers, and its odometry by the IMU alone: it stops while both
// are still good.
void Mission::watch_sight(const Inputs& inputs) {
  const bool moves = state_ == MissionState::kEntry || state_ == MissionState::kFly ||
                     state_ == MissionState::kExplore || state_ == MissionState::kReturn;
  if (moves && !blind_ && inputs.armed && inputs.blind_s >= config_.blind_hold_s) {
    events_(EventKind::kRecovery, "lidar silent: comes to rest");
    begin_hold({OperatorCommand::Kind::kHold, Vec3::Zero()}, inputs);
    blind_ = true;
  } else if (blind_ && state_ == MissionState::kHold && inputs.blind_s < config_.blind_hold_s) {
    events_(EventKind::kRecovery, "lidar is back: goes on");
    blind_ = false;
    resume(inputs);
  } else if (blind_ && state_ == MissionState::kHold && inputs.lives_on_scans &&
             inputs.blind_s >= config_.blind_land_s) {
    events_(EventKind::kRecovery, "lidar silent: lands");
    end_stuck("lidar silent");
    lands_blind_ = true;
    request_.goal_O = inputs.odometry.X_OB.p;
    enter(MissionState::kLand, inputs);
  }
  if (state_ != MissionState::kHold && state_ != MissionState::kLost) blind_ = false;
}

void Mission::enter(MissionState state, const Inputs& inputs) {
  state_ = state;
  state_since_ = inputs.now;
  inside_since_ = -1;
  progress_.begin(inputs.now);
  events_(EventKind::kMissionState,
          std::string(kMissionStateNames[static_cast<std::size_t>(state)]));
  switch (state) {
    case MissionState::kTakeoff:
      home_O_ = inputs.odometry.X_OB.p + config_.takeoff_height_m * Vec3::UnitZ();
      request_ = {MotionRequest::Kind::kTakeoff, home_O_};
      break;
    case MissionState::kEntry:
      waypoint_ = 0;
      break;
    case MissionState::kHold:
      request_ = {MotionRequest::Kind::kHold, request_.goal_O, 0, ++orders_};
      break;
    case MissionState::kReturn:
    case MissionState::kExplore:  // hovers until the explorer's first word
      break;
    case MissionState::kFly:
      begin_flying();
      break;
    case MissionState::kLand:
      request_ = {MotionRequest::Kind::kLand, request_.goal_O};
      break;
    case MissionState::kLost:
      request_ = {MotionRequest::Kind::kLevel, Vec3::Zero()};
      break;
    default:
      request_ = {};
  }
}

void Mission::begin_flying() {
  const bool has_waypoints = config_.kind != MissionConfig::Kind::kYawBurst;
  if (has_waypoints && !config_.waypoints_m.empty()) select_waypoint(0, state_since_);
}

void Mission::enter_area(const Inputs& inputs) {
  const bool on_leg = request_.kind == MotionRequest::Kind::kLeg;
  if (on_leg && !has_arrived(inputs)) {
    if (!leg_stalls(inputs)) return;
    drop_target(inputs.leg_blocked ? "entry: leg blocked" : "entry: leg not reached");
    enter(MissionState::kReturn, inputs);
    go_home();  // the way that it came is free
    return;
  }
  if (on_leg) ++waypoint_;
  if (waypoint_ >= config_.entry_m.size()) {
    enter(MissionState::kExplore, inputs);
    return;
  }
  inside_since_ = -1;
  progress_.begin(inputs.now);
  request_ = {MotionRequest::Kind::kLeg, config_.entry_m[waypoint_]};
  events_(EventKind::kTargetSelected, describe(request_.goal_O));
}

void Mission::fly(const Inputs& inputs) {
  const bool planned = request_.kind == MotionRequest::Kind::kGoTo;
  if (config_.kind == MissionConfig::Kind::kYawBurst) {
    spin(inputs);
  } else if (config_.waypoints_m.empty()) {
    land_on_command(inputs);
  } else if (planned ? inputs.progress == MotionProgress::kArrived : has_arrived(inputs)) {
    reach(inputs);
    next_waypoint(inputs);
  } else if (planned && inputs.progress == MotionProgress::kFailed) {
    drop_target(std::string(inputs.cause));
    next_waypoint(inputs);
  } else if (!planned && leg_stalls(inputs)) {
    drop_target(inputs.leg_blocked ? "leg blocked" : "leg not reached");
    next_waypoint(inputs);
  }
}

void Mission::reach(const Inputs& inputs) {
  targets_.push_back({request_.goal_O, inputs.now});
  events_(EventKind::kTargetReached, describe(request_.goal_O));
}

void Mission::next_waypoint(const Inputs& inputs) {
  if (waypoint_ + 1 < config_.waypoints_m.size()) {
    select_waypoint(waypoint_ + 1, inputs.now);
  } else if (!end_in_the_air(inputs)) {
    land_on_command(inputs);
  }
}

void Mission::select_waypoint(std::size_t index, Stamp now) {
  waypoint_ = index;
  inside_since_ = -1;
  progress_.begin(now);
  const bool planned = config_.kind == MissionConfig::Kind::kGoals;
  request_ = {planned ? MotionRequest::Kind::kGoTo : MotionRequest::Kind::kLeg,
              config_.waypoints_m[index]};
  events_(EventKind::kTargetSelected, describe(request_.goal_O));
}

void Mission::explore(const Inputs& inputs) {
  if (stop_exploring_) {
    return_to_land(inputs);
    return;
  }
  // An explorer without a map says nothing, and one to which the vehicle stands in an obstacle
  // waits.
  if (std::exchange(decided_, false)) progress_.begin(inputs.now);
  if (inputs.now - progress_.since() >= from_seconds(config_.ready_timeout_s)) {
    end_stuck(waits_ ? "start_not_free" : "no_map");
    enter(MissionState::kLand, inputs);
    return;
  }
  if (request_.kind != MotionRequest::Kind::kGoTo) return;
  if (target_progress_ != TargetProgress::kUnderWay) return;  // told; waits for the next decision
  if (inputs.progress == MotionProgress::kArrived) {
    reach(inputs);
    target_progress_ = TargetProgress::kReached;
  } else if (inputs.progress == MotionProgress::kFailed) {
    events_(EventKind::kStuck, std::string(inputs.cause));
    events_(EventKind::kTargetDropped, describe(request_.goal_O));
    target_progress_ = TargetProgress::kUnreachable;
  }
}

void Mission::decide(const Decision& decision) {
  if (state_ != MissionState::kExplore) return;
  waits_ = decision.kind == DecisionKind::kWait;
  decided_ |= !waits_;
  if (decision.kind == DecisionKind::kStop) {
    const auto reason = kStopReasonNames[static_cast<std::size_t>(decision.stop_reason)];
    events_(decision.stop_reason == StopReason::kBattery ? EventKind::kBattery
                                                         : EventKind::kMissionState,
            "stop exploring: " + std::string(reason));
    stop_exploring_ = true;
    home_in_reach_ = decision.energy.reaches_home();
  } else if (decision.kind == DecisionKind::kNewTarget || decision.kind == DecisionKind::kGoBack) {
    if (decision.kind == DecisionKind::kGoBack) {
      events_(EventKind::kRecovery, "cut off from what it explored: back to where it flew");
    }
    target_progress_ = TargetProgress::kUnderWay;
    request_ = {MotionRequest::Kind::kGoTo, decision.goal_O, 0, decision.sequence};
    events_(EventKind::kTargetSelected, describe(request_.goal_O));
  }
}

void Mission::return_to_land(const Inputs& inputs) {
  if (end_in_the_air(inputs)) return;
  enter(MissionState::kReturn, inputs);
  using LandAtStart = MissionConfig::LandAtStart;
  const bool asks = config_.land_at_start == LandAtStart::kIfInReach;
  if (asks && !home_in_reach_) {
    events_(EventKind::kBattery, "home is out of reach: lands where it can");
  }
  if (config_.land_at_start == LandAtStart::kTrue || (asks && home_in_reach_)) {
    go_home();
  } else {
    landing_query_.emplace();
  }
}

bool Mission::end_in_the_air(const Inputs& inputs) {
  if (!config_.remain_at_end || inputs.at_reserve) return false;
  events_(EventKind::kMissionState, "ends in the air");
  begin_hold({OperatorCommand::Kind::kHold, Vec3::Zero()}, inputs);
  return true;
}

void Mission::go_home() {
  landing_query_.reset();  // whatever was asked before
  landing_.reset();
  has_answer_ = false;
  request_ = {MotionRequest::Kind::kGoTo, home_O_};
  events_(EventKind::kTargetSelected, describe(request_.goal_O));
}

void Mission::land_on_command(const Inputs& inputs) {
  if (inputs.below != LandingGround::kObstructed) {
    enter(MissionState::kLand, inputs);
    return;
  }
  events_(EventKind::kRecovery, "not clear to land here: looks for a place");
  enter(MissionState::kReturn, inputs);
  landing_query_.emplace();
}

void Mission::answer(const std::optional<LandingPlace>& place) {
  if (!landing_query_) return;  // it has thought better of it
  landing_query_.reset();
  landing_ = place;
  has_answer_ = true;
}

void Mission::fly_to_landing(const Inputs& inputs) {
  if (landing_query_) return;
  if (std::exchange(has_answer_, false)) {
    if (!landing_ || landing_->kind == LandingPlace::Kind::kWidest) {
      end_stuck("no_landing_place");
    } else if (landing_->kind == LandingPlace::Kind::kToBeSeen) {
      events_(EventKind::kRecovery, "no clear place to land is known: looks at one");
    }
    if (!landing_) {
      enter(MissionState::kLand, inputs);
      return;
    }
    request_ = {MotionRequest::Kind::kGoTo, landing_->p_O};
    events_(EventKind::kTargetSelected, describe(request_.goal_O));
    return;
  }
  if (inputs.progress == MotionProgress::kArrived) {
    reach(inputs);
    const bool clear = !landing_ || landing_->kind == LandingPlace::Kind::kWidest ||
                       inputs.below == LandingGround::kClear;
    clear ? enter(MissionState::kLand, inputs) : try_another_landing(inputs);
  } else if (inputs.progress == MotionProgress::kFailed) {
    fail_to_return(inputs);
  }
}

void Mission::fail_to_return(const Inputs& inputs) {
  events_(EventKind::kStuck, std::string(inputs.cause));
  if (!landing_ && ++returns_ < config_.return_tries) {
    events_(EventKind::kRecovery, "another way home");
    request_.attempt = returns_;
    return;
  }
  if (!landing_ && stuck_.empty()) stuck_ = inputs.cause;
  try_another_landing(inputs);
}

void Mission::try_another_landing(const Inputs& inputs) {
  const bool was_last = landing_ && landing_->kind == LandingPlace::Kind::kWidest;
  if (was_last) {
    enter(MissionState::kLand, inputs);
    return;
  }
  if (landing_) landings_tried_.push_back(landing_->p_O.head<2>());
  events_(EventKind::kRecovery, "another place to land");
  landing_query_ = {landings_tried_,
                    static_cast<int>(landings_tried_.size()) >= config_.landing.tries};
}

// Each rate for a while, with as long a rest at zero rate after it.
void Mission::spin(const Inputs& inputs) {
  const Stamp phase = (inputs.now - state_since_) / from_seconds(config_.yaw_burst_s);
  const auto burst = static_cast<std::size_t>(phase / 2);
  if (burst >= config_.yaw_rates_radps.size()) {
    if (!end_in_the_air(inputs)) land_on_command(inputs);
    return;
  }
  const double rate = phase % 2 == 0 ? config_.yaw_rates_radps[burst] : 0.0;
  if (request_.kind == MotionRequest::Kind::kSpin && request_.yaw_rate_radps == rate) return;
  request_ = {MotionRequest::Kind::kSpin, request_.goal_O, rate};
  events_(EventKind::kTargetSelected, fmt::format("yaw rate {:.2f} rad/s", rate));
}

bool Mission::has_arrived(const Inputs& inputs) {
  return rests(inputs,
               (inputs.odometry.X_OB.p - request_.goal_O).norm() < config_.arrival_radius_m);
}

bool Mission::rests(const Inputs& inputs, bool inside) {
  if (!inside || inputs.odometry.v_OB.norm() >= config_.arrival_speed_mps) {
    inside_since_ = -1;
    return false;
  }
  if (inside_since_ < 0) inside_since_ = inputs.now;
  return inputs.now - inside_since_ >= from_seconds(config_.hold_s);
}

void Mission::hear(const OperatorMessage& message, Stamp now) {
  heard_ = now;
  if (std::exchange(link_lost_, false)) events_(EventKind::kOperator, "link is back");
  if (message.command) command_ = message.command;
}

void Mission::watch_link(const Inputs& inputs) {
  if (heard_ < 0 || link_lost_ || inputs.now - heard_ < from_seconds(config_.link.timeout_s)) {
    return;
  }
  link_lost_ = true;
  const auto names = enum_names(config_.link.lost);
  events_(EventKind::kOperator,
          "link lost: " + std::string(names[static_cast<std::size_t>(config_.link.lost)]));
  const bool comes_down =
      state_ == MissionState::kReturn || !inputs.armed;  // as it is asked to, or was
  if (comes_down || config_.link.lost == LinkConfig::Lost::kContinue) return;
  command_ = {config_.link.lost == LinkConfig::Lost::kReturn ? OperatorCommand::Kind::kReturn
                                                             : OperatorCommand::Kind::kLand,
              Vec3::Zero()};
}

void Mission::obey(const Inputs& inputs) {
  const std::optional<OperatorCommand> command = std::exchange(command_, std::nullopt);
  if (!command) return;
  const std::string name(enum_names(command->kind)[static_cast<std::size_t>(command->kind)]);
  const bool flies = inputs.armed && state_ != MissionState::kInitialise &&
                     state_ != MissionState::kLand && state_ != MissionState::kLost &&
                     state_ != MissionState::kDone;
  const bool resumes = command->kind == OperatorCommand::Kind::kResume;
  if (!flies || (resumes && state_ != MissionState::kHold)) {
    events_(EventKind::kOperator,
            name + " refused in state " +
                std::string(kMissionStateNames[static_cast<std::size_t>(state_)]));
    return;
  }
  events_(EventKind::kOperator, name);
  blind_ = false;  // the operator's word counts
  resumes ? resume(inputs) : begin_hold(*command, inputs);
}

void Mission::begin_hold(const OperatorCommand& command, const Inputs& inputs) {
  if (state_ != MissionState::kHold) {
    held_ = state_;
    held_request_ = request_;
  }
  asked_ = command;
  enter(MissionState::kHold, inputs);
}

void Mission::resume(const Inputs& inputs) {
  state_ = held_;
  request_ = held_request_;
  inside_since_ = -1;
  progress_.begin(inputs.now);
  events_(EventKind::kMissionState,
          std::string(kMissionStateNames[static_cast<std::size_t>(state_)]));
}

// Whatever is asked, it comes to rest first.
void Mission::hold(const Inputs& inputs) {
  if (inputs.at_reserve && asked_.kind != OperatorCommand::Kind::kLand) {
    events_(EventKind::kBattery, "at the reserve: lands");
    asked_ = {OperatorCommand::Kind::kLand, Vec3::Zero()};
    enter(MissionState::kHold, inputs);
  }
  if (request_.kind == MotionRequest::Kind::kHold) {
    if (rests(inputs, true)) do_as_asked(inputs);
  } else if (inputs.progress == MotionProgress::kArrived) {
    reach(inputs);
    begin_hold({OperatorCommand::Kind::kHold, Vec3::Zero()}, inputs);
  } else if (inputs.progress == MotionProgress::kFailed) {
    events_(EventKind::kStuck, std::string(inputs.cause));
    events_(EventKind::kTargetDropped, describe(request_.goal_O));
    begin_hold({OperatorCommand::Kind::kHold, Vec3::Zero()}, inputs);
  }
}

void Mission::do_as_asked(const Inputs& inputs) {
  switch (asked_.kind) {
    case OperatorCommand::Kind::kLand:
      request_.goal_O = inputs.odometry.X_OB.p;
      land_on_command(inputs);
      break;
    case OperatorCommand::Kind::kReturn:
      enter(MissionState::kReturn, inputs);
      go_home();
      break;
    case OperatorCommand::Kind::kGoTo:
      request_ = {MotionRequest::Kind::kGoTo, asked_.goal_O, 0, ++orders_};
      events_(EventKind::kTargetSelected, describe(request_.goal_O));
      break;
    case OperatorCommand::Kind::kHold:
    case OperatorCommand::Kind::kResume:
      break;
  }
}

}  // namespace arex
