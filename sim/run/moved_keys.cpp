#include "run/moved_keys.h"

#include <array>
#include <string>
#include <string_view>

namespace arex::sim {
namespace {

struct MovedKey {
  std::string_view old_key;  ///< dotted
  std::string_view instead;
};

constexpr std::string_view kVibration =
    "imu.vibration.level (none|smooth|typical|rough) and imu.vibration.scale";

constexpr std::array kMovedKeys{
    MovedKey{"exploration.stop.return_home", "mission.land_at_start"},
    MovedKey{"exploration.stop.return_speed_mps",
             "exploration.stop.return_speed_fraction, of planning.local.max_speed_mps"},
    MovedKey{"exploration.space.travel_radius_m", "planning.inflation_m"},
    MovedKey{"exploration.viewpoint.clearance_m",
             "exploration.viewpoint.clearance_margin_m, beyond planning.inflation_m"},
    MovedKey{"exploration.viewpoint.standoff_m",
             "exploration.viewpoint.standoff_margin_m, beyond planning.inflation_m"},
    MovedKey{"planning.guide.obstacle_distance_m",
             "planning.guide.margin_m, beyond planning.inflation_m"},
    MovedKey{"planning.local.true_radius_m", "vehicle.radius_m"},
    MovedKey{"planning.replan.degenerate_speed_mps",
             "caution.degenerate_speed_fraction, of planning.local.max_speed_mps"},
    MovedKey{"mapping.global.sensor", "mapping.sensor"},
    MovedKey{"vehicle.own_returns_m", "vehicle.own_returns_margin_m, beyond vehicle.radius_m"},
    MovedKey{"odometry.lidar_inertial.health.noticed_surprise",
             "odometry.lidar_inertial.health.noticed_innovation"},
    MovedKey{"odometry.lidar_inertial.health.doubtful_surprise",
             "odometry.lidar_inertial.health.doubtful_innovation"},
    MovedKey{"devices.lidar", "lidar.enabled"},
    MovedKey{"devices.lidar_latency_s", "lidar.latency_s"},
    MovedKey{"devices.depth_latency_s", "depth.latency_s"},
    MovedKey{"imu.vibration.once_per_rev_mps2", kVibration},
    MovedKey{"imu.vibration.blade_pass_mps2", kVibration},
    MovedKey{"imu.vibration.broadband_mps2", kVibration},
    MovedKey{"imu.vibration.gyro_radps", kVibration},
    MovedKey{"imu.vibration.frame_mode_hz", "physics.frame.mode_hz"},
    MovedKey{"imu.vibration.frame_mode_damping", "physics.frame.mode_damping"},
    MovedKey{"imu.vibration.frame_coupling", "physics.frame.load_ratio"},
    MovedKey{"depth.noise_kernel_px", "depth.noise_grid_px"},
    MovedKey{"world.vehicle_radius_m", "nothing: the radius is the model's (models/arex/arex.xml)"},
};

/// The entry at a dotted key; null if the file says nothing there.
const ConfigNode::Entry* entry_at(const ConfigNode& node, std::string_view key) {
  const std::size_t dot = key.find('.');
  for (const ConfigNode::Entry& entry : node.entries) {
    if (entry.key != key.substr(0, dot)) continue;
    return dot == std::string_view::npos ? &entry : entry_at(entry.value, key.substr(dot + 1));
  }
  return nullptr;
}

}  // namespace

void refuse_moved_keys(const ConfigNode& scenario) {
  for (const MovedKey& moved : kMovedKeys) {
    const ConfigNode::Entry* entry = entry_at(scenario, moved.old_key);
    if (!entry) continue;
    throw ConfigError(entry->where + ": '" + std::string(moved.old_key) +
                      "' is not set here any more; set " + std::string(moved.instead));
  }
}

}  // namespace arex::sim
