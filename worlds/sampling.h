#pragma once

#include <algorithm>
#include <cmath>

#include "math/random.h"
#include "math/types.h"

/// Distributions that the recipes share.
namespace arex::worlds {

/// A normal draw, drawn again while it lies outside [low, high]; clamped should that take long.
inline double truncated_normal(RandomStream& random, double mean, double deviation, double low,
                               double high) {
  constexpr int kAttempts = 32;
  for (int i = 0; i < kAttempts; ++i) {
    const double value = mean + deviation * random.normal();
    if (value >= low && value <= high) return value;
  }
  return std::clamp(mean, low, high);
}

/// A Poisson count. Source: Knuth, The art of computer programming, volume 2, section 3.4.1.
inline int poisson(RandomStream& random, double mean) {
  const double limit = std::exp(-mean);
  int count = 0;
  for (double product = random.uniform(); product > limit; product *= random.uniform()) ++count;
  return count;
}

/// A direction with this azimuth and elevation, rad.
inline Vec3 direction(double azimuth, double elevation) {
  return {std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
          std::sin(elevation)};
}

}  // namespace arex::worlds
