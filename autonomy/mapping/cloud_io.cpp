#include "mapping/cloud_io.h"

#include <cstring>
#include <string>

#include "files/files.h"

namespace arex {

// Source of the format: pointclouds.org, "The PCD file format", version 0.7.
void write_pcd(const std::filesystem::path& file, std::span<const Vec3f> points) {
  const std::string count = std::to_string(points.size());
  std::string bytes =
      "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\n"
      "TYPE F F F\nCOUNT 1 1 1\nWIDTH " +
      count + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + count + "\nDATA binary\n";
  const std::size_t header = bytes.size();
  static_assert(sizeof(Vec3f) == 3 * sizeof(float));
  bytes.resize(header + points.size_bytes());
  if (!points.empty()) {
    std::memcpy(bytes.data() + header, points.front().data(), points.size_bytes());
  }
  write_atomically(file, bytes, false);
}

}  // namespace arex
