#include "sensors/fault.h"

#include <algorithm>
#include <utility>

namespace arex::sim {
namespace {

using enum FaultKind;

// Any message can fail to come, come late, or say nothing new.
constexpr std::array kOfAnySensor{kSilent, kStuck, kDelayed, kNoisy, kDropping};

}  // namespace

FaultyPart faulty_part(std::string_view device) {
  using enum FaultyPart;
  static constexpr std::array<std::pair<std::string_view, FaultyPart>, 11> kParts{
      {{"lidar", kLidar},
       {"depth", kDepth},
       {"infrared", kInfrared},
       {"imu", kBoard},
       {"magnetometer", kBoard},
       {"barometer", kBoard},
       {"power", kBoard},
       {"mocap", kBoard},
       {"motor", kMotor},
       {"esc", kEsc},
       {"battery", kBattery}}};
  const auto* const part = std::find_if(kParts.begin(), kParts.end(),
                                        [&](const auto& entry) { return entry.first == device; });
  return part == kParts.end() ? kFurther : part->second;
}

bool is_possible(FaultyPart part, FaultKind kind) {
  const bool of_any =
      std::find(kOfAnySensor.begin(), kOfAnySensor.end(), kind) != kOfAnySensor.end();
  const bool of_lidar = kind == kFalseReturns || kind == kJumping;
  switch (part) {
    case FaultyPart::kLidar:
      return of_any || of_lidar;
    case FaultyPart::kDepth:
    case FaultyPart::kInfrared:
      return of_any || kind == kBlinded;
    case FaultyPart::kFurther:
      return of_any || of_lidar || kind == kBlinded;
    case FaultyPart::kBoard:
      return of_any;
    case FaultyPart::kEsc:
      return kind == kStop;
    case FaultyPart::kMotor:
    case FaultyPart::kBattery:
      return kind == kWeak;
  }
  return false;
}

std::string possible_kinds(FaultyPart part) {
  std::string text;
  for (std::size_t i = 0; i < kFaultKindNames.size(); ++i) {
    if (!is_possible(part, static_cast<FaultKind>(i))) continue;
    text += (text.empty() ? "" : ", ") + std::string(kFaultKindNames[i]);
  }
  return text;
}

}  // namespace arex::sim
