#pragma once

#include <vector>

#include "math/types.h"
#include "report/table.h"

namespace arex::sim {

/// A target that the mission flew to.
struct RunTarget {
  double time_s = 0;  ///< when it was selected
  Vec3 p_O = Vec3::Zero();
  bool reached = false;
};

/// The targets of events.csv, in the order of their selection.
std::vector<RunTarget> run_targets(const Table& events);

}  // namespace arex::sim
