#include "worlds/world.h"

#include <algorithm>
#include <cmath>

namespace arex::worlds {

double HeightField::at(double x, double y) const {
  if (columns < 2 || rows < 2) return 0;
  const double u = std::clamp((x - origin.x()) / spacing_m, 0.0, static_cast<double>(columns - 1));
  const double v = std::clamp((y - origin.y()) / spacing_m, 0.0, static_cast<double>(rows - 1));
  const int column = std::min(static_cast<int>(u), columns - 2);
  const int row = std::min(static_cast<int>(v), rows - 2);
  const double du = u - column;
  const double dv = v - row;
  const auto height = [&](int c, int r) {
    return static_cast<double>(
        height_m[static_cast<std::size_t>(r) * static_cast<std::size_t>(columns) +
                 static_cast<std::size_t>(c)]);
  };
  const double low = height(column, row);
  const double high = height(column + 1, row + 1);
  // The triangle under the diagonal holds the corner (1, 0), the one above it (0, 1).
  if (du >= dv) {
    const double corner = height(column + 1, row);
    return low + du * (corner - low) + dv * (high - corner);
  }
  const double corner = height(column, row + 1);
  return low + dv * (corner - low) + du * (high - corner);
}

}  // namespace arex::worlds
