#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "math/random.h"
#include "math/types.h"

namespace arex {

/// Which pairs of rays fit one translation, the turn between the two views being known: two pairs
/// make the translation's direction, the most supported of the drawn ones wins.
///
/// @param before, after rays of the same points, z = 1, the turn taken out: both in one orientation
/// @param threshold distance of a point from its epipolar line, normalised coordinates
/// @param random a stream that gives the same draws each time it is asked
/// @returns one flag a pair
[[nodiscard]] std::vector<bool> fit_translation(std::span<const Vec3> before,
                                                std::span<const Vec3> after, double threshold,
                                                int trials, RandomStream random);

}  // namespace arex
