#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "config/config.h"

/// Blame: which module a flight failed by. The same flight is flown again with one module replaced
/// by truth at a time; where the failure is gone, that module has its part in it.
namespace arex::sim {

/// Modules that truth can replace, in the order in which the data flows.
enum class BlamedModule { kSensors, kOdometry, kMaps, kTracking };
inline constexpr std::array<std::string_view, 4> kBlamedModules{"sensors", "odometry", "maps",
                                                                "tracking"};

/// What stands in a module's place, in words.
[[nodiscard]] std::string_view replacement_text(BlamedModule module);

/// One flight of a blame.
struct Experiment {
  std::string name;  ///< of its folder: a module's, all, time or as_flown
  std::string text;  ///< what is replaced by what
  std::string resolved_yaml;
};

/// Puts truth in a module's place. What the scenario has chosen stays (rates, the grid's size, the
/// inflation): it is not the module's error.
///
/// - sensors: no noise, no fault, no error of mounting; LiDAR, camera, IMU and the rest alike
/// - odometry: the true pose of a motion capture system
/// - maps: made from the exact frames of a survey alone, nothing remembered and nothing left out
/// - tracking: the vehicle is carried along its setpoint
///
/// @return false if truth stands there already, or the module does nothing in this mission
bool replace_by_truth(BlamedModule module, ConfigNode& scenario);

/// Whether the sensors of a failed run are no worse than such devices are: default noise, no fault,
/// no error of mounting.
/// @param scenario a run's resolved.yaml. @throws ConfigError if it is no scenario.
[[nodiscard]] bool sensors_are_as_sold(const ConfigNode& scenario);

/// What a blame has to fly.
/// @param scenario a failed run's resolved.yaml
/// @param timed_out how it failed: whether more time would have helped is asked as well
/// @param again whether it has to be flown once more as it was, for another build flew it
/// @throws ConfigError if it is no scenario.
[[nodiscard]] std::vector<Experiment> plan_experiments(const std::string& name,
                                                       const ConfigNode& scenario, bool timed_out,
                                                       bool again);

}  // namespace arex::sim
