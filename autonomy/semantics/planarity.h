#pragma once

#include "semantics/working_cloud.h"

namespace arex {

/// Of the 0.4 m cubes of a cloud that hold a surface other than level ground, the share in which
/// that surface is plane: high where people build, low where plants grow. 0 without any such cube.
double planar_fraction(const WorkingCloud& cloud);

}  // namespace arex
