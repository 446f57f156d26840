#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "autopilot/autopilot_config.h"
#include "config/config.h"
#include "physics/physics_config.h"
#include "sensors/d430.h"
#include "sensors/imu.h"
#include "sensors/mid360.h"
#include "stack/stack.h"
#include "worlds/recipes.h"

namespace arex::sim {

/// How long the devices take from measurement to delivery.
struct DeviceLatencyConfig {
  double lidar_s = 0.003;  ///< UDP packets and driver, after the frame's last firing (estimate)
  double depth_s = 0.030;  ///< exposure to driver: one frame at 30 Hz (estimate)

  void fields(auto& f) {
    f("lidar_s", lidar_s, "end of a frame to its delivery");
    f("depth_s", depth_s, "exposure to delivery");
    f.check(lidar_s >= 0, "lidar_s >= 0");
    f.check(depth_s >= 0, "depth_s >= 0");
  }
};

/// One mission: the world, the vehicle, its sensors and its flight software. A scenario file lists
/// what differs from the defaults.
struct ScenarioConfig {
  std::uint64_t seed = 1;
  worlds::WorldConfig world;
  PhysicsConfig physics;
  ImuConfig imu;
  Mid360Config lidar;
  D430Config depth;
  DeviceLatencyConfig device_latency;
  AutopilotConfig autopilot;
  StackConfig stack;

  void fields(auto& f) {
    f("seed", seed, "of everything random");
    f("world", world, "where to fly");
    f("physics", physics, "motors, rotors, battery, drag, wind");
    f("imu", imu, "the autopilot's sensors");
    f("lidar", lidar, "MID-360");
    f("depth", depth, "D430");
    f("device_latency", device_latency, "measurement to delivery");
    f("autopilot", autopilot, "flight controller");
    stack.fields(f);
  }
};

/// A scenario as it was asked for.
struct Scenario {
  std::string name;  ///< the file's name without its ending
  ScenarioConfig config;
  ConfigNode source;  ///< what the file and the overrides say, for messages

  /// Every value; running it again gives the same trajectory hash.
  [[nodiscard]] std::string resolved_yaml() const;
  /// Builds the world. @throws ConfigError at the line of `world` if the recipe gives none.
  [[nodiscard]] worlds::World build_world() const;
};

/// Reads a scenario, applies `--set` and `--seed`, checks everything. @throws ConfigError.
Scenario load_scenario(const std::filesystem::path& file, const std::vector<std::string>& overrides,
                       std::optional<std::uint64_t> seed);

}  // namespace arex::sim
