#include "mapping/map_files.h"

#include <sstream>
#include <string>

#include "files/files.h"

namespace arex {
namespace {

char to_grey(std::int8_t state) {
  const int grey = state == OccupancyMap2D::kOccupied ? 0
                   : state == OccupancyMap2D::kFree   ? 254
                                                      : 205;
  return static_cast<char>(grey);
}

}  // namespace

void write_map_2d(const OccupancyMap2D& map, const std::filesystem::path& folder,
                  const std::string& name) {
  std::string pgm =
      "P5\n" + std::to_string(map.width) + " " + std::to_string(map.height) + "\n255\n";
  for (int y = map.height - 1; y >= 0; --y) {
    for (int x = 0; x < map.width; ++x) pgm += to_grey(map.at({x, y}));
  }
  write_atomically(folder / (name + ".pgm"), pgm);
  std::ostringstream yaml;
  yaml.precision(17);
  yaml << "image: " << name << ".pgm\n"
       << "resolution: " << map.resolution << "\n"
       << "origin: [" << map.origin.x() << ", " << map.origin.y() << ", 0]\n"
       << "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";
  write_atomically(folder / (name + ".yaml"), yaml.str());
}

}  // namespace arex
