#pragma once

#include <cstdint>

#include "math/types.h"

/// What a visual odometry tells of its work, for onlookers.
namespace arex {

/// Where one exposure shows a feature that is followed.
struct FeatureSight {
  Stamp stamp = 0;  ///< of the exposure, by the camera's clock
  std::int64_t id = 0;
  Vec2 left_px = Vec2::Zero();  ///< column, row in the left image
  int age = 1;                  ///< exposures that have seen it
};

/// Sums over a flight.
struct VisualTally {
  std::int64_t exposures = 0;  ///< since it started
  std::int64_t tracked = 0;    ///< landmarks of known depth, over all of them
  std::int64_t keyframes = 0;
};

}  // namespace arex
