#pragma once

#include <filesystem>
#include <string>

#include "mapping/occupancy_map_2d.h"

namespace arex {

/// Writes NAME.pgm and NAME.yaml in map_server's trinary format: occupied 0, free 254, unknown 205;
/// the picture's top row is the map's last. @throws DiskError.
void write_map_2d(const OccupancyMap2D& map, const std::filesystem::path& folder,
                  const std::string& name);

}  // namespace arex
