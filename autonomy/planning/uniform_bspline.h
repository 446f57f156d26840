#pragma once

#include <array>
#include <span>
#include <vector>

#include "math/types.h"

namespace arex {

/// Position, velocity and acceleration at one moment, in O (m, m/s, m/s^2).
struct MotionState {
  Vec3 p = Vec3::Zero();
  Vec3 v = Vec3::Zero();
  Vec3 a = Vec3::Zero();
};

/// A uniform cubic B-spline Phi over time: n control points Q_i, one knot span dt (paper, eq.
/// (16)). It lives on [0, (n - 3) dt]; span i is shaped by Q_i .. Q_{i+3} and lies in
/// their convex hull. The control points of its derivatives are
///     V_i = (Q_{i+1} - Q_i) / dt,   A_i = (V_{i+1} - V_i) / dt,   J_i = (A_{i+1} - A_i) / dt.
/// Times outside are clamped to the ends.
class UniformBspline {
 public:
  UniformBspline() = default;
  /// @pre at least 4 control points, knot_span_s > 0.
  UniformBspline(std::vector<Vec3> control_points, double knot_span_s);

  /// The three control points that give the spline exactly p, v, a at the middle one's knot.
  static std::array<Vec3, 3> boundary(const MotionState& state, double knot_span_s);

  /// Least squares through `points` (one per knot, the first and last are the ends) with position,
  /// velocity and acceleration of both ends held exactly. @pre at least 5 points.
  static UniformBspline fit(std::span<const Vec3> points, const MotionState& start,
                            const MotionState& end, double knot_span_s);

  [[nodiscard]] bool empty() const { return control_points_.empty(); }
  [[nodiscard]] const std::vector<Vec3>& control_points() const { return control_points_; }
  [[nodiscard]] double knot_span_s() const { return knot_span_s_; }
  [[nodiscard]] int spans() const { return static_cast<int>(control_points_.size()) - 3; }
  [[nodiscard]] double duration_s() const { return empty() ? 0.0 : spans() * knot_span_s_; }

  [[nodiscard]] Vec3 position(double t_s) const;
  [[nodiscard]] Vec3 velocity(double t_s) const;
  [[nodiscard]] Vec3 acceleration(double t_s) const;
  [[nodiscard]] Vec3 jerk(double t_s) const;
  [[nodiscard]] MotionState state(double t_s) const;

  /// max |V_i|: no speed exceeds it (convex hull); m/s.
  [[nodiscard]] double speed_bound() const;
  /// max |V_i| over the three that shape span i.
  [[nodiscard]] double speed_bound(int span) const;
  /// max |A_i|: the exact maximum, for acceleration is linear between the A_i; m/s^2.
  [[nodiscard]] double acceleration_bound() const;
  /// max |A_i| over the two that shape span i.
  [[nodiscard]] double acceleration_bound(int span) const;

 private:
  struct Place {
    std::size_t span;
    double u;  ///< in [0, 1] within the span
  };
  [[nodiscard]] Place place(double t_s) const;

  std::vector<Vec3> control_points_;
  double knot_span_s_ = 0;
};

}  // namespace arex
