#pragma once

#include <string>

#include "report/run_record.h"

namespace arex::sim {

/// The path over the 2D map as an SVG element with the map inside: needs neither script nor WebGL.
/// Coordinates are those of O in metres with y downward negated. Without a recorded 2D map, the
/// cloud seen from above stands in for it. Empty if nothing was flown.
std::string map_picture_svg(const RunRecord& run);

}  // namespace arex::sim
