#pragma once

#include <array>
#include <cstdint>
#include <span>
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

/// The same of a picture of few colours.
/// @param indices into the palette, rows from the top
/// @param palette red, green, blue, opacity; at most 256
std::string png_bytes(int width, int height, std::span<const std::uint8_t> indices,
                      std::span<const std::array<std::uint8_t, 4>> palette);

}  // namespace arex
