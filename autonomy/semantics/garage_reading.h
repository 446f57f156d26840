#pragma once

#include <span>

#include "semantics/forest_reading.h"

namespace arex {

/// A building with storeys: floors and ramps, ceilings, walls, pillars, parked cars, doors.
/// See level_surfaces.h, upright_structure.h, parked_cars.h and doors.h for how.
SceneReading read_garage(const WorkingCloud& cloud, std::span<const Vec3f> path,
                         const SemanticConfig& config);

}  // namespace arex
