#pragma once

#include <array>

#include "math/types.h"

/// What the stack asks of the autopilot, and the autopilot of the motors.
namespace arex {

enum class AutopilotMode {
  kDisarmed,  ///< motors stopped
  kAttitude,  ///< track attitude and thrust of the newest command
  kDescend,   ///< the autopilot's own landing: level, slow descent on thrust, disarm on touchdown
};

/// Desired attitude and thrust, 100 Hz from the stack. The autopilot descends by itself when
/// commands stop coming.
struct AttitudeCommand {
  Stamp stamp = 0;
  AutopilotMode mode = AutopilotMode::kDisarmed;
  Mat3 R_AB_desired = Mat3::Identity();  ///< in the autopilot's own heading reference A
  double yaw_rate_radps = 0;             ///< feed-forward about the world's vertical
  double thrust_n = 0;                   ///< collective thrust along B's z, N
};

/// ESC throttle of each motor, 0..1. Order: front right, rear left, front left, rear right
/// (PX4's quad x): x forward, y left, rotors 0 and 1 turn counter-clockwise seen from above.
struct MotorCommand {
  std::array<double, 4> throttle{};
};

}  // namespace arex
