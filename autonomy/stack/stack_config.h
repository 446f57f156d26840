#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "config/config.h"
#include "control/timed_path.h"
#include "control/tracker.h"
#include "exploration/explorer_config.h"
#include "mapping/mapping_config.h"
#include "mapping/point_cloud_map.h"
#include "messages/vehicle.h"
#include "mission/mission.h"
#include "odometry/lidar_inertial_config.h"
#include "odometry/visual/visual_inertial_config.h"
#include "planning/guide_path.h"
#include "planning/replan_machine.h"
#include "stack/health_watch_config.h"
#include "stack/leg_motion.h"
#include "stack/lidar_watch.h"
#include "stack/odometry_switch.h"

namespace arex {

/// The type of the odometry on the infrared pair.
inline constexpr std::string_view kVisualInertial = "visual_inertial";

/// A further odometry source: its type, and the parameters of that type.
struct OdometrySection {
  std::string type;
  std::optional<double> latency_s;
  ConfigNode own;  ///< what is the type's own

  void read(std::string_view name, const ConfigNode& section);
  [[nodiscard]] std::vector<ParameterInfo> parameters() const;
};

/// The parameters of a module that a plug-in brought, under its name.
struct ModuleSection {
  std::string name;
  ConfigNode own;

  void read(std::string_view name, const ConfigNode& section);
  [[nodiscard]] std::vector<ParameterInfo> parameters() const;
};

struct OdometryConfig {
  std::string source = "lidar_inertial";
  double latency_s = 0.020;  ///< modelled compute time of a scan update
  LidarInertialConfig lidar_inertial;
  VisualInertialConfig visual_inertial;
  std::vector<std::string> failover;
  FailoverConfig handover;
  LidarWatchConfig watch;
  /// A step of the pose beyond this has moved the local map out of its place: three of its cells,
  /// what the inflation leaves beside the vehicle.
  double jump_m = 0.3;

  void fields(auto& f) {
    f("source", source,
      "where pose and velocity come from: a type (lidar_inertial|visual_inertial|mocap), or a name "
      "under odometries; mocap is the oracle, for ablation");
    f("latency_s", latency_s, "modelled compute time of a scan update");
    f("lidar_inertial", lidar_inertial, "LiDAR-inertial odometry");
    f("visual_inertial", visual_inertial, "visual-inertial odometry on the infrared pair");
    f("failover", failover,
      "sources that may fly, the first while it can: [lidar_inertial, visual_inertial]; each a "
      "type "
      "or a name under odometries. Empty: source alone");
    f("handover", handover, "from one of these to another");
    f("jump_m", jump_m, "a step of the pose beyond this makes the local grid and the plan anew");
    f("watch", watch, "when the LiDAR is called faulty");
    f.check(latency_s >= 0 && latency_s <= 60, "0 <= latency_s <= 60");
    f.check(jump_m > 0, "jump_m > 0");
    f.check(failover.empty() || failover.front() == source,
            "failover empty, or with source as its first");
    f.check(std::set<std::string>(failover.begin(), failover.end()).size() == failover.size(),
            "failover without a name twice");
  }
};

struct MappingConfig {
  static constexpr double kMostLocalCells = 4e7;    ///< 15 bytes each, copied for every plan
  static constexpr double kMostGlobalCells = 1e10;  ///< 160 MB before the first is seen
  static constexpr double kOctomapReach = 32767;    ///< its keys have 16 bits an axis

  bool enabled = true;
  double resolution_m = 0.1;  ///< paper, III-A
  double latency_s = 0.020;   ///< modelled compute time of one frame
  std::string lidar;          ///< empty: every one
  double depth_rate_hz = 10;
  double map_2d_rate_hz = 2;
  double cloud_range_m = 20;  ///< angle noise of 0.1 deg spreads what lies further over a voxel
  PointCloudMapConfig cloud;
  LocalGridConfig local;  ///< its keys stand directly under `mapping`
  GlobalMapConfig global;

