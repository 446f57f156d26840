#include "stack/stack.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace arex {
Stack::Stack(const StackConfig& config, JobQueue& jobs)
    : config_(config),
      jobs_(jobs),
      lidar_inertial_(config.odometry.lidar_inertial, config.vehicle),
      odometry_lane_(jobs.add_lane("odometry")),
      cloud_(config.mapping.cloud),
      cloud_lane_(jobs.add_lane("cloud")),
      mission_(config.mission,
               [this](EventKind kind, const std::string& detail) {
                 events_.push_back({now_, kind, detail});
               }),
      motion_(config.path, config.caution),
      tracker_(config.control, config.vehicle),
      control_period_(from_seconds(1 / config.control.rate_hz)) {}

void Stack::add_imu(const ImuSample& imu) {
  if (config_.odometry.source == OdometryConfig::Source::kLidarInertial) {
    set_odometry(lidar_inertial_.add_imu(imu));
  } else {
    odometry_.w_OB_B = imu.gyro_radps;
  }
}

void Stack::add_autopilot(const AutopilotStatus& status) { autopilot_ = status; }

void Stack::add_mocap(const MocapSample& mocap) {
  if (config_.odometry.source != OdometryConfig::Source::kMocap) return;
  Odometry odometry = odometry_;
  odometry.stamp = odometry.correction_stamp = mocap.stamp;
  odometry.X_OB = mocap.X_OB;
  odometry.v_OB = mocap.v_OB;
  odometry.status = OdometryStatus::kOk;
  set_odometry(odometry);
}

void Stack::add_scan(const LidarScanPtr& scan) {
  if (config_.odometry.source != OdometryConfig::Source::kLidarInertial) return;
  jobs_.start(odometry_lane_, now_, from_seconds(config_.odometry.latency_s),
              [this, job = lidar_inertial_.prepare(scan)]() -> JobQueue::Delivery {
                return [this, update = lidar_inertial_.correct(job)] {
                  lidar_inertial_.apply(update);
                  set_odometry(lidar_inertial_.odometry());
                  map(update);
                };
              });
}

void Stack::map(const ScanUpdate& update) {
  if (!update.points_O || update.points_O->empty()) return;
  jobs_.start(cloud_lane_, now_, 0,
              [this, points = update.points_O, p_OB = update.state.p_OB.cast<float>().eval(),
               range = static_cast<float>(config_.mapping.cloud_range_m)]() -> JobQueue::Delivery {
                std::vector<Vec3f> near;
                near.reserve(points->size());
                std::copy_if(points->begin(), points->end(), std::back_inserter(near),
                             [&](const Vec3f& p) { return (p - p_OB).norm() <= range; });
                cloud_.insert(near);
                return nullptr;
              });
}

void Stack::add_depth(const DepthImagePtr& depth) { depth_ = depth; }

bool Stack::accepts_depth(Stamp stamp) {
  if (!config_.mapping.use_depth || stamp < next_depth_) return false;
  next_depth_ += from_seconds(1 / config_.mapping.depth_rate_hz);
  return true;
}

std::optional<AttitudeCommand> Stack::tick() {
  if (now_ < next_control_) return std::nullopt;
  next_control_ += control_period_;
  const MotionRequest request =
      mission_.update({now_, odometry_, autopilot_.ready, autopilot_.armed});
  setpoint_ = motion_.update(now_, request, odometry_, autopilot_.follows);
  return control(request);
}

void Stack::set_odometry(const Odometry& odometry) {
  if (odometry.status != odometry_.status) {
    events_.push_back(
        {now_, EventKind::kOdometryStatus,
         std::string(kOdometryStatusNames[static_cast<std::size_t>(odometry.status)])});
  }
  odometry_ = odometry;
}

std::vector<Event> Stack::take_events() { return std::exchange(events_, {}); }

AttitudeCommand Stack::control(const MotionRequest& request) {
  AttitudeCommand command;
  command.stamp = now_;
  switch (request.kind) {
    case MotionRequest::Kind::kNone:
      return command;  // disarmed
    case MotionRequest::Kind::kDescend:
      command.mode = AutopilotMode::kDescend;
      return command;
    case MotionRequest::Kind::kLevel:
      tracker_.reset();
      command.mode = AutopilotMode::kAttitude;
      command.R_AB_desired = so3::from_yaw(so3::yaw(autopilot_.attitude.R_AB));
      command.thrust_n = config_.vehicle.mass_kg * kGravity;
      return command;
    default:
      break;
  }
  const TrackerOutput output = tracker_.update(setpoint_, odometry_, !autopilot_.landed);
  const Mat3 R_AO = heading_between(autopilot_.attitude.R_AB, odometry_.X_OB.R);
  command.mode = AutopilotMode::kAttitude;
  command.R_AB_desired = R_AO * output.R_OB_desired;
  command.yaw_rate_radps = output.yaw_rate_radps;
  command.thrust_n = output.thrust_n;
  return command;
}

}  // namespace arex
