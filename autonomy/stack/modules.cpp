#include "stack/modules.h"

#include <dlfcn.h>

#include <filesystem>
#include <set>
#include <utility>

#include "config/text.h"
#include "exploration/nearest_explorer.h"
#include "exploration/revenue_explorer.h"
#include "odometry/lidar_inertial_source.h"
#include "odometry/mocap_source.h"
#include "odometry/visual/visual_inertial_source.h"
#include "stack/stack_config.h"

namespace arex {
namespace {

/// The left eye in B: that of the depth camera, unless it has a mount of its own, as in recordings
/// of other people's vehicles.
Pose infrared_mount(const VehicleConfig& vehicle) {
  const bool own = vehicle.mounts.contains("infrared");
  return own ? vehicle.X_BC("infrared") : vehicle.X_BC();
}

// Sources and explorers that ship have their parameters under `odometry` and `exploration`. A
// section of a further source says only what differs from these.
void register_shipped(Modules& to) {
  to.odometry.add({"lidar_inertial", "error-state Kalman filter of the FAST-LIO family",
                   given_parameters<LidarInertialConfig>,
                   [](const ConfigNode& section, const ModuleContext& context) {
                     const StackConfig& config = context.config;
                     return std::make_unique<LidarInertialSource>(
                         read_over(config.odometry.lidar_inertial, section), config.vehicle);
                   }});
  to.odometry.add({std::string(kVisualInertial),
                   "sliding window on the infrared pair (VINS family)",
                   given_parameters<VisualInertialConfig>,
                   [](const ConfigNode& section, const ModuleContext& context) {
                     const StackConfig& config = context.config;
                     return std::make_unique<VisualInertialSource>(
                         read_over(config.odometry.visual_inertial, section),
                         infrared_mount(config.vehicle), context.seed);
                   }});
  to.odometry.add<NoParameters>("mocap", "the true pose: the oracle, for ablations",
                                [](const NoParameters&, const ModuleContext& context) {
                                  return std::make_unique<MocapSource>(context.config.vehicle);
                                });
  to.explorers.add<NoParameters>("revenue", "direction-aware RRT exploration (paper)",
                                 [](const NoParameters&, const ModuleContext& context) {
                                   return std::make_unique<RevenueExplorer>(
                                       context.config.exploration.explorer,
                                       context.config.mapping.resolution_m, context.seed);
                                 });
  to.explorers.add<NoParameters>(
      "nearest", "the nearest frontier", [](const NoParameters&, const ModuleContext& context) {
        return std::make_unique<NearestExplorer>(context.config.exploration.explorer,
                                                 context.config.mapping.resolution_m);
      });
  to.planners.add<NoParameters>(
      "bspline", "B-splines of the EGO-Planner family (paper)",
      [](const NoParameters&, const ModuleContext& context) {
        return std::make_unique<BsplinePlanner>(context.config.planning.local);
      });
}

[[noreturn]] void refuse(const std::string& where, const std::string& file,
                         const std::string& why) {
  throw ConfigError(where + ": plug-in '" + shortened(file) + "' " + why);
}

template <class Function>
Function symbol(void* library, const char* name) {
  return reinterpret_cast<Function>(dlsym(library, name));
}

}  // namespace

Modules& modules() {
  static Modules all = [] {
    Modules shipped;
    register_shipped(shipped);
    return shipped;
  }();
  return all;
}

void load_plugin(const std::string& file, const std::string& where) {
  static std::set<std::filesystem::path> loaded;
  std::error_code none;
  const std::filesystem::path path = std::filesystem::weakly_canonical(file, none);
  if (none || !std::filesystem::is_regular_file(path, none)) {
    refuse(where, file, "is no file, expected a shared library");
  }
  if (loaded.contains(path)) return;
  void* library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) {
    const char* why = dlerror();
    refuse(where, file, std::string("cannot be loaded: ") + (why ? why : "unknown"));
  }
  const auto abi = symbol<const char* (*)()>(library, "arex_plugin_abi");
  const auto enter = symbol<void (*)(Modules&)>(library, "arex_plugin_register");
  if (abi == nullptr || enter == nullptr) {
    refuse(where, file, "has no AREX_PLUGIN(...), expected one");
  }
  if (abi() != kPluginAbi) {
    refuse(
        where, file,
        std::string("was built with '") + abi() + "', expected '" + std::string(kPluginAbi) + "'");
  }
  try {
    enter(modules());
  } catch (const std::logic_error& taken) {
    refuse(where, file, std::string("cannot register: ") + taken.what());
  }
  loaded.insert(path);
}

}  // namespace arex
