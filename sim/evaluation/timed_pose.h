#pragma once

#include "math/pose.h"

namespace arex::sim {

/// A pose of a recorded track, in the frames that the track names.
struct TimedPose {
  double time_s = 0;
  Pose X;
};

}  // namespace arex::sim
