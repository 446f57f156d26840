#include "mapping/map_files.h"

#include <fstream>
#include <string>
#include <vector>

namespace arex {
namespace {

char to_grey(std::int8_t state) {
  const int grey = state == OccupancyMap2D::kOccupied ? 0
                   : state == OccupancyMap2D::kFree   ? 254
                                                      : 205;
  return static_cast<char>(grey);
}

}  // namespace

bool write_map_2d(const OccupancyMap2D& map, const std::filesystem::path& folder,
                  const std::string& name) {
  std::ofstream pgm(folder / (name + ".pgm"), std::ios::binary);
  pgm << "P5\n" << map.width << ' ' << map.height << "\n255\n";
  std::vector<char> row(static_cast<std::size_t>(map.width));
  for (int y = map.height - 1; y >= 0; --y) {
    for (int x = 0; x < map.width; ++x) row[static_cast<std::size_t>(x)] = to_grey(map.at({x, y}));
    pgm.write(row.data(), map.width);
  }
  pgm.close();
  std::ofstream yaml(folder / (name + ".yaml"));
  yaml.precision(17);
  yaml << "image: " << name << ".pgm\n"
       << "resolution: " << map.resolution << "\n"
       << "origin: [" << map.origin.x() << ", " << map.origin.y() << ", 0]\n"
       << "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";
  yaml.close();
  return pgm.good() && yaml.good();
}

}  // namespace arex
