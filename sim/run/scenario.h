#pragma once

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "autopilot/autopilot_config.h"
#include "config/config.h"
#include "physics/airframe.h"
#include "physics/physics_config.h"
#include "run/device_section.h"
#include "run/interfaces.h"
#include "run/operator_link.h"
#include "scoring/coverage.h"
#include "scoring/map_error.h"
#include "scoring/omniscient_tour.h"
#include "scoring/semantic_score.h"
#include "scoring/thin_branches.h"
#include "scoring/world_complexity.h"
#include "semantics/pcl_models.h"
#include "semantics/semantic_config.h"
#include "sensors/fault.h"
#include "sensors/imu.h"
#include "sensors/infrared_config.h"
#include "sensors/mocap_device.h"
#include "stack/stack_config.h"
#include "worlds/recipes.h"

namespace arex::sim {

/// What the truth is compared with. Coverage is scored on explorations only.
struct ScoringConfig {
  double low_m = -3;  ///< in O: the vehicle could reach what lies between
  double high_m = 3;
  CoverageConfig coverage;
  MapErrorConfig map;
  ThinBranchConfig thin;
  SemanticScoreConfig semantic;
  OmniscientTourConfig tour;
  WorldComplexityConfig complexity;

  void fields(auto& f) {
    f("low_m", low_m, "lower edge of the space that counts as reachable, z in O");
    f("high_m", high_m, "upper edge of that space");
    f("coverage", coverage, "coverage of the reachable, visible truth");
    f("map", map, "distance of the map from the true surfaces");
    f("thin", thin, "thin branches seen in time");
    f("semantic", semantic, "the semantic map against the world");
    f("tour", tour, "the tour of somebody who knows the world");
    f("complexity", complexity, "how hard the world is to see and to fly through");
    f.check(low_m < high_m, "low_m < high_m");
  }
};

/// The semantic map that an exploration ends with.
struct MissionSemanticsConfig {
  bool enabled = false;
  SemanticConfig map;

  void fields(auto& f) {
    f("enabled", enabled,
      "explorations end with a semantic map of their cloud, scored against the world; `arex "
      "semantics RUN` makes it afterwards");
    f.check(!enabled || has_pcl(), "enabled false, for this build has no PCL");
    map.fields(f);
  }
};

/// One mission: the world, the vehicle, its sensors and its flight software. A scenario file lists
/// what differs from the defaults.
struct ScenarioConfig {
  std::uint64_t seed = 1;
  worlds::WorldConfig world;
  PhysicsConfig physics;
  ImuConfig imu;
  LidarConfig lidar;
  DepthConfig depth;
  InfraredConfig infrared;
  MocapConfig mocap;
  std::map<std::string, DeviceSection> devices;
  std::vector<FaultConfig> faults;
  AutopilotConfig autopilot;
  InterfaceConfig interfaces;
  StackConfig stack;
  std::vector<OperatorOrder> commands;
  OperatorLinkConfig operator_link;
  MissionSemanticsConfig semantics;
  ScoringConfig scoring;

