#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "math/types.h"

namespace arex {

/// A rectangle seen from above: length along `yaw_rad`, the longer side.
struct Rectangle {
  Vec2 centre = Vec2::Zero();
  double length = 0;
  double width = 0;
  double yaw_rad = 0;  ///< in [0, pi)

  [[nodiscard]] Vec2 along() const { return {std::cos(yaw_rad), std::sin(yaw_rad)}; }
  [[nodiscard]] Vec2 across() const { return {-std::sin(yaw_rad), std::cos(yaw_rad)}; }
  /// How far a point lies outside; negative inside.
  [[nodiscard]] double distance(const Vec2& p) const {
    const Vec2 d = p - centre;
    return std::max(std::abs(d.dot(along())) - length / 2, std::abs(d.dot(across())) - width / 2);
  }
  /// Whether distance(p) < reach; without it for what is far off. @pre reach >= 0
  [[nodiscard]] bool reaches(const Vec2& p, double reach) const {
    const double most = 0.5 * (length + width) + 2 * reach;
    return (p - centre).squaredNorm() < most * most && distance(p) < reach;
  }
};

/// The rectangle of this direction that holds all points but `tail` of them at each side.
Rectangle rectangle_around(std::span<const Vec2> points, double yaw_rad, double tail);

/// The rectangle whose sides the points lie on best: of all directions, in steps of a degree, the
/// one with the least mean distance of the points from the nearest side, distances beyond 0.1 m
/// counted as that. Source: Zhang, Xu, Dong and Dolan, Efficient L-shape fitting for vehicle
/// detection using laser scanners, IV 2017 (closeness criterion).
Rectangle fit_rectangle(std::span<const Vec2> points, double tail);

/// Mean distance of points from the nearest side of a rectangle, those further than `far` counted
/// as that far.
double outline_distance(std::span<const Vec2> points, const Rectangle& box, double far);

}  // namespace arex
