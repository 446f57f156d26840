#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace arex {

/// A picture in memory: rows from the top, red, green, blue.
struct RgbImage {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgb;
};

/// The bytes of a PNG file. @throws std::runtime_error with libpng's reason
std::string png_bytes(const RgbImage& image);

}  // namespace arex