  void fields(auto& f) {
    f("seed", seed, "of everything random");
    f("world", world, "where to fly");
    f("physics", physics, "the true vehicle: body, motors, rotors, battery, drag, wind");
    f("imu", imu, "the autopilot's sensors");
    f("lidar", lidar, "MID-360");
    f("depth", depth, "D430");
    f("infrared", infrared, "the D430's pair of infrared images");
    f("mocap", mocap, "motion capture, where odometry.source is that");
    f("devices", devices,
      "further ones by name: {type: mid360|spinning|d430, position_m: [..], rotation_rad: [..], "
      "...}");
    f("faults", faults,
      "what goes wrong: [{device: lidar, kind: silent, from_s: 20, to_s: 25}, ...]; device: imu|"
      "magnetometer|barometer|power|lidar|depth|mocap|a name under devices|motor|esc|battery, "
      "kind: silent|stuck|delayed|noisy|dropping|false_returns|jumping|blinded|weak|stop, and the "
      "amounts of README's table");
    f("autopilot", autopilot, "flight controller");
    f("interfaces", interfaces, "what the flight controller is connected by");
    stack.fields(f);
    f("commands", commands,
      "what the operator does: [{at_s: 120, do: hold}, {on: stop, do: land}, ...]; on: "
      "time|stop|low_battery|target_reached, do: land|hold|return|resume|go_to");
    f("operator", operator_link, "the radio between operator and vehicle");
    f("semantics", semantics, "what the mapped cloud shows");
    f("scoring", scoring, "what the truth is compared with");
    f.check(
        std::none_of(kFirstDevices.begin(), kFirstDevices.end(),
                     [&](std::string_view name) { return devices.contains(std::string(name)); }),
        "devices with other names than imu, lidar, depth, infrared and mocap, which the first "
        "ones have");
    f.check(stack.mapping.lidar.empty() || devices.contains(stack.mapping.lidar),
            "mapping.lidar empty, or a name under devices");
    for (const FaultConfig& fault : faults) {
      f.check(faulty_part(fault.device) != FaultyPart::kFurther || devices.contains(fault.device),
              "faults of known devices: '" + fault.device +
                  "' is neither one of the vehicle's nor one under devices");
    }
    f.check(
        stack.mapping.enabled || std::none_of(commands.begin(), commands.end(), needs_a_planner),
        "mapping.enabled true, or commands without return and go_to, which are planned ways");
    f.check(lidar.enabled || stack.odometry.source == "mocap",
            "lidar.enabled true, or odometry.source mocap");
    // Software that takes longer than the time between two frames falls ever further behind.
    f.check(!stack.uses_odometry("lidar_inertial") ||
                lidar.enabled * lidar.model.rate_hz * stack.odometry.latency_s <= 1,
            "odometry.latency_s <= 1 / lidar.rate_hz");
    f.check(!stack.mapping.enabled || mapped_frames_hz() * stack.mapping.latency_s <= 1,
            "mapping.latency_s <= 1 / (lidar.rate_hz + lesser of depth.rate_hz, "
            "mapping.depth_rate_hz), further devices counted");
  }

  static constexpr std::array<std::string_view, 5> kFirstDevices{"imu", "lidar", "depth",
                                                                 "infrared", "mocap"};
  static bool needs_a_planner(const OperatorOrder& order) {
    return order.what == OperatorCommand::Kind::kReturn ||
           order.what == OperatorCommand::Kind::kGoTo;
  }
  /// Frames that the maps take, of all devices.
  [[nodiscard]] double mapped_frames_hz() const;
  /// Whether anybody reads the infrared images.
  [[nodiscard]] bool draws_infrared() const {
    return infrared.enabled || stack.uses_odometry("visual_inertial");
  }
  /// What an exploration is scored over: what it is told to explore.
  [[nodiscard]] ScoredRegion scored_region() const;
  /// Where mission and operator lead, the start included: x and y in O, m.
  [[nodiscard]] Eigen::AlignedBox2d flown_area() const;
};

/// A scenario as it was asked for.
struct Scenario {
  std::string name;  ///< the file's name without its ending
  ScenarioConfig config;
  ConfigNode source;  ///< what the file and the overrides say, for messages
  /// The world of kind file, where something had to be known of it to read the scenario.
  std::shared_ptr<const worlds::FileWorld> file_world;

  /// Every value; running it again gives the same trajectory hash.
  [[nodiscard]] std::string resolved_yaml() const;
  /// Builds the world. @throws ConfigError at the line of `world` if the recipe gives none, at that
  /// of a point which the mission flies to if that lies off the world or below its ground, and of
  /// `mission` if the vehicle has no room where it is to explore from.
  [[nodiscard]] worlds::World build_world() const;
  /// The world of kind file as it was understood. @throws ConfigError at the line of `world`.
  [[nodiscard]] std::shared_ptr<const worlds::FileWorld> read_file_world() const;
  [[nodiscard]] ScoredRegion scored_region() const { return config.scored_region(); }
};

/// Where B stands at the start: on its legs on the pad. Also the pose of O as it should be.
Pose start_pose(const worlds::World& world);

/// Names of files in a `world` section become absolute. They are relative to the file that says so,
/// on the command line to the working directory.
/// @param node what was said of the section
void resolve_paths(const ConfigNode& node, worlds::WorldConfig& world);

/// The scenario that `source` asks for, checked, with what follows from it (such as the battery
/// that the stack believes in). Whatever runs, sweeps, prints or checks a scenario has it from
/// here.
/// @throws ConfigError.
Scenario make_scenario(const std::string& name, ConfigNode source);

/// Puts a seed over what `source` says; messages will name `where`.
void set_seed(ConfigNode& source, std::uint64_t seed, const std::string& where);

/// Reads a scenario, applies `--set` and `--seed`, and makes it.
/// @param file empty: nothing but the defaults
/// @throws ConfigError.
Scenario load_scenario(const std::filesystem::path& file, const std::vector<std::string>& overrides,
                       std::optional<std::uint64_t> seed);

}  // namespace arex::sim
