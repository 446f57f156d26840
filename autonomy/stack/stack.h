#pragma once

#include <optional>
#include <vector>

#include "control/tracker.h"
#include "exploration/explorer.h"
#include "exploration/mission.h"
#include "messages/commands.h"
#include "messages/estimates.h"
#include "messages/events.h"
#include "messages/sensors.h"
#include "odometry/lidar_inertial_odometry.h"
#include "stack/job_queue.h"
#include "stack/leg_motion.h"
#include "stack/lidar_watch.h"
#include "stack/navigator.h"
#include "stack/perception.h"
#include "stack/stack_config.h"

namespace arex {

/// The flight software on the companion computer, wired top to bottom:
///
///   IMU, LiDAR, mocap -> odometry -> perception (maps) -> explorer -> mission
///                                        |                              |
///                                     navigator, legs  <- motion request
///                                        |
///                                     tracker -> attitude and thrust
///
/// Fed by its caller with what the sensors deliver, in order of time; asked once a millisecond for
/// a command. Heavy work goes through the job queue.
class Stack {
 public:
  /// @param seed of the planner's and the explorer's random streams
  Stack(const StackConfig& config, JobQueue& jobs, std::uint64_t seed);

  /// Sets the clock: what is fed or delivered from here on happens at `now`.
  void begin(Stamp now) { now_ = now; }

  void add_imu(const ImuSample& imu);                 ///< 200 Hz
  void add_autopilot(const AutopilotStatus& status);  ///< 200 Hz
  void add_battery(const BatterySample& battery);
  void add_mocap(const MocapSample& mocap);
  void add_scan(const LidarScanPtr& scan);  ///< 10 Hz
  void add_depth(const DepthImagePtr& depth);
  /// Whether the frame exposed at `stamp` will be read; the driver drops the others. To be asked
  /// once for each frame.
  [[nodiscard]] bool accepts_depth(Stamp stamp);

  /// Runs what is due. @return the newest command when there is one, at 100 Hz.
  std::optional<AttitudeCommand> tick();

  [[nodiscard]] const Odometry& odometry() const { return odometry_; }
  [[nodiscard]] const TrajectorySetpoint& setpoint() const { return setpoint_; }
  [[nodiscard]] const Mission& mission() const { return mission_; }
  [[nodiscard]] const Perception& perception() const { return perception_; }
  [[nodiscard]] const Navigator& navigator() const { return navigator_; }
  /// What happened, and what the explorer decided, since the last call.
  std::vector<Event> take_events();
  std::vector<Decision> take_decisions();

 private:
  void report(EventKind kind, const std::string& detail);
  void set_odometry(const Odometry& odometry);
  [[nodiscard]] bool jumps_to(const Odometry& odometry) const;
  /// The pose has jumped: the map around the vehicle and the way through it begin anew.
  void start_again();
  /// The estimate as far as it can be believed now.
  [[nodiscard]] Odometry believed() const;
  [[nodiscard]] OdometryNeed odometry_need() const;
  void decide();
  void seek_landing();
  [[nodiscard]] LandingGround ground_below() const;
  TrajectorySetpoint move(const MotionRequest& request);
  AttitudeCommand control(const MotionRequest& request);

  StackConfig config_;
  JobQueue& jobs_;
  Stamp now_ = 0;
  std::vector<Event> events_;
  std::vector<Decision> decisions_;

  LidarInertialOdometry lidar_inertial_;
  JobQueue::Lane odometry_lane_;
  LidarWatch lidar_watch_;
  Odometry odometry_;
  AutopilotStatus autopilot_;
  ConsumptionModel energy_;

  Perception perception_;
  Explorer explorer_;
  JobQueue::Lane explorer_lane_;
  Stamp next_decision_ = 0;
  Mission mission_;
  LandingFinder landing_finder_;

  MotionRequest request_;  ///< the newest
  LegMotion legs_;
  Navigator navigator_;
  bool navigating_ = false;  ///< the navigator has the vehicle, not the legs
  TrajectorySetpoint setpoint_;
  Tracker tracker_;
  Stamp control_period_;
  Stamp next_control_ = 0;
  Stamp next_depth_ = 0;
};

}  // namespace arex
