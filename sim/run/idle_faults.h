#pragma once

#include <string>
#include <vector>

#include "run/scenario.h"

namespace arex::sim {

/// Why a scenario's faults can have no effect, a line of words for each that cannot: it befalls a
/// device that this run lacks or nobody reads, or comes when the mission is over. They are no
/// error: a sweep varies faults and devices, and a blame takes devices away.
[[nodiscard]] std::vector<std::string> idle_faults(const ScenarioConfig& config);

}  // namespace arex::sim
