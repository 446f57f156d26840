#pragma once

#include "config/registry.h"
#include "run/device_section.h"
#include "sensors/device.h"

namespace arex::sim {

struct ScenarioConfig;

/// What a device of a scenario's `devices` is made from, beside its own section.
struct DeviceMaking {
  const ScenarioConfig& scenario;  ///< whose `lidar` and `depth` say what a section leaves out
  const DeviceContext& context;
};

/// The types that `devices` may have. A type may make no device: one that is switched off.
const Registry<Device, DeviceMaking>& device_types();

/// @param context its X_BS: L in B; null if it is not enabled
std::unique_ptr<Device> make_mid360(const LidarConfig& config, const DeviceContext& context);
/// @param context its X_BS: C in B
std::unique_ptr<Device> make_d430(const DepthConfig& config, const DeviceContext& context);
/// The infrared pair of the first D430. @param context its X_BS: C in B; null if nobody reads it
std::unique_ptr<Device> make_infrared(const ScenarioConfig& scenario, const DeviceContext& context);

}  // namespace arex::sim
