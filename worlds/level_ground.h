#pragma once

#include <cmath>

#include "worlds/world.h"

namespace arex::worlds {

/// A height field at z = 0 that covers [low, high], sampled every metre: any spacing would do.
inline HeightField level_ground(const Vec2& low, const Vec2& high) {
  HeightField field;
  field.origin = low;
  field.spacing_m = 1;
  field.columns = static_cast<int>(std::ceil(high.x() - low.x() - 1e-9)) + 1;
  field.rows = static_cast<int>(std::ceil(high.y() - low.y() - 1e-9)) + 1;
  field.height_m.assign(
      static_cast<std::size_t>(field.columns) * static_cast<std::size_t>(field.rows), 0.0F);
  return field;
}

}  // namespace arex::worlds
