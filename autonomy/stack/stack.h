#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "control/tracker.h"
#include "exploration/landing.h"
#include "jobs/job_queue.h"
#include "mission/mission.h"
#include "odometry/odometry_source.h"
#include "stack/flight_software.h"
#include "stack/health_watch.h"
#include "stack/leg_motion.h"
#include "stack/lidar_watch.h"
#include "stack/navigator.h"
#include "stack/odometry_switch.h"
#include "stack/perception.h"
#include "stack/stack_config.h"
#include "stack/standing_faults.h"

namespace arex {

/// The flight software on the companion computer, wired top to bottom:
///
///   IMU, LiDAR, mocap -> odometry -> perception (maps) -> explorer -> mission
///                                        |                              |
///                                     navigator, legs  <- motion request
///                                        |
///                                     tracker -> attitude and thrust
///
/// The first of its odometry sources flies the vehicle; others run beside, each in a lane of its
/// own, and those that `odometry.failover` names take over when it is lost. Heavy work goes through
/// the job queue.
class Stack : public FlightSoftware {
 public:
  /// @param seed of the planner's and the explorer's random streams
  /// @pre the modules that `config` names exist (check_modules)
  Stack(const StackConfig& config, JobQueue& jobs, std::uint64_t seed);

  void begin(Stamp now) override { now_ = now; }
  void add_imu(const ImuSample& imu) override;
  void add_autopilot(const AutopilotStatus& status) override;
  void add_battery(const BatterySample& battery) override;
  void add_operator(const OperatorMessage& message) override { mission_.hear(message, now_); }
  void add_mocap(const MocapSample& mocap) override;
  void add_scan(const LidarScanPtr& scan) override;
  void add_depth(const DepthImagePtr& depth) override;
  void add_images(const StereoImagePtr& images) override;
  [[nodiscard]] bool accepts_depth(const std::string& device, Stamp stamp) override;
  std::optional<AttitudeCommand> tick() override;
  std::vector<Event> take_events() override;
  std::vector<Decision> take_decisions() override;
  std::vector<FeatureSight> take_features() override;
  [[nodiscard]] FlightView view() const override;
  [[nodiscard]] std::vector<Vec3> planned_path() const override;
  [[nodiscard]] MappedFrames mapped_frames() const override { return perception_.frames(); }
  void read_cloud(Stamp due, CloudReader reader) override;
  [[nodiscard]] const PointCloudMap& cloud() const override { return perception_.cloud(); }
  [[nodiscard]] const Mapper& mapper() const override { return perception_.mapper(); }

 private:
  struct Source {
    std::string name;
    std::unique_ptr<OdometrySource> odometry;
    JobQueue::Lane lane;
    Stamp latency;
  };

  std::vector<Source> make_sources();
  Source make_source(const std::string& name, const std::string& lane);
  /// Has the source's job done in its lane.
  void start(Source& source, std::optional<OdometrySource::Job> job);
  /// Takes what a source has found out since it was last asked.
  void collect(Source& source);
  [[nodiscard]] Source& flying() { return sources_[switch_.flying()]; }
  [[nodiscard]] const Source& flying() const { return sources_[switch_.flying()]; }
  /// Hands over to another source when the flying one has failed, or back.
  void choose_source();
  void report(EventKind kind, const std::string& detail);
  [[nodiscard]] ExpectedSensors sensors_read() const;
  void watch_health();
  void set_odometry(const Odometry& odometry);
  [[nodiscard]] bool jumps_to(const Odometry& odometry) const;
  /// The pose has jumped: the map around the vehicle and the way through it begin anew.
  void start_again(Stamp jumped_at);
  /// The estimate as far as it can be believed now.
  [[nodiscard]] Odometry checked_odometry() const;
  [[nodiscard]] OdometryNeed odometry_need() const;
  void decide();
  void seek_landing();
  [[nodiscard]] LandingGround ground_below() const;
  [[nodiscard]] bool at_reserve() const;
  TrajectorySetpoint move(const MotionRequest& request);
  AttitudeCommand control(const MotionRequest& request);

  StackConfig config_;
  std::uint64_t seed_;
  JobQueue& jobs_;
  Stamp now_ = 0;
  std::vector<Event> events_;
  std::vector<Decision> decisions_;

  std::vector<Source> sources_;  ///< the first flies; those that may take over come next
  std::size_t may_fly_ = 1;      ///< so many of them, from the first on
  OdometrySwitch switch_;
  LidarWatch lidar_watch_;
  LidarScanPtr last_scan_;  ///< of the first LiDAR
  HealthWatch health_watch_;
  StandingFaults faults_;  ///< those told so far
  Odometry odometry_;
  AutopilotStatus autopilot_;
  ConsumptionModel energy_;

  Perception perception_;
  std::unique_ptr<Explorer> explorer_;
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
  std::map<std::string, Stamp> next_depth_;  ///< by device
};

}  // namespace arex
