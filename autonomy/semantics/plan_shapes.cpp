#include "semantics/plan_shapes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace arex {
namespace {

/// Bounds of values without their tails.
std::pair<double, double> bounds(std::vector<double> values, double tail) {
  const auto rank = static_cast<std::ptrdiff_t>(tail * static_cast<double>(values.size()));
  const auto last = static_cast<std::ptrdiff_t>(values.size()) - 1;
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  const double low = values[static_cast<std::size_t>(rank)];
  std::nth_element(values.begin(), values.begin() + (last - rank), values.end());
  return {low, values[static_cast<std::size_t>(last - rank)]};
}

}  // namespace

Rectangle rectangle_around(std::span<const Vec2> points, double yaw_rad, double tail) {
  Rectangle out;
  if (points.empty()) return out;
  const Vec2 u(std::cos(yaw_rad), std::sin(yaw_rad)), v(-u.y(), u.x());
  std::vector<double> along, across;
  for (const Vec2& p : points) {
    along.push_back(p.dot(u));
    across.push_back(p.dot(v));
  }
  const auto [a0, a1] = bounds(std::move(along), tail);
  const auto [b0, b1] = bounds(std::move(across), tail);
  out.centre = 0.5 * (a0 + a1) * u + 0.5 * (b0 + b1) * v;
  out.length = a1 - a0;
  out.width = b1 - b0;
  out.yaw_rad = yaw_rad;
  if (out.width > out.length) {
    std::swap(out.width, out.length);
    out.yaw_rad += std::numbers::pi / 2;
  }
  while (out.yaw_rad >= std::numbers::pi) out.yaw_rad -= std::numbers::pi;
  while (out.yaw_rad < 0) out.yaw_rad += std::numbers::pi;
  return out;
}

double outline_distance(std::span<const Vec2> points, const Rectangle& box, double far) {
  const Vec2 u = box.along(), v = box.across();
  double sum = 0;
  for (const Vec2& p : points) {
    const Vec2 d = p - box.centre;
    const double side = std::min(std::abs(std::abs(d.dot(u)) - box.length / 2),
                                 std::abs(std::abs(d.dot(v)) - box.width / 2));
    sum += std::min(side, far);
  }
  return points.empty() ? 0 : sum / static_cast<double>(points.size());
}

Rectangle fit_rectangle(std::span<const Vec2> points, double tail) {
  constexpr int kAngles = 90;
  constexpr double kFar = 0.1;               // m
  constexpr std::size_t kMostPoints = 1500;  // more say the same
  std::vector<Vec2> some;
  const std::size_t stride = 1 + points.size() / kMostPoints;
  for (std::size_t i = 0; i < points.size(); i += stride) some.push_back(points[i]);
  Rectangle best;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kAngles; ++i) {
    const Rectangle box = rectangle_around(some, i * std::numbers::pi / 2 / kAngles, tail);
    const double cost = outline_distance(some, box, kFar);
    if (cost < least - 1e-12) {
      least = cost;
      best = box;
    }
  }
  return some.empty() ? best : rectangle_around(points, best.yaw_rad, tail);
}

}  // namespace arex
