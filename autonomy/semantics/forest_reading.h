#pragma once

#include <vector>

#include "semantics/semantic_map.h"
#include "semantics/working_cloud.h"

namespace arex {

/// What a detector makes of a thinned cloud.
struct SceneReading {
  std::vector<SemanticClass> labels;  ///< one per point of the thinned cloud
  std::vector<SemanticObject> objects;
  Raster ground;
  std::vector<float> heights;  ///< of the points above ground or floor, m
};

/// Forest, pine stand or orchard: ground, stems with the trees around them, undergrowth.
///
/// A stem found at breast height is followed up and down by circles of a radius that tapers, as
/// long as there are points on them. What is no ground and no stem belongs to the nearest stem's
/// tree: its height is that of its fifth highest point, its canopy the area of its points above
/// 1.5 m seen from above. Walls of what stands among the trees are neither.
/// @param on_wall of the points, as points_on_walls; empty: there are no walls
SceneReading read_forest(const WorkingCloud& cloud, const std::vector<bool>& on_wall,
                         const SemanticConfig& config);

}  // namespace arex
