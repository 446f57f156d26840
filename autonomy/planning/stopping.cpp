#include "planning/stopping.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "planning/curve_check.h"
#include "planning/quintic.h"

namespace arex {
namespace {

constexpr double kLimitShare = 1.04;  ///< of the acceleration limit that a stop may use
constexpr double kStretch = 1.12;     ///< between tried durations
constexpr int kMaxStretches = 14;

std::optional<UniformBspline> stop_at(const MotionState& state, const Vec3& offset,
                                      double duration_s, const MotionLimits& limits,
                                      double knot_span_s) {
  const int knots = std::max(5, static_cast<int>(std::ceil(duration_s / knot_span_s)));
  const Vec3 end =
      state.p + state.v * (duration_s / 2) + state.a * (duration_s * duration_s / 12) + offset;
  const Quintic motion(state, {end, Vec3::Zero(), Vec3::Zero()}, knots * knot_span_s);
  std::vector<Vec3> points;
  for (int k = 0; k <= knots; ++k) points.push_back(motion.position(k * knot_span_s));
  UniformBspline spline =
      UniformBspline::fit(points, state, {end, Vec3::Zero(), Vec3::Zero()}, knot_span_s);
  // What the start already has cannot be taken back at once.
  const double acceleration = std::max(limits.max_acceleration_mps2, state.a.norm());
  const double speed = std::max(limits.max_speed_mps, state.v.norm());
  if (spline.acceleration_bound() > kLimitShare * acceleration) return std::nullopt;
  if (spline.speed_bound() > kLimitShare * speed) return std::nullopt;
  return spline;
}

double shortest_duration(const MotionState& state, const MotionLimits& limits) {
  return std::max(4 * 0.05, state.v.norm() / limits.max_acceleration_mps2);
}

}  // namespace

double stopping_distance(double speed, double braking, double reaction_s) {
  return speed * reaction_s + speed * speed / (2 * braking);
}

double stoppable_speed(double distance, double braking, double reaction_s) {
  if (distance <= 0) return 0;
  const double b = braking * reaction_s;
  return std::sqrt(b * b + 2 * braking * distance) - b;
}

KnownPrefix known_free_prefix(const GridView& grid, const UniformBspline& spline, double from_s) {
  KnownPrefix prefix{from_s, 0.0, false};
  const double dt = spline.knot_span_s();
  double t = std::clamp(from_s, 0.0, spline.duration_s());
  Vec3 p = spline.position(t);
  while (t < spline.duration_s()) {
    const int span = std::min(static_cast<int>(t / dt), spline.spans() - 1);
    const double speed = std::max(spline.speed_bound(span), 1e-3);
    const double next =
        std::min({t + 0.25 * grid.resolution_m / speed, t + 0.25 * dt, spline.duration_s()});
    const Vec3 q = spline.position(next);
    if (!grid.known(q) || grid.inflated(q)) return prefix;
    prefix.length_m += (q - p).norm();
    prefix.end_s = t = next;
    p = q;
  }
  prefix.whole = true;
  return prefix;
}

UniformBspline brake(const MotionState& state, const MotionLimits& limits, double dt) {
  double duration = shortest_duration(state, limits);
  for (int k = 0; k < 4 * kMaxStretches; ++k, duration *= kStretch) {
    if (auto spline = stop_at(state, Vec3::Zero(), duration, limits, dt)) return *std::move(spline);
  }
  // Only an absurd start comes here; stop where its velocity leads, slowly.
  const Vec3 end = state.p + state.v * (duration / 2);
  const int knots = std::max(5, static_cast<int>(std::ceil(duration / dt)));
  const Quintic motion(state, {end, Vec3::Zero(), Vec3::Zero()}, knots * dt);
  std::vector<Vec3> points;
  for (int k = 0; k <= knots; ++k) points.push_back(motion.position(k * dt));
  return UniformBspline::fit(points, state, {end, Vec3::Zero(), Vec3::Zero()}, dt);
}

std::optional<UniformBspline> find_stop(const GridView& grid, const MotionState& state,
                                        const MotionLimits& limits, double dt,
                                        const Vec3& towards) {
  const double speed = state.v.norm();
  UniformBspline straight = brake(state, limits, dt);
  if (!first_collision(grid, straight)) return straight;
  const Vec3 ahead = speed > 1e-6 ? Vec3(state.v / speed) : Vec3::UnitX();
  Vec3 left = Vec3::UnitZ().cross(ahead);
  left = left.norm() > 1e-6 ? left.normalized() : Vec3::UnitY();
  const Vec3 up = ahead.cross(left);

  std::optional<UniformBspline> best;
  double best_distance = std::numeric_limits<double>::infinity();
  const double reach = stopping_distance(speed, limits.max_acceleration_mps2, 0.1);
  for (const double sideways : {-1.0, -0.7, -0.4, -0.2, 0.0, 0.2, 0.4, 0.7, 1.0}) {
    for (const double upwards : {0.0, -0.4, 0.4}) {
      for (const double forwards : {-0.3, 0.0, 0.5}) {
        const Vec3 offset = reach * (sideways * left + upwards * up + forwards * ahead);
        double duration = shortest_duration(state, limits);
        for (int k = 0; k < kMaxStretches; ++k, duration *= kStretch) {
          auto spline = stop_at(state, offset, duration, limits, dt);
          if (!spline) continue;
          const double distance = (spline->control_points().back() - towards).norm();
          if (distance < best_distance && !first_collision(grid, *spline)) {
            best_distance = distance;
            best = std::move(spline);
          }
          break;
        }
      }
    }
  }
  return best;
}

}  // namespace arex
