#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "math/types.h"

namespace arex {

/// What can happen on a mission, as events.csv names it.
enum class EventKind : std::uint8_t {
  kMissionState,  ///< the mission entered the state named in the detail
  kArmed,
  kDisarmed,
  kTargetSelected,  ///< a new goal or waypoint, detail: x y z in O
  kTargetReached,   ///< detail: x y z in O, distance
  kTargetDropped,   ///< detail: why
  kOdometryStatus,  ///< detail: the new status
  kPlanner,         ///< detail: state or result of the planner
  kStuck,           ///< detail: the typed cause
  kRecovery,        ///< detail: what is tried
  kBattery,         ///< detail: the decision taken
  kSensorFault,     ///< detail: which sensor, and what is wrong with it
  kVehicleFault,    ///< detail: what is wrong with motors, battery or control
  kVibration,       ///< the airframe shakes; detail: RMS and frequency, or "over"
  kCollision,       ///< detail: class and object hit, speed
  kMapFull,         ///< a map has no room left; detail: which, and what is left out
  kOperator,        ///< detail: a command that was taken or refused, or the state of the link
  kFinished,        ///< detail: outcome and reason
};
inline constexpr std::array<std::string_view, 18> kEventKindNames{
    "mission_state",  "armed",           "disarmed",      "target_selected", "target_reached",
    "target_dropped", "odometry_status", "planner",       "stuck",           "recovery",
    "battery",        "sensor_fault",    "vehicle_fault", "vibration",       "collision",
    "map_full",       "operator",        "finished"};

struct Event {
  Stamp stamp = 0;
  EventKind kind = EventKind::kMissionState;
  std::string detail;
};

}  // namespace arex
