#pragma once

#include <cstdint>
#include <string_view>

#include "math/types.h"

namespace arex {

/// A named stream of random numbers: a counter passed through a 64-bit mixer, so that draw i is a
/// pure function of (seed, name, i) and work may be split between threads without changing a bit.
/// Source: Steele, Lea and Flood, Fast splittable pseudorandom number generators, 2014
/// (SplitMix64).
class RandomStream {
 public:
  RandomStream(std::uint64_t seed, std::string_view name);

  /// A stream of its own for item `index` of this stream: for work whose order is free.
  [[nodiscard]] RandomStream fork(std::uint64_t index) const;

  std::uint64_t bits();  ///< 64 uniform bits
  double uniform();      ///< in [0, 1)
  double uniform(double low, double high);
  int uniform_int(int low, int high);  ///< in [low, high], both included
  double normal();                     ///< mean 0, standard deviation 1 (ziggurat)
  Vec3 normal3() {
    const double x = normal(), y = normal(), z = normal();
    return {x, y, z};
  }

 private:
  explicit RandomStream(std::uint64_t state) : state_(state) {}
  std::uint64_t state_;
};

}  // namespace arex
