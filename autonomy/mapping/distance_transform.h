#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace arex {

/// Squared distance that no obstacle comes near to.
inline constexpr std::int32_t kNoObstacle = std::numeric_limits<std::int32_t>::max();

/// Exact squared distances, in cells, from each cell of a row-major array to the nearest one for
/// which `is_obstacle(index)` holds; kNoObstacle where there is none.
/// Source: Meijster, Roerdink and Hesselink, A general algorithm for computing distance transforms
/// in linear time, 2000.
template <class IsObstacle>
[[nodiscard]] std::vector<std::int32_t> squared_distances(int width, int height,
                                                          const IsObstacle& is_obstacle) {
  const int none = width + height;  // further than any cell
  const auto w = static_cast<std::size_t>(width);
  const std::size_t count = w * static_cast<std::size_t>(height);
  std::vector<std::int32_t> squared(count, kNoObstacle);
  std::vector<int> column(count, none);  // to the nearest obstacle in the same column
  for (std::size_t i = 0; i < count; ++i) {
    if (is_obstacle(i)) {
      column[i] = 0;
    } else if (i >= w) {
      column[i] = std::min(none, column[i - w] + 1);
    }
  }
  for (std::size_t i = count; i-- > w;) column[i - w] = std::min(column[i - w], column[i] + 1);
  std::vector<int> site(w), from(w);  // the lower envelope: its parabolas and where each begins
  for (int y = 0; y < height; ++y) {
    const std::size_t base = static_cast<std::size_t>(y) * w;
    int top = -1;
    const auto value = [&](int x, int i) {
      const int g = column[base + static_cast<std::size_t>(i)];
      return (x - i) * (x - i) + g * g;
    };
    for (int u = 0; u < width; ++u) {
      if (column[base + static_cast<std::size_t>(u)] >= none) continue;
      while (top >= 0) {
        const auto t = static_cast<std::size_t>(top);
        if (value(from[t], site[t]) <= value(from[t], u)) break;
        --top;
      }
      int begin = 0;
      if (top >= 0) {
        const int i = site[static_cast<std::size_t>(top)];
        const int rise = value(0, u) - value(0, i);  // u^2 - i^2 + g(u)^2 - g(i)^2
        begin = 1 + static_cast<int>(std::floor(static_cast<double>(rise) / (2 * (u - i))));
      }
      if (begin >= width) continue;
      ++top;
      site[static_cast<std::size_t>(top)] = u;
      from[static_cast<std::size_t>(top)] = begin;
    }
    for (int x = width - 1; x >= 0 && top >= 0; --x) {
      const auto t = static_cast<std::size_t>(top);
      squared[base + static_cast<std::size_t>(x)] = value(x, site[t]);
      if (x == from[t]) --top;
    }
  }
  return squared;
}

}  // namespace arex
