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
  /// What is fired between the first and the last of consecutive ticks, at its true times.
  /// @param frame_begin what was fired before does not belong to the frame
  [[nodiscard]] virtual LidarScan scan(std::span<const Truth> ticks,
                                       Stamp frame_begin = 0) const = 0;
  /// A frame as the driver delivers it, from the scans of its parts, whose ticks begin one tick
  /// before it.
  [[nodiscard]] virtual LidarScan frame(Stamp begin, Stamp end,
                                        std::span<const LidarScan> parts) const = 0;
};

}  // namespace arex::sim
