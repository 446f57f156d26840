#include "run/device_types.h"

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "run/scenario.h"
#include "scoring/surface_samples.h"
#include "sensors/depth_device.h"
#include "sensors/infrared_device.h"
#include "sensors/lidar_device.h"
#include "sensors/spinning_lidar.h"
#include "sensors/survey_lidar.h"

namespace arex::sim {
namespace {

using DeviceTypes = Registry<Device, DeviceMaking>;

/// A camera looks along the x of its mount.
DeviceContext looking_forward(DeviceContext context) {
  context.X_BS.R = context.X_BS.R * MountConfig::forward();
  return context;
}

std::unique_ptr<Device> make_survey(const SurveyConfig& config, const DeviceContext& context) {
  // So dense that what is a little larger than a third of a cube's face has a sample.
  SurfaceSampleConfig samples;
  samples.sample_area_m2 = std::max(0.002, 0.4 * config.spacing_m * config.spacing_m);
  samples.sample_height_m = config.height_m;
  std::vector<Vec3f> points =
      one_per_cube(sample_surfaces(context.world, context.world.bounds, samples), config.spacing_m);
  return std::make_unique<LidarDevice>(
      std::make_unique<SurveyLidar>(config, context.scene, std::move(points), context.X_BS),
      config.latency_s, context);
}

DeviceTypes make_types() {
  DeviceTypes types{"type"};
  types.add({"mid360", "Livox MID-360; what it leaves out is as under lidar",
             given_parameters<LidarConfig>,
             [](const ConfigNode& section, const DeviceMaking& making) {
               return make_mid360(read_over(making.scenario.lidar, section), making.context);
             }});
  types.add({"d430", "RealSense D430; what it leaves out is as under depth",
             given_parameters<DepthConfig>,
             [](const ConfigNode& section, const DeviceMaking& making) {
               return make_d430(read_over(making.scenario.depth, section),
                                looking_forward(making.context));
             }});
  types.add<SpinningLidarConfig>(
      "spinning", "lasers in a fan that turns, by default a VLP-16",
      [](const SpinningLidarConfig& config, const DeviceMaking& making) {
        const DeviceContext& context = making.context;
        return std::make_unique<LidarDevice>(
            std::make_unique<SpinningLidar>(config, context.scene, context.X_BS,
                                            context.airframe.shapes, context.seed),
            config.latency_s, context);
      });
  types.add<SurveyConfig>(
      "survey", "an oracle, for ablation: exact points of all surfaces in sight, all around",
      [](const SurveyConfig& config, const DeviceMaking& making) {
        return make_survey(config, making.context);
      });
  return types;
}

}  // namespace

const DeviceTypes& device_types() {
  static const DeviceTypes types = make_types();
  return types;
}

std::unique_ptr<Device> make_mid360(const LidarConfig& config, const DeviceContext& context) {
  if (!config.enabled) return nullptr;
  // The housing's own beams do not meet it.
  std::vector<worlds::CollisionShape> airframe = context.airframe.shapes;
  std::erase_if(airframe, [](const worlds::CollisionShape& shape) {
    return shape.object == static_cast<std::uint32_t>(AirframePart::kLidar);
  });
  return std::make_unique<LidarDevice>(
      std::make_unique<Mid360>(config.model, context.scene, context.X_BS, airframe, context.seed),
      config.latency_s, context);
}

std::unique_ptr<Device> make_d430(const DepthConfig& config, const DeviceContext& context) {
  return std::make_unique<DepthDevice>(config.model, config.latency_s, context);
}

std::unique_ptr<Device> make_infrared(const ScenarioConfig& scenario,
                                      const DeviceContext& context) {
  if (!scenario.draws_infrared()) return nullptr;
  return std::make_unique<InfraredDevice>(scenario.infrared,
                                          scenario.depth.model.as_built(context.seed),
                                          scenario.stack.vehicle.X_BC(), context);
}

}  // namespace arex::sim
