#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "semantics/semantic_map.h"

namespace arex {

/// A picture in memory: rows from the top, red, green, blue.
struct RgbImage {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgb;
};

/// The semantic map from above, north (+y) up: the ground by its height, the canopy over it, stems
/// at their size, crowns, the flown path; of a building floors, ramps, walls, pillars, cars, doors.
/// With a key, the number of each class and a bar of a round length.
/// @param path where the vehicle was, in the cloud's frame less the map's origin; may be empty
RgbImage draw_semantic_map(const SemanticMap& map, std::span<const Vec3f> path);

/// The bytes of a PNG file.
std::string png_bytes(const RgbImage& image);

}  // namespace arex
