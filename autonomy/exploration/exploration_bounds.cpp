#include "exploration/exploration_bounds.h"

#include <algorithm>
#include <cmath>

namespace arex {
namespace {

/// Twice the signed area of the triangle a, b, c.
double turn(const Vec2& a, const Vec2& b, const Vec2& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

/// Of c on the line through a and b.
bool is_between(const Vec2& a, const Vec2& b, const Vec2& c) {
  return (c.array() >= a.array().min(b.array())).all() &&
         (c.array() <= a.array().max(b.array())).all();
}

/// Whether the closed segments ab and cd have a point in common.
bool intersect(const Vec2& a, const Vec2& b, const Vec2& c, const Vec2& d) {
  const double ca = turn(c, d, a), cb = turn(c, d, b), ac = turn(a, b, c), ad = turn(a, b, d);
  if (((ca > 0) != (cb > 0)) && ((ac > 0) != (ad > 0)) && ca != 0 && cb != 0 && ac != 0 && ad != 0)
    return true;
  return (ca == 0 && is_between(c, d, a)) || (cb == 0 && is_between(c, d, b)) ||
         (ac == 0 && is_between(a, b, c)) || (ad == 0 && is_between(a, b, d));
}

double distance_to_segment(const Vec2& p, const Vec2& a, const Vec2& b) {
  const Vec2 along = b - a;
  const double t = std::clamp((p - a).dot(along) / along.squaredNorm(), 0.0, 1.0);
  return (a + t * along - p).norm();
}

/// Keeps what lies on the side of `limit` where sign * x[axis] <= sign * limit.
/// Source: Sutherland and Hodgman, Reentrant polygon clipping, 1974.
std::vector<Vec2> clip(const std::vector<Vec2>& corners, int axis, double limit, double sign) {
  std::vector<Vec2> kept;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vec2& a = corners[i];
    const Vec2& b = corners[(i + 1) % corners.size()];
    const bool a_in = sign * a[axis] <= sign * limit, b_in = sign * b[axis] <= sign * limit;
    if (a_in) kept.push_back(a);
    if (a_in != b_in) kept.push_back(a + (limit - a[axis]) / (b[axis] - a[axis]) * (b - a));
  }
  return kept;
}

}  // namespace

bool ExplorationBounds::Row::contains(double x) const {
  if (x < low_x || x > high_x) return false;
  if (!has_polygon) return true;
  return (std::upper_bound(crossings.begin(), crossings.end(), x) - crossings.begin()) % 2 == 1;
}

ExplorationBounds::Row ExplorationBounds::row(double y) const {
  Row row;
  if (y < low_m.y() || y > high_m.y()) return row;
  row.low_x = low_m.x();
  row.high_x = high_m.x();
  row.has_polygon = !polygon_m.empty();
  for (std::size_t i = 0; i < polygon_m.size(); ++i) {  // even-odd rule
    const Vec2& a = polygon_m[i];
    const Vec2& b = polygon_m[(i + 1) % polygon_m.size()];
    if ((a.y() > y) == (b.y() > y)) continue;
    row.crossings.push_back(a.x() + (y - a.y()) / (b.y() - a.y()) * (b.x() - a.x()));
  }
  std::sort(row.crossings.begin(), row.crossings.end());
  return row;
}

bool ExplorationBounds::is_near(const Vec2& p, double margin_m) const {
  if ((p.array() < low_m.array() - margin_m).any() ||
      (p.array() > high_m.array() + margin_m).any()) {
    return false;
  }
  if (polygon_m.empty() || contains(p)) return true;
  for (std::size_t i = 0; i < polygon_m.size(); ++i) {
    const Vec2& next = polygon_m[(i + 1) % polygon_m.size()];
    if (distance_to_segment(p, polygon_m[i], next) <= margin_m) return true;
  }
  return false;
}

std::vector<Vec2> ExplorationBounds::clipped() const {
  if (polygon_m.empty()) {
    return {low_m, Vec2(high_m.x(), low_m.y()), high_m, Vec2(low_m.x(), high_m.y())};
  }
  std::vector<Vec2> corners = polygon_m;
  for (const int axis : {0, 1}) {
    corners = clip(corners, axis, high_m[axis], 1);
    corners = clip(corners, axis, low_m[axis], -1);
  }
  return corners;
}

Eigen::AlignedBox2d ExplorationBounds::extent() const {
  Eigen::AlignedBox2d box;
  for (const Vec2& corner : clipped()) box.extend(corner);
  return box;
}

double ExplorationBounds::area_m2() const {
  const std::vector<Vec2> corners = clipped();
  double twice = 0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    twice += turn(Vec2::Zero(), corners[i], corners[(i + 1) % corners.size()]);
  }
  return std::abs(twice) / 2;
}

bool ExplorationBounds::is_simple() const {
  const std::size_t n = polygon_m.size();
  for (std::size_t i = 0; i < n; ++i) {
    const Vec2& a = polygon_m[i];
    const Vec2& b = polygon_m[(i + 1) % n];
    if (a == b) return false;
    // Neighbours share b: they may not lead back over each other.
    const Vec2& c = polygon_m[(i + 2) % n];
    if (turn(a, b, c) == 0 && (b - a).dot(c - b) < 0) return false;
    for (std::size_t j = i + 2; j < n; ++j) {
      if ((j + 1) % n != i && intersect(a, b, polygon_m[j], polygon_m[(j + 1) % n])) return false;
    }
  }
  return true;
}

}  // namespace arex
