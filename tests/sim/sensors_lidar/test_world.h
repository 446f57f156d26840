#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "physics/truth.h"
#include "worlds/world.h"

/// Small worlds of known geometry, and truths to look at them from.
namespace arex::sim::test {

class WorldMaker {
 public:
  /// A new object; what is added next belongs to it.
  WorldMaker& object(float reflectivity,
                     worlds::SurfaceClass surface_class = worlds::SurfaceClass::kWall) {
    world_.objects.push_back({surface_class, reflectivity});
    return *this;
  }
  WorldMaker& triangle(const Vec3& a, const Vec3& b, const Vec3& c) {
    const auto first = static_cast<std::uint32_t>(world_.mesh.vertices.size());
    for (const Vec3& corner : {a, b, c}) world_.mesh.vertices.push_back(corner.cast<float>());
    world_.mesh.triangles.push_back({first, first + 1, first + 2});
    world_.mesh.object_of_triangle.push_back(static_cast<std::uint32_t>(world_.objects.size() - 1));
    return *this;
  }
  /// The parallelogram with one corner and two edges.
  WorldMaker& quad(const Vec3& corner, const Vec3& u, const Vec3& v) {
    triangle(corner, corner + u, corner + u + v);
    return triangle(corner, corner + u + v, corner + v);
  }
  /// A surface given by two parameters in [0, 1], cut into columns x rows quads.
  template <class Surface>
  WorldMaker& surface(int columns, int rows, const Surface& at) {
    for (int i = 0; i < columns; ++i) {
      for (int j = 0; j < rows; ++j) {
        const double u0 = static_cast<double>(i) / columns, u1 = (i + 1.0) / columns;
        const double v0 = static_cast<double>(j) / rows, v1 = (j + 1.0) / rows;
        const Vec3 a = at(u0, v0), b = at(u1, v0), c = at(u1, v1), d = at(u0, v1);
        triangle(a, b, c);
        triangle(a, c, d);
      }
    }
    return *this;
  }
  WorldMaker& sphere(const Vec3& centre, double radius, int columns, int rows) {
    return surface(columns, rows, [&](double u, double v) {
      const double azimuth = 2 * std::numbers::pi * u, polar = std::numbers::pi * v;
      return Vec3(centre + radius * Vec3(std::sin(polar) * std::cos(azimuth),
                                         std::sin(polar) * std::sin(azimuth), std::cos(polar)));
    });
  }
  /// Open tube about the z axis of a frame X, from -half_length to half_length.
  WorldMaker& tube(const Pose& X, double radius, double half_length, int columns) {
    return surface(columns, 1, [&](double u, double v) {
      const double angle = 2 * std::numbers::pi * u;
      return X *
             Vec3(radius * std::cos(angle), radius * std::sin(angle), half_length * (2 * v - 1));
    });
  }
  /// The six faces of a box, axes of X.
  WorldMaker& box(const Pose& X, const Vec3& half) {
    for (int axis = 0; axis < 3; ++axis) {
      Vec3 normal = Vec3::Zero(), u = Vec3::Zero(), v = Vec3::Zero();
      normal[axis] = half[axis];
      u[(axis + 1) % 3] = half[(axis + 1) % 3];
      v[(axis + 2) % 3] = half[(axis + 2) % 3];
      for (const double side : {-1.0, 1.0}) {
        quad(X * Vec3(side * normal - u - v), X.R * (2 * u), X.R * (2 * v));
      }
    }
    return *this;
  }
  [[nodiscard]] const worlds::World& world() const { return world_; }

 private:
  worlds::World world_;
};

/// A room about the origin, known in closed form.
inline const Vec3 kRoomHalf(9, 7, 5);
inline worlds::World room() { return WorldMaker().object(0.6F).box(Pose{}, kRoomHalf).world(); }

/// Distance along a ray from inside the room to its walls.
inline double to_wall(const Vec3& o, const Vec3& d) {
  double best = 1e9;
  for (int i = 0; i < 3; ++i) {
    if (d[i] != 0) best = std::min(best, (std::copysign(kRoomHalf[i], d[i]) - o[i]) / d[i]);
  }
  return best;
}

/// The vehicle at rest for `count` ticks from `start`, one more truth than ticks.
inline std::vector<Truth> rest(const Pose& X_WB, int count = 100, Stamp start = 0) {
  std::vector<Truth> ticks(static_cast<std::size_t>(count) + 1);
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    ticks[i].stamp = start + static_cast<Stamp>(i) * kNanosecondsPerTick;
    ticks[i].X_WB = X_WB;
  }
  return ticks;
}

}  // namespace arex::sim::test
