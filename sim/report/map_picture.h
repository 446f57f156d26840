#pragma once

#include <string>

#include "report/run_record.h"

namespace arex::sim {

/// The path over the 2D map as an SVG element with the map inside: needs neither script nor WebGL.
/// Coordinates are those of O in metres with y downward negated. Without a recorded 2D map, the
/// cloud seen from above stands in for it. Empty if nothing was flown.
std::string map_picture_svg(const RunRecord& run);

/// One of several paths over a map.
struct DrawnPath {
  const std::vector<TimedPose>* poses;  ///< X_OB, not empty
  std::string colour;                   ///< as CSS writes it
  std::string title;                    ///< what a pointer on it is told
};

/// Paths through one world. @param backdrop_run its 2D map is drawn, or its cloud if it has none
std::string overlaid_paths_svg(const RunRecord& backdrop_run, const std::vector<DrawnPath>& paths);

}  // namespace arex::sim
