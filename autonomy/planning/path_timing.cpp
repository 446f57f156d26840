#include "planning/path_timing.h"

#include <algorithm>
#include <cmath>

namespace arex {
namespace {

constexpr double kStation = 0.02;        ///< m between stations of the speed profile
constexpr int kCurvatureReach = 3;       ///< stations to each side that a curvature is taken over
constexpr double kBrakingShare = 0.85;   ///< of the acceleration limit that the plan brakes with
constexpr double kCurvatureShare = 0.9;  ///< of it that curves are taken with
constexpr double kSubstep = 0.0125;      ///< s, of the forward simulation
constexpr double kCreep_mps = 0.02;      ///< lowest speed before the end
constexpr double kArrived = 5e-4;        ///< m before the end at which the motion is over
constexpr double kLeastShare = 0.2;  ///< of the acceleration limit left along the path in curves
constexpr double kMaxDuration_s = 120.0;  ///< a budget, not a limit of flight
constexpr int kBlend = 8;                 ///< control points over which the start's offset fades

/// A path at equal arc-length stations.
struct Stations {
  std::vector<Vec3> points;
  std::vector<double> curvature;
  double step = kStation;

  [[nodiscard]] double length() const { return step * static_cast<double>(points.size() - 1); }
  [[nodiscard]] Vec3 position(double s) const {
    const double x = std::clamp(s / step, 0.0, static_cast<double>(points.size() - 1));
    const auto i = std::min(static_cast<std::size_t>(x), points.size() - 2);
    const double u = x - static_cast<double>(i);
    return (1 - u) * points[i] + u * points[i + 1];
  }
  [[nodiscard]] std::size_t index(double s) const {
    return std::min(static_cast<std::size_t>(std::max(0.0, s / step)), points.size() - 1);
  }
};

Stations make_stations(std::span<const Vec3> path) {
  Stations stations;
  stations.points = resample(path, kStation);
  const auto n = static_cast<int>(stations.points.size());
  if (n > 1) stations.step = (stations.points[1] - stations.points[0]).norm();
  stations.curvature.assign(stations.points.size(), 0.0);
  for (int i = 1; i + 1 < n; ++i) {
    const int reach = std::min({kCurvatureReach, i, n - 1 - i});
    const auto at = [&](int k) { return stations.points[static_cast<std::size_t>(k)]; };
    const double baseline = reach * stations.step;
    stations.curvature[static_cast<std::size_t>(i)] =
        (at(i + reach) - 2 * at(i) + at(i - reach)).norm() / (baseline * baseline);
  }
  return stations;
}

/// The speed that curvature, caps and the need to brake allow at each station.
std::vector<double> allowed_speed(const Stations& path, const MotionLimits& limits,
                                  const SpeedCap& speed_cap) {
  const std::size_t n = path.points.size();
  std::vector<double> v(n, limits.max_speed_mps);
  for (std::size_t i = 0; i < n; ++i) {
    const double turning = kCurvatureShare * limits.max_acceleration_mps2;
    v[i] = std::min(v[i], std::sqrt(turning / std::max(path.curvature[i], 1e-6)));
    if (speed_cap)
      v[i] = std::min(v[i], std::max(0.0, speed_cap(static_cast<double>(i) * path.step)));
  }
  v[n - 1] = 0;
  const double braking = kBrakingShare * limits.max_acceleration_mps2;
  for (std::size_t i = n - 1; i-- > 0;) {
    const double turning = v[i + 1] * v[i + 1] * path.curvature[i + 1];
    const double along = std::sqrt(std::max(0.0, braking * braking - turning * turning));
    v[i] = std::min(v[i], std::sqrt(v[i + 1] * v[i + 1] + 2 * along * path.step));
  }
  return v;
}

/// The speed allowed at an arc length; between stations v^2 is linear, as under constant braking.
double allowed_at(const Stations& path, const std::vector<double>& allowed, double s) {
  const double x = std::clamp(s / path.step, 0.0, static_cast<double>(allowed.size() - 1));
  const auto i = std::min(static_cast<std::size_t>(x), allowed.size() - 2);
  const double u = x - static_cast<double>(i);
  return std::sqrt((1 - u) * allowed[i] * allowed[i] + u * allowed[i + 1] * allowed[i + 1]);
}

/// Arc lengths of the motion, one per knot span from t = 0: a simulation whose acceleration steers
/// the speed to what is allowed a moment ahead. That moment is the time which the jerk limit takes
/// to build up full acceleration, so braking is begun in time and no limit is overshot.
std::vector<double> simulate(const Stations& path, const std::vector<double>& allowed,
                             const MotionLimits& limits, double start_speed,
                             double start_acceleration, double knot_span_s) {
  const int substeps = std::max(1, static_cast<int>(std::ceil(knot_span_s / kSubstep)));
  const double h = knot_span_s / substeps, length = path.length();
  const double full = limits.max_acceleration_mps2;
  const double ahead = std::max(full / limits.max_jerk_mps3, 2 * h);
  const double jerk_step = limits.max_jerk_mps3 * h;
  double s = 0, v = start_speed, a = start_acceleration;
  std::vector<double> knots{0.0};
  const auto max_knots = static_cast<std::size_t>(kMaxDuration_s / knot_span_s);
  while (length - s > kArrived && knots.size() < max_knots) {
    for (int k = 0; k < substeps; ++k) {
      double wanted = full;
      for (const double moment : {0.25 * ahead, 0.5 * ahead, ahead}) {
        const double target = std::max(kCreep_mps, allowed_at(path, allowed, s + v * moment));
        wanted = std::min(wanted, (target - v) / moment);
      }
      const double turning = v * v * path.curvature[path.index(s)];
      const double along =
          std::max(kLeastShare * full, std::sqrt(std::max(0.0, full * full - turning * turning)));
      wanted = std::clamp(std::clamp(wanted, -along, along), a - jerk_step, a + jerk_step);
      const double v_next = std::max(0.0, v + wanted * h);
      s += 0.5 * (v + v_next) * h;
      a = wanted;
      v = v_next;
    }
    knots.push_back(std::min(s, length));
  }
  return knots;
}

}  // namespace

std::vector<Vec3> resample(std::span<const Vec3> polyline, double spacing_m) {
  double length = 0;
  for (std::size_t i = 0; i + 1 < polyline.size(); ++i) {
    length += (polyline[i + 1] - polyline[i]).norm();
  }
  if (length <= 0) return {polyline.front()};
  const int pieces = std::max(1, static_cast<int>(std::ceil(length / spacing_m)));
  const double step = length / pieces;
  std::vector<Vec3> points{polyline.front()};
  points.reserve(static_cast<std::size_t>(pieces) + 1);
  double walked = 0;
  for (std::size_t i = 0; i + 1 < polyline.size(); ++i) {
    const double piece = (polyline[i + 1] - polyline[i]).norm();
    while (static_cast<int>(points.size()) < pieces &&
           step * static_cast<double>(points.size()) <= walked + piece) {
      const double u = (step * static_cast<double>(points.size()) - walked) / piece;
      points.push_back(polyline[i] + u * (polyline[i + 1] - polyline[i]));
    }
    walked += piece;
  }
  while (static_cast<int>(points.size()) < pieces) points.push_back(polyline.back());
  points.push_back(polyline.back());
  return points;
}

std::vector<Vec3> sample_path(const UniformBspline& spline, double spacing_m, double from_s) {
  const double dt = spline.knot_span_s();
  std::vector<Vec3> points{spline.position(from_s)};
  double t = std::max(0.0, from_s);
  for (int span = std::min(static_cast<int>(t / dt), spline.spans() - 1); span < spline.spans();
       ++span) {
    const double begin = t, end = (span + 1) * dt;
    const int pieces = std::max(
        1, static_cast<int>(std::ceil(spline.speed_bound(span) * (end - begin) / spacing_m)));
    for (int k = 1; k <= pieces; ++k) {
      points.push_back(spline.position(begin + (end - begin) * k / pieces));
    }
    t = end;
  }
  return points;
}

std::vector<Vec3> round_corners(std::span<const Vec3> polyline, double spacing_m) {
  std::vector<Vec3> q = resample(polyline, spacing_m);
  q.insert(q.begin(), 2, q.front());
  q.insert(q.end(), 2, q.back());
  return sample_path(UniformBspline(std::move(q), 1.0), kStation);
}

UniformBspline time_path(std::span<const Vec3> path, const MotionState& start,
                         const MotionLimits& limits, double knot_span_s,
                         const SpeedCap& speed_cap) {
  const auto head = UniformBspline::boundary(start, knot_span_s);
  std::vector<Vec3> q(head.begin(), head.end());
  const Stations stations = make_stations(path);
  const Vec3& goal = path.back();
  if (stations.points.size() > 2) {
    const double speed = start.v.norm();
    const Vec3 along = speed > 1e-6 ? Vec3(start.v / speed)
                                    : Vec3((stations.points[1] - stations.points[0]).normalized());
    const std::vector<double> knots = simulate(stations, allowed_speed(stations, limits, speed_cap),
                                               limits, speed, start.a.dot(along), knot_span_s);
    // The start's control points lie a dt^2 / 6 beside the motion; let that offset fade.
    const Vec3 offset = -start.a * (knot_span_s * knot_span_s / 6.0);
    for (std::size_t k = 2; k < knots.size(); ++k) {
      const double fade =
          k - 1 < kBlend ? 0.5 + 0.5 * std::cos(M_PI * static_cast<double>(k - 1) / kBlend) : 0.0;
      q.push_back(stations.position(knots[k]) + fade * offset);
    }
  }
  q.insert(q.end(), 3, goal);
  while (q.size() < 7) q.push_back(goal);
  return {std::move(q), knot_span_s};
}

}  // namespace arex