  void fields(auto& f) {
    f("enabled", enabled, "local grid, OctoMap and 2D map: what the planner and the explorer need");
    f("resolution_m", resolution_m, "of the grids (paper, III-A)");
    f("latency_s", latency_s, "modelled compute time of one frame");
    f("lidar", lidar,
      "name under devices of the only LiDAR whose frames the maps take; empty: they take every "
      "one's");
    f("depth_rate_hz", depth_rate_hz, "depth frames read; the others are never rendered");
    f("map_2d_rate_hz", map_2d_rate_hz, "how often the 2D map is handed on");
    f("cloud_range_m", cloud_range_m, "points further from the vehicle wait until it is nearer");
    f("cloud", cloud, "global point cloud");
    local.fields(f);
    f("global", global, "OctoMap and 2D occupancy of the mission");
    f.check(resolution_m >= 0.02 && resolution_m <= 1, "0.02 <= resolution_m <= 1");
    const double cells_m3 = std::pow(resolution_m, 3);
    f.check(local.size_m.prod() <= kMostLocalCells * cells_m3,
            "size_m / resolution_m at most 4e7 cells in all");
    f.check((global.high_m - global.low_m).prod() <= kMostGlobalCells * cells_m3,
            "(global.high_m - global.low_m) / resolution_m at most 1e10 cells in all");
    f.check(std::max(global.low_m.cwiseAbs().maxCoeff(), global.high_m.cwiseAbs().maxCoeff()) <=
                kOctomapReach * resolution_m,
            "global.low_m, global.high_m within 32767 resolution_m of the start (OctoMap)");
    f.check(latency_s >= 0 && latency_s <= 60, "0 <= latency_s <= 60");
    f.check(depth_rate_hz > 0 && depth_rate_hz <= 30, "0 < depth_rate_hz <= 30");
    f.check(map_2d_rate_hz > 0 && map_2d_rate_hz <= 1000, "0 < map_2d_rate_hz <= 1000");
    f.check(cloud_range_m > 0 && cloud_range_m <= 1000, "0 < cloud_range_m <= 1000");
  }

  /// Whether frames of this LiDAR go into the maps. @param device its name, empty: the first
  [[nodiscard]] bool takes(std::string_view device) const {
    return lidar.empty() || lidar == device;
  }
};

struct PlanningConfig {
  double inflation_m = 0.5;      ///< obstacle expansion, each axis (paper, III-A)
  double ceiling_m = 10;         ///< z in O, as a geofence's height is above home
  double floor_m = -20;          ///< z in O
  double guide_rate_hz = 1.0;    ///< a new guide while the map grows
  double guide_latency_s = 0.1;  ///< modelled compute time of a guide
  ReplanConfig replan;
  std::string strategy = "bspline";
  LocalPlannerConfig local;
  YawConfig yaw;
  GuideConfig guide;

  void fields(auto& f) {
    f("inflation_m", inflation_m, "obstacle expansion, each axis (paper, III-A)");
    f("ceiling_m", ceiling_m,
      "highest z in O (above where the vehicle stood) of goals and planned ways, whatever the "
      "ground below does");
    f("floor_m", floor_m, "lowest z in O of goals and planned ways");
    f("guide_rate_hz", guide_rate_hz, "how often the guide follows the growing map");
    f("guide_latency_s", guide_latency_s, "modelled compute time of a guide");
    f("replan", replan, "replanning state machine");
    f("strategy", strategy, "who makes trajectories within the local grid (bspline, or a plug-in)");
    f("local", local, "B-spline planner");
    f("yaw", yaw, "heading on planned ways");
    f("guide", guide, "global guide path");
    f.check(inflation_m >= 0 && inflation_m <= 2, "0 <= inflation_m <= 2");
    f.check(floor_m < ceiling_m, "floor_m < ceiling_m");
    f.check(guide_rate_hz > 0 && guide_rate_hz <= 1000, "0 < guide_rate_hz <= 1000");
    f.check(guide_latency_s >= 0 && guide_latency_s <= 60, "0 <= guide_latency_s <= 60");
  }
};

struct ExplorationConfig {
  std::string strategy = "revenue";
  double decision_rate_hz = 1.0;
  double latency_s = 0.05;  ///< modelled compute time of a decision
  ExplorerConfig explorer;  ///< its keys stand directly under `exploration`

