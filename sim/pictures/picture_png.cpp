#include <stdexcept>
#include <string>

#include "files/files.h"
#include "pictures/picture.h"

namespace arex::sim {

void save_png(const Picture& picture, const std::filesystem::path& file) {
  std::string bytes;
  try {
    bytes = png_bytes(picture);
  } catch (const std::runtime_error& problem) {
    throw std::runtime_error(file.string() + ": " + problem.what());
  }
  write_atomically(file, bytes, false);
}

}  // namespace arex::sim
