#pragma once

#include "math/types.h"

namespace arex {

/// What the mission asks of the vehicle's motion until it asks something else.
struct MotionRequest {
  enum class Kind {
    kNone,     ///< motors off
    kTakeoff,  ///< straight up to `goal`
    kLeg,      ///< to `goal` along a straight leg that is known to be free
    kGoTo,     ///< to `goal`, along whatever path the planner finds
    kHold,     ///< come to rest where there is room and stay
    kSpin,     ///< stay at `goal` and turn at `yaw_rate_radps`
    kLand,     ///< straight down until touchdown
    kLevel,    ///< no position to hold: level, at hover thrust
    kDescend,  ///< no position to hold: the autopilot comes down by itself
  };
  Kind kind = Kind::kNone;
  Vec3 goal_O = Vec3::Zero();
  double yaw_rate_radps = 0;
  int attempt = 0;  ///< tells two requests for the same goal apart

  bool operator==(const MotionRequest&) const = default;
};

/// How the vehicle fares with the request.
enum class MotionProgress { kUnderWay, kArrived, kFailed };

}  // namespace arex
