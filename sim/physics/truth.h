#pragma once

#include <array>
#include <vector>

#include "math/pose.h"
#include "math/types.h"

/// What is really so. Only sim/ may include this file; a test proves that autonomy cannot.
namespace arex::sim {

/// The vehicle's true state at one physics tick. B is the IMU's frame, x forward, y left, z up.
struct Truth {
  Stamp stamp = 0;
  Pose X_WB;
  Vec3 v_WB = Vec3::Zero();    ///< velocity of B's origin, m/s, in W
  Vec3 w_WB_B = Vec3::Zero();  ///< angular rate, rad/s, in B
  Vec3 a_WB = Vec3::Zero();    ///< acceleration of B's origin over the last tick, m/s^2, in W (no
                               ///< gravity term)
  Vec3 alpha_WB_B = Vec3::Zero();       ///< angular acceleration over the last tick, rad/s^2, in B
  std::array<double, 4> rotor_radps{};  ///< rotor speeds, always positive
};

}  // namespace arex::sim
