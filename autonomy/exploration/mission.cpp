#include "exploration/mission.h"

#include <cstdio>
#include <utility>

namespace arex {
namespace {

std::string describe(const Vec3& p) {
  std::array<char, 96> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%.2f %.2f %.2f", p.x(), p.y(), p.z());
  return buffer.data();
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
  switch (state_) {
    case MissionState::kInitialise:
      if (inputs.now >= from_seconds(config_.settle_s) && inputs.autopilot_ready &&
          inputs.odometry.status == OdometryStatus::kOk) {
        enter(MissionState::kTakeoff, inputs);
      }
      break;
    case MissionState::kTakeoff:
      if (has_arrived(inputs)) {
        enter(config_.waypoints_m.empty() ? MissionState::kLand : MissionState::kFly, inputs);
      }
      break;
    case MissionState::kFly:
      if (has_arrived(inputs)) {
        targets_.push_back({request_.goal_O, inputs.now});
        events_(EventKind::kTargetReached, describe(request_.goal_O));
        if (waypoint_ + 1 < config_.waypoints_m.size()) {
          select_waypoint(waypoint_ + 1);
        } else {
          enter(MissionState::kLand, inputs);
        }
      }
      break;
    case MissionState::kLand:
      if (!inputs.armed) enter(MissionState::kDone, inputs);
      break;
    case MissionState::kDone:
      break;
  }
  return request_;
}

void Mission::enter(MissionState state, const Inputs& inputs) {
  state_ = state;
  inside_since_ = -1;
  events_(EventKind::kMissionState,
          std::string(kMissionStateNames[static_cast<std::size_t>(state)]));
  switch (state) {
    case MissionState::kTakeoff:
      request_ = {MotionRequest::Kind::kTakeoff,
                  inputs.odometry.X_OB.p + config_.takeoff_height_m * Vec3::UnitZ()};
      break;
    case MissionState::kFly:
      select_waypoint(0);
      break;
    case MissionState::kLand:
      request_ = {MotionRequest::Kind::kLand, request_.goal_O};
      break;
    default:
      request_ = {};
  }
}

void Mission::select_waypoint(std::size_t index) {
  waypoint_ = index;
  inside_since_ = -1;
  request_ = {MotionRequest::Kind::kGoTo, config_.waypoints_m[index]};
  events_(EventKind::kTargetSelected, describe(request_.goal_O));
}

bool Mission::has_arrived(const Inputs& inputs) {
  const bool inside =
      (inputs.odometry.X_OB.p - request_.goal_O).norm() < config_.arrival_radius_m &&
      inputs.odometry.v_OB.norm() < config_.arrival_speed_mps;
  if (!inside) {
    inside_since_ = -1;
    return false;
  }
  if (inside_since_ < 0) inside_since_ = inputs.now;
  return inputs.now - inside_since_ >= from_seconds(config_.hold_s);
}

}  // namespace arex
