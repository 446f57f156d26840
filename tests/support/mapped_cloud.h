#pragma once

#include <cstdint>
#include <vector>

#include "math/pose.h"
#include "worlds/world.h"

namespace arex::support {

struct MappedCloudOptions {
  double spacing_m = 1.6;           ///< between the places that it is scanned from
  double height_m = 1.5;            ///< of those places above what they stand over
  double range_m = 20.0;            ///< of the points that are kept
  double voxel_m = 0.08;            ///< one mean per cell
  double position_sigma_m = 0.005;  ///< of the pose that a scan is placed by: slow drift
  double yaw_sigma_rad = 0.001;     ///< likewise
  Vec2 low_m{-12, -10};             ///< where the vehicle goes, x and y in W
  Vec2 high_m{12, 10};
};

struct MappedCloud {
  std::vector<Vec3f> points_O;  ///< the global cloud of a mission, in O
  std::vector<Vec3> path_O;     ///< where the LiDAR was
  Pose X_WO;                    ///< O in W
};

/// The cloud that a mission would leave of a world, without flying it: the LiDAR model with its
/// noise fires one frame from each place of a lattice that the vehicle can reach, each frame is
/// placed by a pose with the odometry's errors, and the points go through the global cloud's
/// voxels. A few seconds; a pure function of world, options and seed.
MappedCloud map_world(const worlds::World& world, const MappedCloudOptions& options,
                      std::uint64_t seed);

}  // namespace arex::support
