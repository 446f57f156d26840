#include "run/idle_faults.h"

#include <fmt/format.h>

#include "run/device_types.h"

namespace arex::sim {
namespace {

/// Why a further device delivers nothing; empty: it does.
std::string absence_of_further(const ScenarioConfig& config, const std::string& name) {
  const DeviceSection& device = config.devices.at(name);
  if (device.type == "mid360" && !read_over(config.lidar, device.own).enabled) {
    return "devices." + name + ".enabled is false";
  }
  if (device.type == "d430" && !config.stack.mapping.local.use_depth) {
    return "nobody reads its images (mapping.use_depth is false)";
  }
  return {};
}

/// Why a device delivers nothing in this run; empty: it does.
std::string absence_of(const ScenarioConfig& config, const std::string& device) {
  switch (faulty_part(device)) {
    case FaultyPart::kLidar:
      return config.lidar.enabled ? "" : "lidar.enabled is false";
    case FaultyPart::kDepth:
      return config.stack.mapping.local.use_depth
                 ? ""
                 : "nobody reads its images (mapping.use_depth is false)";
    case FaultyPart::kInfrared:
      return config.draws_infrared()
                 ? ""
                 : "nobody reads its images (infrared.enabled is false, no visual odometry)";
    case FaultyPart::kBoard:
      return device != "mocap" || config.stack.uses_odometry("mocap")
                 ? ""
                 : "no odometry is of type mocap";
    case FaultyPart::kFurther:
      return absence_of_further(config, device);
    case FaultyPart::kMotor:
    case FaultyPart::kEsc:
    case FaultyPart::kBattery:
      break;
  }
  return {};
}

}  // namespace

std::vector<std::string> idle_faults(const ScenarioConfig& config) {
  std::vector<std::string> lines;
  const double end_s = config.stack.mission.max_time_s;
  for (std::size_t i = 0; i < config.faults.size(); ++i) {
    const FaultConfig& fault = config.faults[i];
    std::string why = absence_of(config, fault.device);
    if (why.empty() && fault.from_s >= end_s) {
      why = fmt::format("mission.max_time_s is over at {:g} s", end_s);
    }
    if (why.empty()) continue;
    lines.push_back(fmt::format("faults: item {}, {} {} from {:g} s, has no effect: {}", i + 1,
                                fault.device, kFaultKindNames[static_cast<std::size_t>(fault.kind)],
                                fault.from_s, why));
  }
  return lines;
}

}  // namespace arex::sim
