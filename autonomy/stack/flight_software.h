#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "exploration/explorer.h"
#include "mapping/local_grid.h"
#include "mapping/mapper.h"
#include "mapping/point_cloud_map.h"
#include "messages/commands.h"
#include "messages/estimates.h"
#include "messages/events.h"
#include "messages/odometry_need.h"
#include "messages/operator.h"
#include "messages/registered_scan.h"
#include "messages/sensors.h"
#include "messages/stereo_image.h"
#include "messages/visual_tracks.h"
#include "mission/mission.h"
#include "planning/local_planner.h"

namespace arex {

/// The newest estimate of an odometry source.
struct NamedOdometry {
  std::string_view name;
  const Odometry* odometry = nullptr;
  std::optional<VisualTally> tally{};  ///< of a visual one
};

/// What onlookers may see of the flight software between two ticks. Refers to it: to be asked for
/// anew each time.
struct FlightView {
  const Odometry& odometry;            ///< that it flies on
  std::vector<NamedOdometry> others;   ///< sources that run beside
  const TrajectorySetpoint& setpoint;  ///< where it means to be
  MissionState state;
  bool lost;                                     ///< it ended without odometry
  std::string_view stuck;                        ///< why the mission failed; empty: it did not
  std::span<const MissionTarget> targets;        ///< reached, in order
  const Vec3& goal_O;                            ///< of the newest request
  std::shared_ptr<const GridSnapshot> grid;      ///< null before the first
  std::shared_ptr<const OccupancyMap2D> map_2d;  ///< null before the first
  double known_volume_m3;                        ///< when map_2d was taken
  const PlanCounts& plans;
  OdometryNeed need;                   ///< what keeps the odometry from being ok
  std::optional<VisualTally> tally{};  ///< of a visual odometry that was to fly from the start
};

/// The flight software as the vehicle around it knows it: fed with what the sensors deliver, in the
/// order of time, asked once a millisecond for a command. Nothing else of it is seen outside, so
/// that another may stand in its place.
class FlightSoftware {
 public:
  virtual ~FlightSoftware() = default;

  /// Sets the clock: what is fed or delivered from here on happens at `now`.
  virtual void begin(Stamp now) = 0;
  virtual void add_imu(const ImuSample& imu) = 0;                 ///< 200 Hz
  virtual void add_autopilot(const AutopilotStatus& status) = 0;  ///< 200 Hz
  virtual void add_battery(const BatterySample& battery) = 0;
  virtual void add_operator(const OperatorMessage& message) = 0;
  virtual void add_mocap(const MocapSample& mocap) = 0;
  virtual void add_scan(const LidarScanPtr& scan) = 0;
  virtual void add_depth(const DepthImagePtr& depth) = 0;
  virtual void add_images(const StereoImagePtr& /*images*/) {}
  /// Whether the frame that a camera exposed at `stamp` will be read; the driver drops the others.
  /// To be asked once for each frame. @param device its name, empty: the first
  [[nodiscard]] virtual bool accepts_depth(const std::string& device, Stamp stamp) = 0;

  /// Runs what is due. @return the newest command when there is one, at 100 Hz.
  virtual std::optional<AttitudeCommand> tick() = 0;

  /// What happened, and what the explorer decided, since the last call.
  virtual std::vector<Event> take_events() = 0;
  virtual std::vector<Decision> take_decisions() = 0;
  /// What the newest exposure showed to a visual odometry, if one has come since the last call.
  virtual std::vector<FeatureSight> take_features() { return {}; }

  [[nodiscard]] virtual FlightView view() const = 0;
  /// The way still to be flown as it is planned now, for pictures of it: a polyline in O from where
  /// the vehicle should be; empty where none is planned.
  [[nodiscard]] virtual std::vector<Vec3> planned_path() const { return {}; }
  /// What the view's grid was made from, for pictures of it; nothing where nobody keeps it.
  [[nodiscard]] virtual MappedFrames mapped_frames() const { return {}; }

  /// What is done with the cloud off the flight's thread, and then on it.
  using CloudReader = std::function<std::function<void()>(const PointCloudMap& cloud)>;
  /// Shows the global cloud as it is now, to be done with it by `due`: behind the insertions so
  /// far, before those to come.
  virtual void read_cloud(Stamp due, CloudReader reader) = 0;

  // When all of its jobs are done, at the end of a flight.
  [[nodiscard]] virtual const PointCloudMap& cloud() const = 0;
  [[nodiscard]] virtual const Mapper& mapper() const = 0;
};

}  // namespace arex
