#include "stack/stack.h"

#include <utility>

namespace arex {
namespace {

// A landing aims this far below where it starts: touchdown ends it, wherever the ground is.
constexpr double kLandingDepth = 100;

}  // namespace

Stack::Stack(const StackConfig& config, JobQueue& jobs)
    : config_(config),
      jobs_(jobs),
      mission_(config.mission,
               [this](EventKind kind, const std::string& detail) {
                 events_.push_back({now_, kind, detail});
               }),
      path_(config.path, Vec3::Zero(), 0),
      tracker_(config.control, config.vehicle),
      control_period_(from_seconds(1 / config.control.rate_hz)) {}

void Stack::add_imu(const ImuSample& imu) { odometry_.w_OB_B = imu.gyro_radps; }

void Stack::add_autopilot(const AutopilotStatus& status) { autopilot_ = status; }

void Stack::add_mocap(const MocapSample& mocap) {
  if (config_.odometry.source != OdometryConfig::Source::kMocap) return;
  odometry_.stamp = odometry_.correction_stamp = mocap.stamp;
  odometry_.X_OB = mocap.X_OB;
  odometry_.v_OB = mocap.v_OB;
  odometry_.status = OdometryStatus::kOk;
}

void Stack::add_scan(const LidarScanPtr& scan) { scan_ = scan; }

void Stack::add_depth(const DepthImagePtr& depth) { depth_ = depth; }

bool Stack::accepts_depth(Stamp stamp) {
  if (!config_.mapping.use_depth || stamp < next_depth_) return false;
  next_depth_ += from_seconds(1 / config_.mapping.depth_rate_hz);
  return true;
}

std::optional<AttitudeCommand> Stack::tick(Stamp now) {
  now_ = now;
  if (now < next_control_) return std::nullopt;
  next_control_ += control_period_;
  const MotionRequest request =
      mission_.update({now, odometry_, autopilot_.ready, autopilot_.armed});
  plan_motion(request, now);
  return control(request, now);
}

std::vector<Event> Stack::take_events() { return std::exchange(events_, {}); }

void Stack::plan_motion(const MotionRequest& request, Stamp now) {
  if (!(request == motion_)) {
    if (motion_.kind == MotionRequest::Kind::kNone) {
      path_ = TimedPath(config_.path, odometry_.X_OB.p, so3::yaw(odometry_.X_OB.R));
      tracker_.reset();
    } else {
      path_ = TimedPath(config_.path, path_.end(), path_.end_yaw_rad());
    }
    motion_ = request;
    path_start_ = -1;
    switch (request.kind) {
      case MotionRequest::Kind::kTakeoff:
        path_.climb_to(request.goal_O.z());
        break;
      case MotionRequest::Kind::kGoTo:
        path_.fly_to(request.goal_O);
        break;
      case MotionRequest::Kind::kLand:
        path_.land_to(path_.end().z() - kLandingDepth);
        break;
      case MotionRequest::Kind::kNone:
        break;
    }
  }
  // The path begins once the autopilot follows: the spin-up is not flown.
  if (path_start_ < 0 && autopilot_.follows) path_start_ = now;
  setpoint_ = path_.sample(path_start_ < 0 ? 0.0 : to_seconds(now - path_start_));
}

AttitudeCommand Stack::control(const MotionRequest& request, Stamp now) {
  AttitudeCommand command;
  command.stamp = now;
  if (request.kind == MotionRequest::Kind::kNone) return command;  // disarmed
  const TrackerOutput output = tracker_.update(setpoint_, odometry_, !autopilot_.landed);
  const Mat3 R_AO = heading_between(autopilot_.attitude.R_AB, odometry_.X_OB.R);
  command.mode = AutopilotMode::kAttitude;
  command.R_AB_desired = R_AO * output.R_OB_desired;
  command.yaw_rate_radps = output.yaw_rate_radps;
  command.thrust_n = output.thrust_n;
  return command;
}

}  // namespace arex
