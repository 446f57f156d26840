#pragma once

#include "math/types.h"

namespace arex::worlds {

/// Nearest point of triangle (a, b, c) to p.
/// Source: Ericson, Real-Time Collision Detection, 2005, section 5.1.5.
Vec3 nearest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c);

}  // namespace arex::worlds
