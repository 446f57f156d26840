#include "files/png.h"

#include <png.h>

#include <cstring>
#include <stdexcept>

namespace arex {
namespace {

/// @param palette empty: the pixels are their own colours
std::string encode(int width, int height, png_uint_32 format, const std::uint8_t* pixels,
                   std::span<const std::array<std::uint8_t, 4>> palette) {
  png_image png;
  std::memset(&png, 0, sizeof(png));
  png.version = PNG_IMAGE_VERSION;
  png.width = static_cast<png_uint_32>(width);
  png.height = static_cast<png_uint_32>(height);
  png.format = format;
  png.colormap_entries = static_cast<png_uint_32>(palette.size());
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(png);
  std::string bytes(size, '\0');
  const int written =
      png_image_write_to_memory(&png, bytes.data(), &size, 0, pixels, 0, palette.data());
  if (written == 0) throw std::runtime_error(png.message);
  bytes.resize(size);
  return bytes;
}

}  // namespace

std::string png_bytes(const RgbImage& image) {
  return encode(image.width, image.height, PNG_FORMAT_RGB, image.rgb.data(), {});
}

std::string png_bytes(int width, int height, std::span<const std::uint8_t> indices,
                      std::span<const std::array<std::uint8_t, 4>> palette) {
  return encode(width, height, PNG_FORMAT_RGBA_COLORMAP, indices.data(), palette);
}

}  // namespace arex
