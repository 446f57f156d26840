#pragma once

#include <algorithm>
#include <cmath>

#include "autopilot/autopilot.h"
#include "control/timed_path.h"
#include "control/tracker.h"
#include "physics/flexible_frame.h"
#include "physics/physics.h"
#include "sensors/imu.h"
#include "worlds/world.h"

namespace arex::sim::test {

/// A plane floor of 100 x 100 m through the origin that rises towards y.
inline worlds::World plane_world(double slope_rad) {
  worlds::World world;
  const Mat3 tilt = so3::Exp({slope_rad, 0, 0});
  world.objects.push_back({worlds::SurfaceClass::kGround, 0.3F});
  world.collision_shapes.push_back(
      {worlds::CollisionShape::Kind::kBox, {tilt, tilt * Vec3(0, 0, -0.25)}, {50, 50, 0.25}, 0});
  return world;
}

/// Physics, sensors, autopilot and tracker in lockstep. The pose comes as a tracking system would
/// give it; the attitude loop flies on the autopilot's own sensors. O is the starting pose
/// without its tilt.
class ClosedLoop {
 public:
  struct Options {
    PhysicsConfig physics;
    ImuConfig imu;
    AutopilotConfig autopilot;
    TrackerConfig tracker;
    double start_yaw_rad = 0.5;
    double ground_slope_rad = 0;
  };

  ClosedLoop(const Options& options, std::uint64_t seed)
      : world_(plane_world(options.ground_slope_rad)),
        X_WO_{so3::from_yaw(options.start_yaw_rad),
              so3::Exp({options.ground_slope_rad, 0, 0}) *
                  Vec3(0, 0, VehicleConfig{}.ground_offset_m)},
        physics(options.physics, world_,
                {so3::Exp({options.ground_slope_rad, 0, 0}) * X_WO_.R, X_WO_.p}, seed),
        frame(options.physics.frame, physics.airframe(), seed),
        imu(options.imu, seed),
        autopilot(options.autopilot, VehicleConfig{}),
        tracker(options.tracker, VehicleConfig{}) {}

  /// Stands disarmed until the autopilot is ready, and arms.
  [[nodiscard]] bool start() {
    const TimedPath stay(TimedPathConfig{}, Vec3::Zero(), 0);
    for (int i = 0; i < 8000; ++i) {
      const bool ready = autopilot.state() != AutopilotState::kInitialising;
      step(stay.sample(0), ready ? AutopilotMode::kAttitude : AutopilotMode::kDisarmed);
      if (autopilot.state() == AutopilotState::kOnGround) return true;
    }
    return false;
  }

  /// One tick; the tracker commands every ten.
  void step(const TrajectorySetpoint& setpoint, AutopilotMode mode = AutopilotMode::kAttitude) {
    sense();
    if (physics.truth().stamp % (10 * kNanosecondsPerTick) == 0) command(setpoint, mode);
    physics.step(autopilot.tick(physics.truth().stamp));
  }
  /// One tick in which nobody commands.
  void step_silent() {
    sense();
    physics.step(autopilot.tick(physics.truth().stamp));
  }

  [[nodiscard]] Odometry odometry() const {
    const Truth& truth = physics.truth();
    Odometry out;
    out.stamp = truth.stamp;
    out.X_OB = X_WO_.inverse() * truth.X_WB;
    out.v_OB = X_WO_.R.transpose() * truth.v_WB;
    out.w_OB_B = truth.w_WB_B;
    out.status = OdometryStatus::kOk;
    return out;
  }
  [[nodiscard]] double tilt_error() const {
    const Vec3 up_true = physics.truth().X_WB.R.row(2), up = autopilot.ahrs().R_AB().row(2);
    return std::atan2(up.cross(up_true).norm(), up.dot(up_true));
  }

 private:
  void sense() {
    const Truth& truth = physics.truth();
    if (!frame.stiff()) frame.step(truth);
    autopilot.add_imu(imu.sample(frame.stiff() ? truth : frame.plate()));
    if (imu.magnetometer()) autopilot.add_magnetometer(*imu.magnetometer());
    if (imu.barometer()) autopilot.add_barometer(*imu.barometer());
    if (truth.stamp % (20 * kNanosecondsPerTick) == 0) {
      const BatteryState& battery = physics.battery();
      autopilot.add_battery({truth.stamp, battery.voltage_v, battery.current_a});
    }
  }

  void command(const TrajectorySetpoint& setpoint, AutopilotMode mode) {
    const Odometry now = odometry();
    const bool in_flight = !autopilot.landed() && now.X_OB.p.z() > 0.05;
    const TrackerOutput out = tracker.update(setpoint, now, in_flight);
    AttitudeCommand command;
    command.stamp = now.stamp;
    command.mode = mode;
    command.R_AB_desired =
        heading_between(autopilot.attitude().R_AB, now.X_OB.R) * out.R_OB_desired;
    command.yaw_rate_radps = out.yaw_rate_radps;
    command.thrust_n = out.thrust_n;
    autopilot.command(command);
  }

  worlds::World world_;
  Pose X_WO_;

 public:
  Physics physics;
  FlexibleFrame frame;
  ImuModel imu;
  Autopilot autopilot;
  Tracker tracker;
};

/// Root mean square and maximum of a norm.
class ErrorStatistics {
 public:
  void add(double error) {
    sum_ += error * error;
    max_ = std::max(max_, error);
    ++count_;
  }
  [[nodiscard]] double rms() const { return std::sqrt(sum_ / std::max(count_, 1)); }
  [[nodiscard]] double max() const { return max_; }

 private:
  double sum_ = 0, max_ = 0;
  int count_ = 0;
};

}  // namespace arex::sim::test
