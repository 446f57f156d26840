#include "support/analytic_motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "math/so3.h"

namespace arex::test {
namespace {

constexpr int kDegree = 5;

/// Uniform B-spline of unit knots at u: the curve of `points` of this degree (de Boor).
Vec4 de_boor(const std::vector<Vec4>& points, int degree, double u) {
  const int last = static_cast<int>(points.size()) - 1;
  const int span = static_cast<int>(std::floor(u));
  std::vector<Vec4> d;
  for (int i = 0; i <= degree; ++i) {
    d.push_back(points[static_cast<std::size_t>(std::clamp(span + i, 0, last))]);
  }
  const double s = u - span;
  for (int r = 1; r <= degree; ++r) {
    for (int j = degree; j >= r; --j) {
      const double alpha = (s + degree - j) / (degree - r + 1);
      const auto k = static_cast<std::size_t>(j);
      d[k] = (1 - alpha) * d[k - 1] + alpha * d[k];
    }
  }
  return d[static_cast<std::size_t>(degree)];
}

}  // namespace

AnalyticMotion::AnalyticMotion(std::vector<Vec4> control_points, double knot_s, double rest_s)
    : knot_s_(knot_s), rest_s_(rest_s) {
  control_points.insert(control_points.begin(), kDegree, control_points.front());
  control_points.insert(control_points.end(), kDegree, control_points.back());
  differences_.push_back(std::move(control_points));
  for (int order = 1; order <= 2; ++order) {
    const std::vector<Vec4>& p = differences_.back();
    std::vector<Vec4> d;
    for (std::size_t i = 0; i + 1 < p.size(); ++i) d.push_back((p[i + 1] - p[i]) / knot_s);
    differences_.push_back(std::move(d));
  }
}

double AnalyticMotion::end_s() const {
  return rest_s_ + knot_s_ * static_cast<double>(differences_[0].size() - kDegree);
}

Vec4 AnalyticMotion::derivative(double time_s, int order) const {
  const double u = (std::clamp(time_s, rest_s_, end_s()) - rest_s_) / knot_s_;
  return de_boor(differences_[static_cast<std::size_t>(order)], kDegree - order, u);
}

Mat3 AnalyticMotion::attitude(double time_s) const {
  const Vec3 z = (derivative(time_s, 2).head<3>() + Vec3(0, 0, kGravity)).normalized();
  const double yaw = derivative(time_s, 0)[3];
  const Vec3 heading(std::cos(yaw), std::sin(yaw), 0);
  const Vec3 y = z.cross(heading).normalized();
  Mat3 R;
  R << y.cross(z), y, z;
  return R;
}

MotionState AnalyticMotion::at(double time_s) const {
  constexpr double kStep = 1e-4;
  MotionState state;
  state.X_OB = {attitude(time_s), derivative(time_s, 0).head<3>()};
  state.v_OB = derivative(time_s, 1).head<3>();
  state.a_OB = derivative(time_s, 2).head<3>();
  state.w_OB_B =
      so3::Log(attitude(time_s - kStep).transpose() * attitude(time_s + kStep)) / (2 * kStep);
  return state;
}

ImuSample AnalyticMotion::imu(Stamp stamp) const {
  const MotionState state = at(to_seconds(stamp));
  return {stamp, state.w_OB_B, state.X_OB.R.transpose() * (state.a_OB + Vec3(0, 0, kGravity))};
}

std::vector<Vec4> loop_points(double length_x_m, double length_y_m, double height_m,
                              double speed_mps, double knot_s, int rounds) {
  std::vector<Vec4> points{Vec4::Zero()};
  const double step = speed_mps * knot_s;
  for (double z = 0; z < height_m; z += 0.5 * step) points.emplace_back(0, 0, z, 0);
  // An ellipse through the origin, its first tangent along x, walked by arc length.
  const double a = 0.5 * length_x_m, b = 0.5 * length_y_m;
  double phase = 0;
  while (phase < 2 * std::numbers::pi * rounds) {
    const double dx = a * std::cos(phase), dy = b * std::sin(phase);
    points.emplace_back(a * std::sin(phase), b * (1 - std::cos(phase)),
                        height_m + 0.3 * std::sin(3 * phase), std::atan2(dy, dx));
    double& yaw = points.back()[3];
    const double before = points[points.size() - 2][3];
    yaw = before + so3::wrap(yaw - before);
    phase += step / std::hypot(dx, dy);
  }
  return points;
}

}  // namespace arex::test
