#pragma once

#include "semantics/working_cloud.h"

namespace arex {

/// Of the 0.4 m cubes of a cloud that hold a surface other than level ground, the share in which
/// that surface is plane and goes on in the cube beside it: high where people build, low where
/// plants grow. A stem's bark is as good as plane in a cube, but curves away beside it. 0 without
/// any such cube.
double planar_fraction(const WorkingCloud& cloud);

}  // namespace arex
