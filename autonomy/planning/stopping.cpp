#include "planning/stopping.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "planning/curve_check.h"
#include "planning/free_space.h"

namespace arex {
namespace {

constexpr double kWantedRoom_m =
    0.6;                          ///< clearances beyond this are all alike: twice the vehicle's
constexpr double kLook_s = 0.05;  ///< between the places of a stop that are looked at
constexpr double kHover_s = 1.0;  ///< how long it will stay where the stop ends
constexpr double kStopped_mps = 1e-9;
/// Swerves tried: angle (rad) of the first push from straight back, and how long it lasts (s).
constexpr double kSwerveAngles[] = {0.35, 0.7, 1.05, 1.4};
constexpr double kSwerveTimes[] = {0.1, 0.2, 0.3, 0.45};

/// Pushes with a constant acceleration for a while, then brakes along the velocity until at rest.
/// Written straight into the control points, so |A_i| is the limit itself and the ramp from the
/// start's acceleration takes one knot span.
UniformBspline stop_with(const MotionState& state, const Vec3& push, double push_s,
                         const MotionLimits& limits, double dt) {
  const auto head = UniformBspline::boundary(state, dt);
  std::vector<Vec3> q(head.begin(), head.end());
  Vec3 v = (q[2] - q[1]) / dt;  // V_1
  const double step = limits.max_acceleration_mps2 * dt;
  const int pushes = static_cast<int>(std::lround(push_s / dt));
  for (int k = 0; v.norm() > kStopped_mps || k < pushes; ++k) {
    if (k < pushes) {
      v += push * dt;
    } else {
      v = v.norm() > step ? Vec3(v - step * v.normalized()) : Vec3::Zero();
    }
    q.push_back(q.back() + v * dt);
  }
  const Vec3 end = q.back();
  q.insert(q.end(), 2, end);
  while (q.size() < 7) q.push_back(end);
  return {std::move(q), dt};
}

template <class Visit>
void for_each_swerve(const MotionState& state, const MotionLimits& limits, double dt, Visit visit) {
  const double speed = state.v.norm();
  if (speed < kStopped_mps) return;
  const Vec3 ahead = state.v / speed;
  const Vec3 across = Vec3::UnitZ().cross(ahead);
  const Vec3 left = across.norm() > 1e-6 ? Vec3(across.normalized()) : Vec3::UnitY();
  const Vec3 up = ahead.cross(left);
  for (const Vec3& side : {left, Vec3(-left), up, Vec3(-up)}) {
    for (const double angle : kSwerveAngles) {
      const Vec3 push =
          limits.max_acceleration_mps2 * (std::sin(angle) * side - std::cos(angle) * ahead);
      for (const double duration : kSwerveTimes) {
        visit(stop_with(state, push, duration, limits, dt));
      }
    }
  }
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

KnownPrefix known_prefix(const GridView& grid, const UniformBspline& spline, double from_s,
                         double own_radius_m) {
  KnownPrefix prefix{from_s, 0.0, false};
  const double dt = spline.knot_span_s();
  double t = std::clamp(from_s, 0.0, spline.duration_s());
  const Vec3 start = spline.position(t);
  Vec3 p = start;
  while (t < spline.duration_s()) {
    const int span = std::min(static_cast<int>(t / dt), spline.spans() - 1);
    const double speed = std::max(spline.speed_bound(span), 1e-3);
    const double next =
        std::min({t + 0.25 * grid.resolution_m / speed, t + 0.25 * dt, spline.duration_s()});
    const Vec3 q = spline.position(next);
    const std::uint8_t flags = grid.at(q);
    const bool known = (flags & GridView::kKnown) != 0 || (q - start).norm() <= own_radius_m;
    if (!known || (flags & GridView::kOccupied) != 0) return prefix;
    prefix.length_m += (q - p).norm();
    prefix.end_s = t = next;
    p = q;
  }
  prefix.whole = true;
  return prefix;
}

UniformBspline brake(const MotionState& state, const MotionLimits& limits, double dt) {
  return stop_with(state, Vec3::Zero(), 0.0, limits, dt);
}

std::optional<UniformBspline> find_stop(const GridView& grid, const MotionState& state,
                                        const MotionLimits& limits, double dt,
                                        const Vec3& towards) {
  UniformBspline straight = brake(state, limits, dt);
  if (!first_collision(grid, straight)) return straight;
  std::optional<UniformBspline> best;
  double best_distance = std::numeric_limits<double>::infinity();
  for_each_swerve(state, limits, dt, [&](UniformBspline stop) {
    const double distance = (stop.control_points().back() - towards).norm();
    if (distance >= best_distance || first_collision(grid, stop)) return;
    best_distance = distance;
    best = std::move(stop);
  });
  return best;
}

UniformBspline widest_stop(const GridView& grid, const MotionState& state,
                           const MotionLimits& limits, double dt) {
  const auto risk = [&](const UniformBspline& stop) {
    const auto clearance_deficit = [&](double t) {
      const double missing = kWantedRoom_m - clearance(grid, stop.position(t), kWantedRoom_m);
      return missing * missing;
    };
    double sum = kHover_s * clearance_deficit(stop.duration_s());
    for (double t = 0; t < stop.duration_s(); t += kLook_s) sum += kLook_s * clearance_deficit(t);
    return sum;
  };
  UniformBspline best = brake(state, limits, dt);
  double least = risk(best);
  for_each_swerve(state, limits, dt, [&](UniformBspline stop) {
    const double found = risk(stop);
    if (found >= least) return;
    least = found;
    best = std::move(stop);
  });
  return best;
}

}  // namespace arex
