#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "mapping/grid_view.h"

/// Where to go when a place is not free.
namespace arex {

/// The free point nearest to a blocked `goal` that lies on the way from `from` or, if the way is
/// blocked throughout, nearest to the goal at all; no further than `max_shift_m` from the goal.
[[nodiscard]] std::optional<Vec3> nearest_free_goal(const GridView& grid, const Vec3& from,
                                                    const Vec3& goal, double max_shift_m);

/// Distance from p to the nearest occupied (not inflated) cell's box, capped at `max_m`; m.
[[nodiscard]] double clearance(const GridView& grid, const Vec3& p, double max_m);

/// A way out of the inflation: with the inflation shrunk to the vehicle's true radius, the path
/// from `start` to the nearest free cell that costs least when each cell costs the inverse of its
/// clearance, so that it climbs the gradient of clearance. Where the start is closer to an obstacle
/// than the true radius, no cell on the way may be closer than the start. Polyline from `start` to
/// a free cell's centre; empty if there is none within `max_distance_m`.
[[nodiscard]] std::vector<Vec3> escape_path(const GridView& grid, const Vec3& start,
                                            double vehicle_radius_m, double max_distance_m);

/// The grid as a vehicle that is inside the inflation sees it: points seen since it planned, or one
/// cell of noise, have grown over it, and it flies on from there. Within `reach_m` of it (a cube)
/// the inflation is shrunk to the clearance that the vehicle has, less `yield_m` for the way that a
/// moving vehicle cannot help going on, and never to less than the true radius or, where it is
/// nearer to an obstacle already, than it has.
class ShrunkInflation {
 public:
  /// A copy of the grid; valid until the next call.
  [[nodiscard]] GridView around(const GridView& grid, const Vec3& p, double reach_m,
                                double vehicle_radius_m, double yield_m);

 private:
  std::vector<std::uint8_t> cells_;
};

}  // namespace arex
