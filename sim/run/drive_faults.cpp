#include "run/drive_faults.h"

#include <algorithm>

namespace arex::sim {
namespace {

bool concerns_drive(const FaultConfig& fault) {
  const FaultyPart part = faulty_part(fault.device);
  return part == FaultyPart::kMotor || part == FaultyPart::kEsc || part == FaultyPart::kBattery;
}

}  // namespace

bool concern_drive(const std::vector<FaultConfig>& faults) {
  return std::any_of(faults.begin(), faults.end(), concerns_drive);
}

DriveFaults drive_faults_at(const std::vector<FaultConfig>& faults, Stamp now) {
  DriveFaults drive;
  for (const FaultConfig& fault : faults) {
    if (!fault.holds(now)) continue;
    const auto motor = static_cast<std::size_t>(fault.number - 1);
    switch (faulty_part(fault.device)) {
      case FaultyPart::kMotor:
        drive.thrust_share[motor] *= 1 - fault.loss_fraction;
        break;
      case FaultyPart::kEsc:
        drive.stopped[motor] = true;
        break;
      case FaultyPart::kBattery:
        drive.added_resistance_ohm += fault.added_resistance_ohm;
        drive.lost_voltage_v += fault.lost_voltage_v;
        break;
      default:
        break;
    }
  }
  return drive;
}

}  // namespace arex::sim
