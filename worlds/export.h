#pragma once

#include <array>
#include <filesystem>
#include <string_view>

#include "worlds/occupancy.h"

namespace arex::worlds {

struct ExportConfig {
  double resolution_m = 0.1;
  double band_low_m = 0.0;
  double band_high_m = 2.0;

  void fields(auto& f) {
    f("resolution_m", resolution_m, "cell of the ground-truth maps (paper: 0.1 m)");
    f("band_low_m", band_low_m,
      "lowest height in the 2D map above the terrain (paper: 0-2 m); "
      "above the start where the ground is made of shapes");
    f("band_high_m", band_high_m, "greatest height in the 2D map");
    f.check(resolution_m >= 0.02 && resolution_m <= 1, "0.02 <= resolution_m <= 1");
    f.check(band_low_m < band_high_m, "band_low_m < band_high_m");
  }
};

/// What export_world() writes; terrain.hf only if the world has a height field.
inline constexpr std::array<std::string_view, 6> kExportedFiles{
    "mesh.ply", "world.xml", "terrain.hf", "map.bt", "map2d.pgm", "map2d.yaml"};

/// Writes all of the below into a directory, which is created; those of an older world go.
/// @throws DiskError naming the file that cannot be written; so do the others.
void export_world(const World& world, const ExportConfig& config,
                  const std::filesystem::path& directory);

/// Binary little-endian PLY. Per face: class (uchar, names in the header's comments), object
/// (uint), reflectivity (float).
void write_ply(const World& world, const std::filesystem::path& file);

/// The static world for MuJoCo: collision shapes as geoms of the world body, the terrain as a
/// height field in terrain.hf beside the file.
void write_mjcf(const World& world, const std::filesystem::path& file);

/// OctoMap's binary tree: occupied where a surface passes, free in the reachable space, unknown
/// elsewhere (inside solids, below the ground). Written directly, pruned, in one pass; the format
/// is that of octomap::OcTree::writeBinary 1.9.
/// @pre the grid's origin is a multiple of its resolution (make_grid's is).
void write_octomap(const OccupancyGrid& occupancy, const FreeSpace& free,
                   const std::filesystem::path& file);

/// map_server's pair of map2d.pgm and map2d.yaml in `directory`. A column is occupied if a surface
/// other than ground, floor, ramp and ceiling passes through the band, free if otherwise reachable
/// there.
void write_map2d(const World& world, const ExportConfig& config, const FreeSpace& free,
                 const std::filesystem::path& directory);

}  // namespace arex::worlds
