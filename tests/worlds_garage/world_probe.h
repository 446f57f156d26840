#pragma once

#include <array>
#include <optional>
#include <vector>

#include "worlds/world.h"

/// Brute-force questions to a world: the oracles of these tests.
namespace arex::worlds::probe {

struct Hit {
  double distance = 0;
  std::uint32_t object = 0;
  SurfaceClass surface_class = SurfaceClass::kGround;
};

/// The nearest triangle along a ray, by trying all of them (Moeller and Trumbore, 1997).
std::optional<Hit> cast(const World& world, const Vec3& origin, const Vec3& direction);

/// Distance from a point to a triangle (Ericson, Real-Time Collision Detection, 5.1.5).
double distance_to_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c);

/// Distance from a point to a solid, 0 inside.
double distance_to_shape(const CollisionShape& shape, const Vec3& p);

/// Do two boxes overlap by more than `slack` along every separating axis? (15 axes)
bool boxes_overlap(const CollisionShape& a, const CollisionShape& b, double slack);

/// A triangle's corners.
std::array<Vec3, 3> corners(const World& world, std::size_t triangle);

/// The triangles of each object.
std::vector<std::vector<std::size_t>> triangles_by_object(const World& world);

/// The bounding box of an object's triangles.
Eigen::AlignedBox3d box_of(const World& world, const std::vector<std::size_t>& triangles);

}  // namespace arex::worlds::probe
