#pragma once

#include <optional>
#include <vector>

#include "mapping/grid_view.h"
#include "planning/uniform_bspline.h"

/// Collision of curves with the grid, without gaps between samples: a piece of the curve is free
/// when the box around it (its chord, widened by the sagitta that its acceleration allows) touches
/// only free cells; otherwise it is halved, down to kGrazeLength: a piece that short and still
/// undecided is blocked, unless it lies at one of the curve's ends (and they are free). Cells
/// outside the grid count as blocked: nothing is planned where nothing can be seen.
namespace arex {

inline constexpr double kGrazeLength_m = 1e-4;  ///< pieces shorter than this are not halved again

/// A stretch of a spline that touches blocked cells; both ends are free points of the curve unless
/// they are the curve's own ends.
struct TimeInterval {
  double begin_s = 0;
  double end_s = 0;
};

/// True when the cell of p is inflated, occupied or outside the grid.
[[nodiscard]] bool is_blocked(const GridView& grid, const Vec3& p);

/// True when any cell that the axis-aligned box touches is blocked.
[[nodiscard]] bool is_box_blocked(const GridView& grid, const Vec3& low, const Vec3& high);

/// True when the straight piece from a to b, widened by `margin_m` on each axis, touches no blocked
/// cell.
[[nodiscard]] bool is_segment_free(const GridView& grid, const Vec3& a, const Vec3& b,
                                   double margin_m = 0.0);

/// All stretches of the spline after `from_s` that touch blocked cells, in order.
[[nodiscard]] std::vector<TimeInterval> find_collisions(const GridView& grid,
                                                        const UniformBspline& spline,
                                                        double from_s = 0.0);

/// Start of the first such stretch, or nothing.
[[nodiscard]] std::optional<double> first_collision(const GridView& grid,
                                                    const UniformBspline& spline,
                                                    double from_s = 0.0);

}  // namespace arex
