#include "planning/curve_check.h"

#include <algorithm>
#include <cmath>

namespace arex {
namespace {

constexpr double kPiecesPerCell = 2.0;  ///< first pieces are half a cell long

/// The curve begins and ends at rest in places that somebody else chose, and round numbers lie on
/// faces of cells: a free place is not left out because its neighbour is blocked.
bool is_at_end(const UniformBspline& spline, const Vec3& p) {
  const double near = 2 * kGrazeLength_m;
  return (p - spline.position(0)).norm() <= near ||
         (p - spline.position(spline.duration_s())).norm() <= near;
}

/// One piece of a spline: chord and the most it can bulge.
bool is_piece_blocked(const GridView& grid, const UniformBspline& spline, double t0, double t1,
                      const Vec3& p0, const Vec3& p1, double acceleration_bound) {
  const double dt = t1 - t0;
  const double sagitta = acceleration_bound * dt * dt / 8.0;
  const Vec3 widen = Vec3::Constant(sagitta);
  if (!is_box_blocked(grid, p0.cwiseMin(p1) - widen, p0.cwiseMax(p1) + widen)) return false;
  if (is_blocked(grid, p0) || is_blocked(grid, p1)) return true;
  // A standing end has dt > 0 without length: the sagitta decides there too.
  if ((p1 - p0).norm() + sagitta < kGrazeLength_m) return !is_at_end(spline, p0);
  const double middle = 0.5 * (t0 + t1);
  const Vec3 p_middle = spline.position(middle);
  return is_piece_blocked(grid, spline, t0, middle, p0, p_middle, acceleration_bound) ||
         is_piece_blocked(grid, spline, middle, t1, p_middle, p1, acceleration_bound);
}

/// Calls visit(t0, t1, blocked) for consecutive pieces until it returns false.
template <class Visit>
void walk(const GridView& grid, const UniformBspline& spline, double from_s, Visit visit) {
  const double dt = spline.knot_span_s();
  const int first = std::clamp(static_cast<int>(from_s / dt), 0, spline.spans() - 1);
  double t0 = std::clamp(from_s, 0.0, spline.duration_s());
  Vec3 p0 = spline.position(t0);
  for (int span = first; span < spline.spans(); ++span) {
    const double end = (span + 1) * dt;
    const double acceleration = spline.acceleration_bound(span);
    const double length = spline.speed_bound(span) * (end - t0);
    const int pieces =
        std::max(1, static_cast<int>(std::ceil(length * kPiecesPerCell / grid.resolution_m)));
    const double step = (end - t0) / pieces, begin = t0;
    for (int k = 1; k <= pieces; ++k) {
      const double t1 = k == pieces ? end : begin + k * step;
      const Vec3 p1 = spline.position(t1);
      const bool blocked = is_piece_blocked(grid, spline, t0, t1, p0, p1, acceleration);
      if (!visit(t0, t1, blocked)) return;
      t0 = t1;
      p0 = p1;
    }
  }
}

}  // namespace

bool is_blocked(const GridView& grid, const Vec3& p) {
  const Eigen::Vector3i cell = grid.cell_of(p);
  return !grid.contains(cell) || (grid.cells[grid.index(cell)] & GridView::kBlocked) != 0;
}

bool is_box_blocked(const GridView& grid, const Vec3& low, const Vec3& high) {
  const Eigen::Vector3i a = grid.cell_of(low), b = grid.cell_of(high);
  if (!grid.contains(a) || !grid.contains(b)) return true;
  for (int z = a.z(); z <= b.z(); ++z) {
    for (int x = a.x(); x <= b.x(); ++x) {
      for (int y = a.y(); y <= b.y(); ++y) {
        if ((grid.cells[grid.index({x, y, z})] & GridView::kBlocked) != 0) return true;
      }
    }
  }
  return false;
}

bool is_segment_free(const GridView& grid, const Vec3& a, const Vec3& b, double margin_m) {
  // Boxes around short pieces of the chord would be conservative near faces: halve those.
  const auto free = [&](const auto& self, const Vec3& p, const Vec3& q) -> bool {
    const Vec3 widen = Vec3::Constant(margin_m);
    if (!is_box_blocked(grid, p.cwiseMin(q) - widen, p.cwiseMax(q) + widen)) return true;
    if ((q - p).norm() < kGrazeLength_m || is_blocked(grid, p) || is_blocked(grid, q)) return false;
    const Vec3 middle = 0.5 * (p + q);
    return self(self, p, middle) && self(self, middle, q);
  };
  return free(free, a, b);
}

std::vector<TimeInterval> find_collisions(const GridView& grid, const UniformBspline& spline,
                                          double from_s) {
  std::vector<TimeInterval> found;
  bool inside = false;
  walk(grid, spline, from_s, [&](double t0, double t1, bool blocked) {
    if (blocked && !inside) found.push_back({t0, t1});
    if (blocked) found.back().end_s = t1;
    inside = blocked;
    return true;
  });
  return found;
}

std::optional<double> first_collision(const GridView& grid, const UniformBspline& spline,
                                      double from_s) {
  std::optional<double> found;
  walk(grid, spline, from_s, [&](double t0, double, bool blocked) {
    if (blocked) found = t0;
    return !blocked;
  });
  return found;
}

}  // namespace arex
