// What a recording and a configuration say together of where the sensors sit.

#include <algorithm>
#include <initializer_list>
#include <optional>
#include <string>

#include "config/text.h"
#include "run/replay.h"

namespace arex::sim {
namespace {

bool says_any(const ConfigNode& source, std::initializer_list<const char*> keys) {
  const ConfigNode* vehicle = source.find("vehicle");
  if (vehicle == nullptr) return false;
  return std::any_of(keys.begin(), keys.end(),
                     [&](const char* key) { return vehicle->find(key) != nullptr; });
}

bool is_near(const Pose& a, const Pose& b) {
  constexpr double kRounding = 1e-9;
  return (a.R - b.R).cwiseAbs().maxCoeff() < kRounding &&
         (a.p - b.p).cwiseAbs().maxCoeff() < kRounding;
}

/// Where the camera sits, and under which name the vehicle knows that: empty, it is our own.
struct CameraPlace {
  std::string device;
  Pose X_BC;
};

/// @param name under which a mount of its own is told
/// @param recorded its frame in B, if the recording knows it
/// @return nothing where neither recording nor configuration say it
std::optional<CameraPlace> place_camera(Scenario& scenario, const std::string& name,
                                        const std::optional<Pose>& recorded) {
  VehicleConfig& vehicle = scenario.config.stack.vehicle;
  if (vehicle.mounts.contains(name)) return CameraPlace{name, vehicle.X_BC(name)};
  const bool said = says_any(scenario.source, {"camera_position_m", "camera_pitch_rad"});
  if (!said && !recorded) return std::nullopt;
  if (said || is_near(*recorded, vehicle.X_BC())) return CameraPlace{"", vehicle.X_BC()};
  vehicle.mounts[name] = {recorded->p, so3::Log(recorded->R * MountConfig::forward().transpose())};
  return CameraPlace{name, vehicle.X_BC(name)};
}

void place_lidar(Scenario& scenario, const ReplayInput& input) {
  if (says_any(scenario.source, {"lidar_position_m", "lidar_pitch_rad", "lidar_rotation_rad"})) {
    return;
  }
  if (!input.X_BL()) {
    throw ConfigError("arex replay: nothing says where the LiDAR (frame '" +
                      printable(shortened(input.lidar_frame())) + "') sits on the IMU (frame '" +
                      printable(shortened(input.imu_frame())) +
                      "'), expected /tf_static in the recording, or vehicle.lidar_position_m and "
                      "vehicle.lidar_rotation_rad by --config or --set");
  }
  VehicleConfig& vehicle = scenario.config.stack.vehicle;
  // What is our own vehicle's stays so to the last bit.
  if (is_near(*input.X_BL(), vehicle.X_BL())) return;
  vehicle.lidar_position_m = input.X_BL()->p;
  vehicle.lidar_rotation_rad = so3::Log(input.X_BL()->R);
  vehicle.lidar_pitch_rad = 0;
}

}  // namespace

void prepare_for_replay(Scenario& scenario, ReplayInput& input) {
  const StackConfig& stack = scenario.config.stack;
  const auto refuse = [](const std::string& what, const std::string& expected) {
    throw ConfigError("arex replay: the configuration asks for the odometry " + what +
                      ", expected " + expected);
  };
  if (stack.uses_odometry("mocap")) {
    refuse("mocap", "those that a recording feeds, such as odometry.source: lidar_inertial");
  }
  place_lidar(scenario, input);
  const RecordedCameras& cameras = input.cameras();
  CameraUse use;
  if (cameras.depth() && stack.mapping.enabled && stack.mapping.local.use_depth) {
    const auto place = place_camera(scenario, "depth", input.X_B_depth());
    use.depth = place.has_value();
    if (place) use.depth_device = place->device;
  }
  const auto further = stack.odometries.find(stack.odometry.source);
  const std::string flies =
      further == stack.odometries.end() ? stack.odometry.source : further->second.type;
  if (cameras.infrared() && stack.uses_odometry(std::string(kVisualInertial))) {
    const auto place = place_camera(scenario, "infrared", input.X_B_infrared());
    use.infrared = place.has_value();
    if (place) use.X_BC = place->X_BC;
    if (!place && flies == kVisualInertial) {
      refuse(flies,
             "/tf_static in the recording, or vehicle.mounts.infrared, to say where frame '" +
                 printable(shortened(cameras.infrared()->frame)) + "' sits on the IMU");
    }
  }
  if (flies == kVisualInertial && !cameras.infrared()) {
    refuse(flies,
           "a recording with a rectified infrared pair: mono8 images on NAMEinfra1REST and "
           "NAMEinfra2REST with their camera_info");
  }
  input.use(use);
}

}  // namespace arex::sim
