#pragma once

#include <vector>

#include "physics/powertrain.h"
#include "sensors/fault.h"

namespace arex::sim {

/// Whether any of the faults is the drive's: of motors, speed controllers or battery.
[[nodiscard]] bool concern_drive(const std::vector<FaultConfig>& faults);

/// What is broken of the drive at `now`. Faults of one motor multiply, those of the battery add up.
[[nodiscard]] DriveFaults drive_faults_at(const std::vector<FaultConfig>& faults, Stamp now);

}  // namespace arex::sim
