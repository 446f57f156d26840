#pragma once

#include "worlds/file_scene.h"

namespace arex::worlds {

/// Turns the occupied cells of an octree, or the cells that a cloud's points lie in, into the
/// rectangles between occupied and empty cells: as few as a greedy merge finds, and watertight.
/// They replace `voxels` and `points` of the scene and belong to its first group.
/// @param voxel_m cells of a cloud; an octree brings its own
/// @param least_points cells of a cloud with fewer points are noise
/// @throws ConfigError where the cells of the box around them are too many
void mesh_voxels(FileScene& scene, double voxel_m, int least_points);

}  // namespace arex::worlds
