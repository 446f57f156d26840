#pragma once

#include <optional>

#include "mapping/grid_view.h"
#include "planning/path_timing.h"
#include "planning/uniform_bspline.h"

/// Stopping, and how fast one may fly and still be able to stop.
namespace arex {

/// Distance (m) to rest from a speed: the reaction time at that speed, then constant braking.
[[nodiscard]] double stopping_distance(double speed_mps, double braking_mps2, double reaction_s);

/// The inverse: the highest speed (m/s) from which `distance_m` suffices to stop.
[[nodiscard]] double stoppable_speed(double distance_m, double braking_mps2, double reaction_s);

/// The longest prefix of a spline, from `from_s` on, that lies in known cells without obstacles;
/// whether it is also outside the inflation is first_collision's question. What lies within
/// `own_radius_m` of where it begins is the vehicle's own place and counts as known.
struct KnownPrefix {
  double end_s = 0;     ///< time on the spline
  double length_m = 0;  ///< arc length from from_s
  bool whole = false;   ///< nothing unknown up to the end
};
[[nodiscard]] KnownPrefix known_prefix(const GridView& grid, const UniformBspline& spline,
                                       double from_s, double own_radius_m);

/// The shortest motion to rest straight on, at the acceleration limit.
[[nodiscard]] UniformBspline brake(const MotionState& state, const MotionLimits& limits,
                                   double knot_span_s);

/// A motion to rest that touches nothing: straight on if that is free, else swerving while braking;
/// among the free ones that which ends nearest to `towards`. Nothing if none is free.
[[nodiscard]] std::optional<UniformBspline> find_stop(const GridView& grid,
                                                      const MotionState& state,
                                                      const MotionLimits& limits,
                                                      double knot_span_s, const Vec3& towards);

/// For when nothing is free: the stop, straight or swerving, that lacks least clearance from
/// occupied cells, squared and summed over its time and the hover at its end.
[[nodiscard]] UniformBspline widest_stop(const GridView& grid, const MotionState& state,
                                         const MotionLimits& limits, double knot_span_s);

}  // namespace arex
