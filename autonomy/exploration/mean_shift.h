#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "math/types.h"

namespace arex {

struct Clusters {
  std::vector<Vec2> modes;         ///< densest first, more than a bandwidth apart
  std::vector<std::size_t> label;  ///< of each point: its nearest mode
};

/// Mean shift with a flat kernel: every point climbs to the mean of the points within the bandwidth
/// until it rests; modes closer than the bandwidth to a denser one join it. Deterministic.
/// Source: Comaniciu and Meer, Mean shift, PAMI 2002, as scikit-learn's MeanShift does it, which
/// rrt_exploration uses.
[[nodiscard]] Clusters mean_shift(std::span<const Vec2> points, double bandwidth_m);

}  // namespace arex
