#include "planning/uniform_bspline.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace arex {
namespace {

/// Solves the symmetric positive definite pentadiagonal system (diagonals d0, d1, d2) in place.
void solve_pentadiagonal(std::vector<double> d0, std::vector<double> d1, std::vector<double> d2,
                         std::vector<Vec3>& x) {
  const std::size_t n = x.size();
  // LDL^T with two sub-diagonals: l1[i] = L(i+1, i), l2[i] = L(i+2, i), kept in d1 and d2.
  for (std::size_t i = 0; i < n; ++i) {
    if (i + 1 < n) {
      const double l1 = d1[i] / d0[i];
      d0[i + 1] -= l1 * d1[i];
      if (i + 2 < n) {
        const double l2 = d2[i] / d0[i];
        d1[i + 1] -= l2 * d1[i];
        d0[i + 2] -= l2 * d2[i];
        d2[i] = l2;
      }
      d1[i] = l1;
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    if (i + 1 < n) x[i + 1] -= d1[i] * x[i];
    if (i + 2 < n) x[i + 2] -= d2[i] * x[i];
  }
  for (std::size_t i = n; i-- > 0;) {
    x[i] /= d0[i];
    if (i + 1 < n) x[i] -= d1[i] * x[i + 1];
    if (i + 2 < n) x[i] -= d2[i] * x[i + 2];
  }
}

}  // namespace

UniformBspline::UniformBspline(std::vector<Vec3> control_points, double knot_span_s)
    : control_points_(std::move(control_points)), knot_span_s_(knot_span_s) {
  if (control_points_.size() < 4 || !(knot_span_s > 0)) {
    throw std::invalid_argument("UniformBspline: needs 4 control points and a positive knot span");
  }
}

std::array<Vec3, 3> UniformBspline::boundary(const MotionState& state, double dt) {
  // From p = (Q0 + 4 Q1 + Q2) / 6, v = (Q2 - Q0) / (2 dt), a = (Q0 - 2 Q1 + Q2) / dt^2.
  const Vec3 middle = state.p - state.a * (dt * dt / 6.0);
  const Vec3 bend = state.a * (dt * dt / 2.0);
  return {middle + bend - state.v * dt, middle, middle + bend + state.v * dt};
}

UniformBspline UniformBspline::fit(std::span<const Vec3> points, const MotionState& start,
                                   const MotionState& end, double dt) {
  if (points.size() < 5) throw std::invalid_argument("UniformBspline::fit: needs 5 points");
  const std::size_t m = points.size(), n = m + 2, free = n - 6;
  std::vector<Vec3> q(n, Vec3::Zero());
  const auto head = boundary(start, dt), tail = boundary(end, dt);
  std::copy(head.begin(), head.end(), q.begin());
  std::copy(tail.begin(), tail.end(), q.end() - 3);

  // Rows (1 4 1)/6 of the knots 1 .. m-2; columns Q_3 .. Q_{n-4}.
  const double w[3] = {1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0};
  std::vector<double> d0(free, 0.0), d1(free, 0.0), d2(free, 0.0);
  std::vector<Vec3> x(free, Vec3::Zero());
  for (std::size_t row = 1; row + 1 < m; ++row) {
    Vec3 residual = points[row];
    for (std::size_t k = 0; k < 3; ++k) residual -= w[k] * q[row + k];  // free ones are still zero
    for (std::size_t k = 0; k < 3; ++k) {
      if (row + k < 3 || row + k >= n - 3) continue;
      const std::size_t i = row + k - 3;
      x[i] += w[k] * residual;
      d0[i] += w[k] * w[k];
      if (k + 1 < 3 && row + k + 1 < n - 3) d1[i] += w[k] * w[k + 1];
      if (k + 2 < 3 && row + k + 2 < n - 3) d2[i] += w[k] * w[k + 2];
    }
  }
  solve_pentadiagonal(std::move(d0), std::move(d1), std::move(d2), x);
  std::copy(x.begin(), x.end(), q.begin() + 3);
  return {std::move(q), dt};
}

UniformBspline::Place UniformBspline::place(double t_s) const {
  const double x = std::clamp(t_s / knot_span_s_, 0.0, static_cast<double>(spans()));
  const int span = std::min(static_cast<int>(x), spans() - 1);
  return {static_cast<std::size_t>(span), x - span};
}

Vec3 UniformBspline::position(double t_s) const {
  const auto [i, u] = place(t_s);
  const double w = 1.0 - u, u2 = u * u, u3 = u2 * u;
  const Vec3* q = &control_points_[i];
  return (w * w * w * q[0] + (3 * u3 - 6 * u2 + 4) * q[1] + (-3 * u3 + 3 * u2 + 3 * u + 1) * q[2] +
          u3 * q[3]) /
         6.0;
}

Vec3 UniformBspline::velocity(double t_s) const {
  const auto [i, u] = place(t_s);
  const Vec3* q = &control_points_[i];
  const double w = 1.0 - u;
  return (w * w * (q[1] - q[0]) + (1 + 2 * u * w) * (q[2] - q[1]) + u * u * (q[3] - q[2])) /
         (2.0 * knot_span_s_);
}

Vec3 UniformBspline::acceleration(double t_s) const {
  const auto [i, u] = place(t_s);
  const Vec3* q = &control_points_[i];
  return ((1.0 - u) * (q[0] - 2 * q[1] + q[2]) + u * (q[1] - 2 * q[2] + q[3])) /
         (knot_span_s_ * knot_span_s_);
}

Vec3 UniformBspline::jerk(double t_s) const {
  const Vec3* q = &control_points_[place(t_s).span];
  return (q[3] - 3 * q[2] + 3 * q[1] - q[0]) / (knot_span_s_ * knot_span_s_ * knot_span_s_);
}

MotionState UniformBspline::state(double t_s) const {
  return {position(t_s), velocity(t_s), acceleration(t_s)};
}

double UniformBspline::speed_bound(int span) const {
  const Vec3* q = &control_points_[static_cast<std::size_t>(span)];
  const double squared = std::max(
      {(q[1] - q[0]).squaredNorm(), (q[2] - q[1]).squaredNorm(), (q[3] - q[2]).squaredNorm()});
  return std::sqrt(squared) / knot_span_s_;
}

double UniformBspline::acceleration_bound(int span) const {
  const Vec3* q = &control_points_[static_cast<std::size_t>(span)];
  const double squared =
      std::max((q[0] - 2 * q[1] + q[2]).squaredNorm(), (q[1] - 2 * q[2] + q[3]).squaredNorm());
  return std::sqrt(squared) / (knot_span_s_ * knot_span_s_);
}

double UniformBspline::speed_bound() const {
  double bound = 0;
  for (int i = 0; i < spans(); ++i) bound = std::max(bound, speed_bound(i));
  return bound;
}

double UniformBspline::acceleration_bound() const {
  double bound = 0;
  for (int i = 0; i < spans(); ++i) bound = std::max(bound, acceleration_bound(i));
  return bound;
}

}  // namespace arex
