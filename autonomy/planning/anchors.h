#pragma once

#include <span>

#include "mapping/grid_view.h"
#include "planning/curve_check.h"
#include "planning/grid_astar.h"
#include "planning/spline_cost.h"
#include "planning/uniform_bspline.h"

namespace arex {

/// Budgets of A* searches. The first stays near the level of start and goal: obstacles that are
/// taller than the grid would else be flooded through all its layers.
struct SearchConfig {
  int level_height_cells = 1;
  int level_max_expansions = 60'000;
  int detour_margin_cells = 20;
  int detour_max_expansions = 4000;
  int max_expansions = 60'000;

  void fields(auto& f) {
    f("level_height_cells", level_height_cells, "cells above and below that are searched first");
    f("level_max_expansions", level_max_expansions, "expansions of that search, start to goal");
    f("detour_margin_cells", detour_margin_cells, "cells around a collision searched for a detour");
    f("detour_max_expansions", detour_max_expansions, "expansions of each detour search");
    f("max_expansions", max_expansions, "expansions in the whole grid, start to goal");
    f.check(level_height_cells >= 0 && level_height_cells <= 2000,
            "0 <= level_height_cells <= 2000");
    f.check(level_max_expansions >= 1, "level_max_expansions >= 1");
    f.check(detour_max_expansions >= 1, "detour_max_expansions >= 1");
    f.check(max_expansions >= 1, "max_expansions >= 1");
    f.check(detour_margin_cells >= 1 && detour_margin_cells <= 2000,
            "1 <= detour_margin_cells <= 2000");
  }
};

struct AnchorReport {
  int searches = 0;
  int expansions = 0;
  int dropped = 0;  ///< older pairs that contradicted a new one
};

/// Gives the control points that shape each colliding stretch their {p, v} pairs: an A* detour
/// around the stretch is cut with the plane through the curve point C of the control point, normal
/// to the curve (at a knot: parallel to Q_{j+1} - Q_{j-1}); v points from C to the cut, p is the
/// obstacle's surface on that line. As C moves with its control point, p is stored shifted by
/// Q_j - C, so that (Q_j - p) . v is the distance of the curve itself: corners that a spline cuts
/// between two free control points are pushed away too.
/// Of two pairs whose half-spaces have no point in common the older is dropped.
/// @return false if some stretch has no detour.
[[nodiscard]] bool add_anchors(const GridView& grid, const UniformBspline& spline,
                               std::span<const TimeInterval> collisions, const SearchConfig& config,
                               GridAstar& astar, Anchors& anchors, AnchorReport& report);

}  // namespace arex
