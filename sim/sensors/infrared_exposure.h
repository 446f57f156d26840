#pragma once

#include <cstdint>
#include <vector>

#include "sensors/infrared_config.h"
#include "sensors/infrared_shot.h"

namespace arex::sim {

/// Mean grey value of an image's middle: half of its width and height.
double central_mean(const std::vector<std::uint8_t>& grey, int width, int height);

/// Chooses exposure and gain of the next frame from what the frames before have shown: what stands
/// in light that changes by a factor of 1000 takes some ten frames. Exposure first; gain where its
/// limit does not suffice.
class AutoExposure {
 public:
  explicit AutoExposure(const InfraredSensorConfig& config);

  /// What a frame that begins now is taken with.
  [[nodiscard]] const InfraredExposure& next() const { return next_; }
  /// Takes in a frame. @param mean its central mean  @param taken how it was exposed
  void add(double mean, const InfraredExposure& taken);

 private:
  InfraredSensorConfig config_;
  InfraredExposure next_;
};

}  // namespace arex::sim
