#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "config/config.h"
#include "messages/vehicle.h"
#include "sensors/d430.h"
#include "sensors/mid360.h"

namespace arex::sim {

/// The LiDAR that the odometry flies on.
struct LidarConfig {
  bool enabled = true;
  double latency_s = 0.003;  ///< network and driver, after the frame's last firing (estimate)
  Mid360Config model;        ///< its keys stand directly under `lidar`

  void fields(auto& f) {
    f("enabled", enabled, "fire it");
    f("latency_s", latency_s, "end of a frame to its delivery");
    model.fields(f);
    f.check(latency_s >= 0 && latency_s <= 60, "0 <= latency_s <= 60");
  }
};

/// The depth camera; it runs when the stack reads it (mapping.use_depth).
struct DepthConfig {
  double latency_s = 0.030;  ///< exposure to driver: one frame at 30 Hz (estimate)
  D430Config model;          ///< its keys stand directly under `depth`

  void fields(auto& f) {
    f("latency_s", latency_s, "exposure of a frame to its delivery");
    model.fields(f);
    f.check(latency_s >= 0 && latency_s <= 60, "0 <= latency_s <= 60");
  }
};

/// A further device: its type (device_types.h), where it sits, and its own parameters.
struct DeviceSection {
  std::string type;
  MountConfig mount;
  ConfigNode own;

  void read(std::string_view name, const ConfigNode& section);
  [[nodiscard]] std::vector<ParameterInfo> parameters() const;
};

}  // namespace arex::sim
