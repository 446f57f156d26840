#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "files/png.h"
#include "semantics/semantic_map.h"

namespace arex {

/// The semantic map from above, north (+y) up: the ground by its height, the canopy over it, stems
/// at their size, crowns, the flown path; of a building floors, ramps, walls, pillars, cars, doors.
/// With a key, the number of each class and a bar of a round length.
/// @param path where the vehicle was, in the cloud's frame less the map's origin; may be empty
RgbImage draw_semantic_map(const SemanticMap& map, std::span<const Vec3f> path);

}  // namespace arex
