#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "math/random.h"
#include "math/types.h"

namespace arex {

/// How far points lie beside the lines that a camera's motion leaves them, in normalised
/// coordinates.
struct MotionFit {
  double coarse = 0;  ///< of the search: what its two pairs and the gyro's turn are off by
  double fine = 0;    ///< of a point once all of them have set direction and turn
};

/// Which pairs of rays fit one translation, the turn between the two views being known: two pairs
/// make the translation's direction, the most supported of the drawn ones wins. All that support it
/// set it and the turn anew, what is far off counting little, and are asked once more.
///
/// A patch across the edge of something near moves with neither it nor what is behind: it misses
/// its line by some tenths of a pixel, on one side more often than on the other. Along the line it
/// can not be told.
///
/// @param before, after rays of the same points, z = 1, the turn taken out: both in one orientation
/// @param random a stream that gives the same draws each time it is asked
/// @returns one flag a pair
[[nodiscard]] std::vector<bool> fit_translation(std::span<const Vec3> before,
                                                std::span<const Vec3> after, const MotionFit& off,
                                                int trials, RandomStream random);

}  // namespace arex
