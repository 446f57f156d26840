#pragma once

#include <span>

#include "messages/sensors.h"
#include "physics/truth.h"

namespace arex::sim {

/// What a LiDAR measures: a pure function of the true states that a scan spans, so that scans may
/// be made on any thread, in any order.
class LidarModel {
 public:
  virtual ~LidarModel() = default;

  [[nodiscard]] virtual Stamp period() const = 0;  ///< of a frame; whole ticks
  /// What is fired between the first and the last of consecutive ticks.
  [[nodiscard]] virtual LidarScan scan(std::span<const Truth> ticks) const = 0;
};

}  // namespace arex::sim
