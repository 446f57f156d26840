#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "math/pose.h"

/// What a stereo pair of infrared imagers delivers, and what its driver knows of it.
namespace arex {

/// The pair as its driver knows it: two equal pinholes, rectified, the right one beside the left
/// along x. Pixel centres at integer coordinates. Frame C: the left eye's, z forward, x right, y
/// down.
struct StereoCamera {
  int width = 848;
  int height = 480;
  double f_px = 422.6;  ///< focal length, both axes: mean of five D43x at this size
  double cx = 423.5;    ///< principal point, of both eyes
  double cy = 239.5;
  double baseline_m = 0.05;  ///< datasheet; a point at depth z lies f_px baseline_m / z px further
                             ///< left in the right image
  Pose X_BC;                 ///< of the left eye
};

/// One exposure of the pair. Global shutter: all rows of both eyes at once.
struct StereoImage {
  std::int64_t time_ns = 0;         ///< middle of the exposure, by the camera's clock
  int width = 0;                    ///< columns, of either eye
  int height = 0;                   ///< rows
  std::vector<std::uint8_t> left;   ///< width * height grey values, rows from the top
  std::vector<std::uint8_t> right;  ///< the same; empty where the right eye was not read this time
  double exposure_s = 0;            ///< how long the shutter was open
  double gain = 1;                  ///< of the amplifier, 1: none
  /// What this unit was calibrated to. Its X_BC is the camera's place by the drawings: where it
  /// really sits, the device does not know.
  StereoCamera camera;
};

// Frames are large and read by several jobs at once: they travel by shared pointer.
using StereoImagePtr = std::shared_ptr<const StereoImage>;

}  // namespace arex