  void fields(auto& f) {
    f("strategy", strategy, "who chooses the next goal (revenue|nearest, or a plug-in)");
    f("decision_rate_hz", decision_rate_hz, "how often the explorer looks at its target");
    f("latency_s", latency_s, "modelled compute time of a decision");
    explorer.fields(f);
    f.check(decision_rate_hz > 0 && decision_rate_hz <= 1000, "0 < decision_rate_hz <= 1000");
    f.check(latency_s >= 0 && latency_s <= 60, "0 <= latency_s <= 60");
  }
};

/// Everything that can be set in the flight software, by module.
struct StackConfig {
  VehicleConfig vehicle;
  OdometryConfig odometry;
  std::map<std::string, OdometrySection> odometries;
  MappingConfig mapping;
  PlanningConfig planning;
  ExplorationConfig exploration;
  MissionConfig mission;
  TimedPathConfig path;
  CautionConfig caution;
  HealthWatchConfig health;
  TrackerConfig control;
  std::vector<std::string> plugins;
  std::map<std::string, ModuleSection> modules;

  void fields(auto& f) {
    f("vehicle", vehicle,
      "what the stack believes of its vehicle, by weighing and calibrating; the truth is "
      "models/arex/arex.xml and physics");
    f("odometry", odometry, "pose and velocity");
    f("odometries", odometries,
      "further sources that run beside, by name: {type: lidar_inertial, ...}; what they leave out "
      "is as under odometry");
    f("mapping", mapping, "maps of the surroundings");
    f("planning", planning, "from a goal to a trajectory");
    f("exploration", exploration, "from the 2D map to the next goal");
    f("mission", mission, "what to do");
    f("path", path, "timed paths along straight legs");
    f("caution", caution, "answers to a weak odometry");
    f("health", health, "what it calls wrong with its sensors and its flight");
    f("control", control, "trajectory tracking");
    f("plugins", plugins, "shared libraries with modules of yours (autonomy/stack/modules.h)");
    f("modules", modules, "parameters of these modules, by their names");
    const bool plans = mission.kind == MissionConfig::Kind::kGoals ||
                       mission.kind == MissionConfig::Kind::kExplore;
    // Goals beyond these become stuck, typed, in flight; straight legs are their author's word.
    const double takeoff = mission.takeoff_height_m;
    f.check(!plans || (takeoff <= planning.ceiling_m && takeoff >= planning.floor_m),
            "mission.takeoff_height_m between planning.floor_m and planning.ceiling_m");
    const double height = exploration.explorer.flight_height_m;
    f.check(mission.kind != MissionConfig::Kind::kExplore || exploration.explorer.follow_ground ||
                (height <= planning.ceiling_m && height >= planning.floor_m),
            "exploration.flight_height_m between planning.floor_m and planning.ceiling_m");
    f.check(mapping.enabled || !plans, "mapping.enabled true for missions that plan");
    f.check(!odometries.contains("truth") && !odometries.contains("estimate"),
            "odometries with other names than truth and estimate, which files of a run have");
    f.check(!exploration.explorer.follow_ground || mapping.global.band != BandReference::kAbsolute,
            "exploration.follow_ground only with mapping.global.band: floor or ground");
  }

  /// Whether a source of this type flies or runs beside.
  [[nodiscard]] bool uses_odometry(std::string_view type) const;

  /// Where exploring begins, in O: after the entry legs.
  [[nodiscard]] Vec3 explored_from() const {
    return mission.entry_m.empty() ? Vec3::Zero() : mission.entry_m.back();
  }

  /// The rule that explored region, start and mapped box break together; empty: none. Not among the
  /// checks of fields(), for the box may be worked out only after reading (set_mapped_box).
  [[nodiscard]] std::string broken_region_rule() const;
};

/// Loads the plug-ins that a scenario names, before its sections are read. @throws ConfigError.
void load_plugins(const ConfigNode& scenario);

/// That every module which `config` chooses by name exists. @throws ConfigError where `scenario`
/// names one that does not.
void check_modules(const StackConfig& config, const ConfigNode& scenario);

/// Hands what one section says to the modules below others that need it too: a number has one home,
/// and whoever changes it there has changed it for all.
[[nodiscard]] StackConfig with_shared_values(StackConfig config);

/// The box to map where a scenario names none: bounds, entry and waypoints with the margin around
/// them. Heights stay.
void set_mapped_box(const StackConfig& asked, GlobalMapConfig& box);

}  // namespace arex
