#pragma once

#include <vector>

#include "semantics/raster.h"
#include "semantics/working_cloud.h"

namespace arex {

/// The height of open ground under a cloud: the smooth surface that the lowest points lie on.
///
/// A plane through the lowest points, then corrections on ever finer grids (8 m down to the given
/// cell): each cell gives the height of its lowest points that have others beside them (a lone
/// echo from below the ground has not), and the correction minimises
///
///     sum_cells w (r - c)^2 + lambda sum_neighbours (c - c')^2
///
/// where w falls to zero for a cell that lies more than the slope allows above the surface: what
/// stands there hides the ground. Cells without points follow from their neighbours.
/// Source of the idea: Kraus and Pfeifer, Determination of terrain models in wooded areas with
/// airborne laser scanner data, ISPRS J. 53, 1998 (skew weights around a surface between ground and
/// vegetation), coarse to fine.
Raster fit_ground(const WorkingCloud& cloud, double cell_m);

/// Height of each point above the surface, m.
std::vector<float> heights_above(const std::vector<Vec3f>& points, const Raster& ground);

}  // namespace arex
