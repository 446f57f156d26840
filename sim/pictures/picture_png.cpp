#include <png.h>

#include <cstring>
#include <stdexcept>
#include <string>

#include "files/files.h"
#include "pictures/picture.h"

namespace arex::sim {

void save_png(const Picture& picture, const std::filesystem::path& file) {
  png_image image;
  std::memset(&image, 0, sizeof(image));
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(picture.width);
  image.height = static_cast<png_uint_32>(picture.height);
  image.format = PNG_FORMAT_RGB;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::string bytes(size, '\0');
  if (png_image_write_to_memory(&image, bytes.data(), &size, 0, picture.rgb.data(), 0, nullptr) ==
      0) {
    throw std::runtime_error(file.string() + ": " + image.message);
  }
  write_atomically(file, std::string_view(bytes).substr(0, size), false);
}

}  // namespace arex::sim
