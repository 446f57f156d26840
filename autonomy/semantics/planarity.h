#pragma once

#include <span>
#include <vector>

#include "semantics/working_cloud.h"

namespace arex {

/// What tells where people build from where plants grow, in cubes of 0.4 m.
struct Planarity {
  /// Of the cubes that hold a surface other than level ground, the share in which that surface is
  /// plane and goes on in the cube beside it. A stem's bark is as good as plane in a cube, but
  /// curves away beside it. 0 without any such cube.
  double fraction = 0;
  /// Of the columns with a level surface, the share with another one 2 m and more above it:
  /// ceilings. A wall beside a wood has none.
  double roofed = 0;
};
Planarity planarity(const WorkingCloud& cloud);

/// Which points lie in a cube whose upright surface is plane and goes on beside it.
std::vector<bool> points_on_walls(const WorkingCloud& cloud);

/// @throws ConfigError if the points lie in one place, on one line or in one plane: nothing stands
/// there, and no ground is that even.
void expect_extent(std::span<const Vec3f> points);

}  // namespace arex
