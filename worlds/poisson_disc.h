#pragma once

#include <vector>

#include "math/random.h"
#include "math/types.h"

namespace arex::worlds {

/// Random sequential packing of discs jams at this coverage; a recipe asks for less.
/// Source: Feder, Random sequential adsorption, Journal of Theoretical Biology 87, 1980 (0.547).
inline constexpr double kMaxDiscCoverage = 0.5;

/// Whether `density_per_m2` points with this least spacing can be placed by throwing darts.
constexpr bool can_pack(double density_per_m2, double spacing_m) {
  constexpr double kDiscArea = 0.7853981633974483;  // pi / 4
  return density_per_m2 * spacing_m * spacing_m * kDiscArea <= kMaxDiscCoverage;
}

/// Poisson-disc points in [low, high], no two nearer than `spacing_m`, by throwing darts, in the
/// order they fell: the nearest whole number to density times area. @pre can_pack(density, spacing)
std::vector<Vec2> scatter_discs(const Vec2& low, const Vec2& high, double density_per_m2,
                                double spacing_m, RandomStream random);

}  // namespace arex::worlds
