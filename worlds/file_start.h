#pragma once

#include "worlds/file_world.h"
#include "worlds/occupancy.h"

namespace arex::worlds {

/// Where a vehicle can stand and what it can reach from there.
struct FoundStart {
  Pose X_WS;
  double room_m = 0;
  FreeSpace free;  ///< flooded from above the start
};

/// The given start, checked, or one that is found: level ground with room around and above it,
/// nearest to the file's origin or else to its middle.
/// @throws ConfigError that says what is wrong with the given one, or that there is none
FoundStart find_start(const World& world, const FileStart& start, double vehicle_radius_m);

}  // namespace arex::worlds
