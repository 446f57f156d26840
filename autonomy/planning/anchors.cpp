#include "planning/anchors.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace arex {
namespace {

constexpr double kSurfaceStep = 0.25;  ///< cells; resolution of p on the line
constexpr double kOpposed = -0.5;      ///< cosine below which two directions oppose each other
constexpr double kSame = 0.98;         ///< cosine above which they are the same
constexpr double kReach = 0.6;         ///< knot spans between a control point and its collision
constexpr double kSamplesPerCell = 2.0;

std::vector<Vec3> find_detour(const GridView& grid, const Vec3& from, const Vec3& to,
                              const SearchConfig& config, GridAstar& astar, AnchorReport& report) {
  const Eigen::Vector3i a = grid.cell_of(from), b = grid.cell_of(to);
  for (const int height : {config.level_height_cells, config.detour_margin_cells}) {
    AstarResult result = astar.search(
        grid, a, b,
        {config.detour_max_expansions, config.detour_margin_cells, height, false, true});
    ++report.searches;
    report.expansions += result.expansions;
    if (result.status == AstarStatus::kFound) return std::move(result.path);
  }
  return {};
}

/// Where the path crosses the plane through c normal to n, nearest to c; without a crossing the
/// path's nearest vertex.
Vec3 cut_path(std::span<const Vec3> path, const Vec3& c, const Vec3& n) {
  Vec3 best = path.front();
  double best_distance = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const double a = (path[i] - c).dot(n), b = (path[i + 1] - c).dot(n);
    if ((a > 0) == (b > 0)) continue;
    const Vec3 cut = path[i] + (path[i + 1] - path[i]) * (a / (a - b));
    if ((cut - c).squaredNorm() < best_distance) {
      best_distance = (cut - c).squaredNorm();
      best = cut;
    }
  }
  if (std::isfinite(best_distance)) return best;
  for (const Vec3& vertex : path) {
    if ((vertex - c).squaredNorm() < best_distance) {
      best_distance = (vertex - c).squaredNorm();
      best = vertex;
    }
  }
  return best;
}

/// Direction away from the blocked cells around c.
Vec3 away_from_obstacles(const GridView& grid, const Vec3& c) {
  constexpr int kRadius = 2;
  const Eigen::Vector3i cell = grid.cell_of(c);
  Vec3 sum = Vec3::Zero();
  for (int dz = -kRadius; dz <= kRadius; ++dz) {
    for (int dx = -kRadius; dx <= kRadius; ++dx) {
      for (int dy = -kRadius; dy <= kRadius; ++dy) {
        const Vec3 centre = grid.centre_of(cell + Eigen::Vector3i(dx, dy, dz));
        if (!is_blocked(grid, centre)) continue;
        const Vec3 away = c - centre;
        sum += away / std::max(away.squaredNorm(), 1e-6);
      }
    }
  }
  return sum;
}

/// The pair for curve point c, not yet shifted to its control point.
Anchor make_anchor(const GridView& grid, std::span<const Vec3> path, const Vec3& c,
                   const Vec3& tangent) {
  const Vec3 cut = cut_path(path, c, tangent);
  const double length = (cut - c).norm();
  const double step = kSurfaceStep * grid.resolution_m;
  if (length > step) {
    const Vec3 v = (cut - c) / length;
    Vec3 p = cut;
    bool met = false;
    for (double s = length; s > 0 && !met; s -= step) {
      met = is_blocked(grid, c + s * v);
      if (!met) p = c + s * v;
    }
    if (met) return {p, v};
  }
  // The curve only grazes the obstacle here: its surface is at c.
  Vec3 v = away_from_obstacles(grid, c);
  v -= v.dot(tangent) * tangent;
  if (v.norm() < 1e-6) v = cut - c;
  if (v.norm() < 1e-6) v = tangent.unitOrthogonal();
  return {c, v.normalized()};
}

void insert(std::vector<Anchor>& list, const Anchor& added, AnchorReport& report) {
  const auto contradicts = [&](const Anchor& old) {
    return old.v.dot(added.v) < kOpposed && (added.p - old.p).dot(old.v) <= 0;
  };
  const auto before = list.size();
  std::erase_if(list, contradicts);
  report.dropped += static_cast<int>(before - list.size());
  for (Anchor& old : list) {
    if (old.v.dot(added.v) < kSame) continue;
    if ((added.p - old.p).dot(added.v) > 0) old = added;  // the same face, further out
    return;
  }
  list.push_back(added);
}

/// Times within the stretch at which the curve is inside a blocked cell; its middle if none.
std::vector<double> blocked_times(const GridView& grid, const UniformBspline& spline,
                                  const TimeInterval& stretch) {
  const double length =
      spline.speed_bound(
          std::min(spline.spans() - 1, static_cast<int>(stretch.begin_s / spline.knot_span_s()))) *
      (stretch.end_s - stretch.begin_s);
  const int n = std::max(8, static_cast<int>(kSamplesPerCell * length / grid.resolution_m));
  std::vector<double> times;
  for (int i = 0; i <= n; ++i) {
    const double t = stretch.begin_s + (stretch.end_s - stretch.begin_s) * i / n;
    if (is_blocked(grid, spline.position(t))) times.push_back(t);
  }
  if (times.empty()) times.push_back(0.5 * (stretch.begin_s + stretch.end_s));
  return times;
}

}  // namespace

bool add_anchors(const GridView& grid, const UniformBspline& spline,
                 std::span<const TimeInterval> collisions, const SearchConfig& config,
                 GridAstar& astar, Anchors& anchors, AnchorReport& report) {
  const auto& q = spline.control_points();
  const double dt = spline.knot_span_s();
  const std::size_t first = 3, last = q.size() - 4;  // the free control points
  for (const TimeInterval& stretch : collisions) {
    const std::vector<Vec3> path =
        find_detour(grid, spline.position(stretch.begin_s), spline.position(stretch.end_s), config,
                    astar, report);
    if (path.empty()) return false;
    const std::vector<double> times = blocked_times(grid, spline, stretch);

    const auto attach = [&](std::size_t j, double t) {
      const Vec3 c = spline.position(t);
      const Vec3 velocity = spline.velocity(t);
      if (velocity.norm() < 1e-6) return;
      const Anchor anchor = make_anchor(grid, path, c, velocity.normalized());
      insert(anchors[j], {anchor.p + (q[j] - c), anchor.v}, report);
    };
    bool any = false;
    for (std::size_t j = first; j <= last; ++j) {
      const double knot = (static_cast<double>(j) - 1.0) * dt;  // where Q_j weighs most
      const auto nearest = std::min_element(times.begin(), times.end(), [&](double a, double b) {
        return std::abs(a - knot) < std::abs(b - knot);
      });
      if (std::abs(*nearest - knot) > kReach * dt) continue;
      attach(j, *nearest);
      any = true;
    }
    if (!any) {  // only the fixed ends weigh here: bend with their free neighbour
      const double middle = times[times.size() / 2];
      attach(middle < 0.5 * spline.duration_s() ? first : last, middle);
    }
  }
  return true;
}

}  // namespace arex
