#pragma once

#include <vector>

#include "math/pose.h"
#include "math/types.h"

/// What the parts of the infrared pair tell each other.
namespace arex::sim {

/// How an imager is set for one frame.
struct InfraredExposure {
  double exposure_s = 0.0085;
  double gain = 1;
};

/// How a camera moves, in its own frame C.
struct CameraTwist {
  Vec3 v_C = Vec3::Zero();  ///< of its origin, m/s
  Vec3 w_C = Vec3::Zero();  ///< rad/s
};

/// One frame to be taken.
struct InfraredShot {
  Stamp stamp = 0;             ///< middle of the exposure
  Pose X_WB;                   ///< then
  Vec3 v_WB = Vec3::Zero();    ///< of B's origin, in W, m/s
  Vec3 w_WB_B = Vec3::Zero();  ///< in B, rad/s
  InfraredExposure exposure;
  bool right = true;  ///< read the right eye, too
};

/// What a pinhole sees at one moment, before optics, shutter and sensor.
struct InfraredScene {
  std::vector<float> light_lx;       ///< of each pixel, rows from the top: as a white surface's
  std::vector<float> inverse_depth;  ///< 1/z, 1/m: mean over the pixel; 0 where all is backdrop
  std::vector<float> steady_lx{};    ///< light as light_lx that moves with the camera; empty: none
};

}  // namespace arex::sim
