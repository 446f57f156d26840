#include "worlds_garage/world_probe.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace arex::worlds::probe {

std::array<Vec3, 3> corners(const World& world, std::size_t triangle) {
  std::array<Vec3, 3> out;
  for (std::size_t i = 0; i < 3; ++i) {
    out[i] = world.mesh.vertices[world.mesh.triangles[triangle][i]].cast<double>();
  }
  return out;
}

std::optional<Hit> cast(const World& world, const Vec3& origin, const Vec3& direction) {
  double nearest = std::numeric_limits<double>::infinity();
  std::size_t found = 0;
  for (std::size_t i = 0; i < world.mesh.triangles.size(); ++i) {
    const auto [a, b, c] = corners(world, i);
    const Vec3 e1 = b - a, e2 = c - a, p = direction.cross(e2);
    const double determinant = e1.dot(p);
    if (std::abs(determinant) < 1e-14) continue;
    const Vec3 s = origin - a;
    const double u = s.dot(p) / determinant;
    if (u < -1e-9 || u > 1 + 1e-9) continue;
    const Vec3 q = s.cross(e1);
    const double v = direction.dot(q) / determinant;
    if (v < -1e-9 || u + v > 1 + 1e-9) continue;
    const double t = e2.dot(q) / determinant;
    if (t > 1e-9 && t < nearest) {
      nearest = t;
      found = i;
    }
  }
  if (!std::isfinite(nearest)) return std::nullopt;
  return Hit{nearest * direction.norm(), world.mesh.object_of_triangle[found],
             world.class_of_triangle(found)};
}

double distance_to_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const auto to_segment = [&](const Vec3& u, const Vec3& v) {
    const Vec3 d = v - u;
    const double length2 = d.squaredNorm();
    const double t = length2 > 0 ? std::clamp((p - u).dot(d) / length2, 0.0, 1.0) : 0.0;
    return (p - u - t * d).norm();
  };
  const double edges = std::min({to_segment(a, b), to_segment(b, c), to_segment(c, a)});
  const Vec3 normal = (b - a).cross(c - a);
  const double area2 = normal.squaredNorm();
  if (area2 < 1e-20) return edges;
  const double u = (b - a).cross(p - a).dot(normal), v = (c - b).cross(p - b).dot(normal),
               w = (a - c).cross(p - c).dot(normal);
  if (u < 0 || v < 0 || w < 0) return edges;
  return std::abs((p - a).dot(normal)) / std::sqrt(area2);
}

double distance_to_shape(const CollisionShape& shape, const Vec3& p_W) {
  const Vec3 p = shape.X_WS.inverse() * p_W;
  switch (shape.kind) {
    case CollisionShape::Kind::kBox:
      return (p.cwiseAbs() - shape.size).cwiseMax(0.0).norm();
    case CollisionShape::Kind::kCylinder: {
      const double radial = std::max(0.0, p.head<2>().norm() - shape.size.x());
      const double axial = std::max(0.0, std::abs(p.z()) - shape.size.y());
      return std::hypot(radial, axial);
    }
    case CollisionShape::Kind::kCapsule: {
      const double along = std::clamp(p.z(), -shape.size.y(), shape.size.y());
      return std::max(0.0, (p - Vec3(0, 0, along)).norm() - shape.size.x());
    }
  }
  return 0;
}

bool boxes_overlap(const CollisionShape& a, const CollisionShape& b, double slack) {
  std::vector<Vec3> axes;
  for (int i = 0; i < 3; ++i) {
    axes.emplace_back(a.X_WS.R.col(i));
    axes.emplace_back(b.X_WS.R.col(i));
    for (int j = 0; j < 3; ++j) {
      const Vec3 cross = a.X_WS.R.col(i).cross(b.X_WS.R.col(j));
      if (cross.norm() > 1e-6) axes.emplace_back(cross.normalized());
    }
  }
  return std::none_of(axes.begin(), axes.end(), [&](const Vec3& axis) {
    const double reach = (a.X_WS.R.transpose() * axis).cwiseAbs().dot(a.size) +
                         (b.X_WS.R.transpose() * axis).cwiseAbs().dot(b.size);
    return std::abs(axis.dot(a.X_WS.p - b.X_WS.p)) > reach - slack;
  });
}

std::vector<std::vector<std::size_t>> triangles_by_object(const World& world) {
  std::vector<std::vector<std::size_t>> out(world.objects.size());
  for (std::size_t i = 0; i < world.mesh.triangles.size(); ++i) {
    out[world.mesh.object_of_triangle[i]].push_back(i);
  }
  return out;
}

Eigen::AlignedBox3d box_of(const World& world, const std::vector<std::size_t>& triangles) {
  Eigen::AlignedBox3d box;
  for (const std::size_t i : triangles) {
    for (const Vec3& corner : corners(world, i)) box.extend(corner);
  }
  return box;
}

}  // namespace arex::worlds::probe
