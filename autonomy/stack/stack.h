#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <vector>

#include "control/tracker.h"
#include "exploration/mission.h"
#include "mapping/point_cloud_map.h"
#include "messages/commands.h"
#include "messages/estimates.h"
#include "messages/events.h"
#include "messages/sensors.h"
#include "messages/vehicle.h"
#include "odometry/lidar_inertial_odometry.h"
#include "stack/job_queue.h"
#include "stack/leg_motion.h"

namespace arex {

struct OdometryConfig {
  enum class Source { kLidarInertial, kMocap };
  friend constexpr std::array<std::string_view, 2> enum_names(Source) {
    return {"lidar_inertial", "mocap"};
  }

  Source source = Source::kLidarInertial;
  double latency_s = 0.020;  ///< modelled compute time of a scan update
  LidarInertialConfig lidar_inertial;

  void fields(auto& f) {
    f("source", source, "where pose and velocity come from; mocap is the oracle, for ablation");
    f("latency_s", latency_s, "modelled compute time of a scan update");
    f("lidar_inertial", lidar_inertial, "LiDAR-inertial odometry");
    f.check(latency_s >= 0, "latency_s >= 0");
  }
};

struct MappingConfig {
  bool use_depth = true;
  double depth_rate_hz = 10;
  double cloud_range_m = 20;  ///< angle noise of 0.1 deg spreads what lies further over a voxel
  PointCloudMapConfig cloud;

  void fields(auto& f) {
    f("use_depth", use_depth, "read the depth camera");
    f("depth_rate_hz", depth_rate_hz, "depth frames read; the others are never rendered");
    f("cloud_range_m", cloud_range_m, "points further from the vehicle wait until it is nearer");
    f("cloud", cloud, "global point cloud");
    f.check(cloud_range_m > 0, "cloud_range_m > 0");
    f.check(depth_rate_hz > 0 && depth_rate_hz <= 30, "0 < depth_rate_hz <= 30");
  }
};

/// Everything that can be set in the flight software, by module.
struct StackConfig {
  VehicleConfig vehicle;
  OdometryConfig odometry;
  MappingConfig mapping;
  MissionConfig mission;
  TimedPathConfig path;
  CautionConfig caution;
  TrackerConfig control;

  void fields(auto& f) {
    f("vehicle", vehicle, "what the stack believes of its vehicle");
    f("odometry", odometry, "pose and velocity");
    f("mapping", mapping, "maps of the surroundings");
    f("mission", mission, "what to do");
    f("path", path, "timed paths along straight legs");
    f("caution", caution, "answers to a weak odometry");
    f("control", control, "trajectory tracking");
  }
};

/// The flight software on the companion computer, wired top to bottom:
///
///   IMU, LiDAR, depth, mocap -> odometry -> mission -> path -> tracker -> attitude and thrust
///
/// Fed by its caller with what the sensors deliver, in order of time; asked once a millisecond for
/// a command. Heavy work goes through the job queue.
class Stack {
 public:
  Stack(const StackConfig& config, JobQueue& jobs);

  /// Sets the clock: what is fed or delivered from here on happens at `now`.
  void begin(Stamp now) { now_ = now; }

  void add_imu(const ImuSample& imu);                 ///< 200 Hz
  void add_autopilot(const AutopilotStatus& status);  ///< 200 Hz
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
  /// The global point cloud, in O. It belongs to its lane: read it in a job of that lane, or when
  /// the jobs are drained.
  [[nodiscard]] const PointCloudMap& cloud() const { return cloud_; }
  [[nodiscard]] JobQueue::Lane cloud_lane() const { return cloud_lane_; }
  /// What happened since the last call.
  std::vector<Event> take_events();

 private:
  void set_odometry(const Odometry& odometry);
  void map(const ScanUpdate& update);
  AttitudeCommand control(const MotionRequest& request);

  StackConfig config_;
  JobQueue& jobs_;
  std::vector<Event> events_;
  Stamp now_ = 0;

  LidarInertialOdometry lidar_inertial_;
  JobQueue::Lane odometry_lane_;
  PointCloudMap cloud_;
  JobQueue::Lane cloud_lane_;
  Odometry odometry_;
  AutopilotStatus autopilot_;
  Mission mission_;

  LegMotion motion_;
  TrajectorySetpoint setpoint_;
  Tracker tracker_;
  Stamp control_period_;
  Stamp next_control_ = 0;
  Stamp next_depth_ = 0;
  DepthImagePtr depth_;  ///< newest
};

}  // namespace arex
