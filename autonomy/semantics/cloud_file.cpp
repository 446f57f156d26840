#include "semantics/cloud_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <string>

#include "clouds/cloud_fields.h"
#include "clouds/pcd_reader.h"
#include "clouds/ply_reader.h"
#include "config/config.h"

namespace arex {

namespace {

constexpr std::size_t kHeaderBytes = 1U << 16;
constexpr double kFar = 1000;    // m, of a cloud whose coordinates need an origin
constexpr double kRaster = 100;  // m, origins are multiples

std::string bytes_of(std::ifstream& in, std::size_t count) {
  std::string bytes(count, '\0');
  in.read(bytes.data(), static_cast<std::streamsize>(count));
  bytes.resize(static_cast<std::size_t>(in.gcount()));
  return bytes;
}

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Multiples of kRaster near the middle of the points, where that is far off.
Vec3 origin_of(const std::vector<Vec3>& points, const std::string& name) {
  Vec3 origin = Vec3::Zero();
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    values.reserve(points.size());
    for (const Vec3& p : points) {
      if (p.allFinite()) values.push_back(p[axis]);
    }
    if (values.size() < kFewestPoints) {
      throw ConfigError(name + ": has " + std::to_string(values.size()) +
                        " points that are numbers, expected at least " +
                        std::to_string(kFewestPoints));
    }
    const double middle = median(values);
    if (std::abs(middle) > kFar) origin[axis] = kRaster * std::round(middle / kRaster);
  }
  return origin;
}

}  // namespace

CloudFile read_cloud_file(const std::filesystem::path& file) {
  const std::string name = file.string();
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) {
    throw ConfigError(name + ": " + (error ? error.message() : "is no file") +
                      ", expected a point cloud (PCD or PLY)");
  }
  std::ifstream in(file, std::ios::binary);
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (!in || error) throw ConfigError(name + ": cannot be read, expected a point cloud");
  std::string bytes = bytes_of(in, kHeaderBytes);
  RawCloud raw;
  // A header that lies is refused before the rest of the file is read.
  const auto rest = [&] {
    bytes +=
        bytes_of(in, static_cast<std::size_t>(size) - std::min<std::size_t>(size, bytes.size()));
    return std::string_view(bytes);
  };
  try {
    if (bytes.starts_with("ply")) {
      const PlyHeader header = parse_ply_header(bytes, size);
      raw = read_ply(header, rest());
    } else if (looks_like_pcd(bytes)) {
      const PcdHeader header = parse_pcd_header(bytes, size);
      raw = read_pcd(header, rest());
    } else {
      throw ConfigError("is neither PCD nor PLY, expected a point cloud");
    }
  } catch (const ConfigError& problem) {
    throw ConfigError(name + ": " + problem.what());
  }
  CloudFile cloud;
  cloud.origin = origin_of(raw.points, name);
  cloud.intensity = std::move(raw.intensity);
  cloud.points.reserve(raw.points.size());
  for (const Vec3& p : raw.points) cloud.points.push_back((p - cloud.origin).cast<float>());
  return cloud;
}

std::string semantic_pcd(const CloudFile& cloud, const SemanticMap& map) {
  const bool wide = !cloud.origin.isZero();
  const bool bright = !cloud.intensity.empty();
  const std::string count = std::to_string(cloud.points.size());
  std::string bytes = "# .PCD v0.7 - Point Cloud Data file format\n# label:";
  for (std::size_t i = 0; i < kSemanticClassNames.size(); ++i) {
    bytes += " " + std::to_string(i) + " " + std::string(kSemanticClassNames[i]);
  }
  const auto columns = [&](const char* xyz, const char* one) {
    return std::string(xyz) + (bright ? std::string(" ") + one : "");
  };
  bytes += "\nVERSION 0.7\nFIELDS " + columns("x y z", "intensity") + " label\nSIZE " +
           columns(wide ? "8 8 8" : "4 4 4", "4") + " 4\nTYPE " + columns("F F F", "F") +
           " U\nCOUNT " + columns("1 1 1", "1") + " 1\nWIDTH " + count +
           "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + count + "\nDATA binary\n";
  bytes.reserve(bytes.size() + cloud.points.size() * (wide ? 32 : 20));
  const auto append = [&](const auto& value) {
    std::array<char, sizeof value> raw{};
    std::memcpy(raw.data(), &value, sizeof value);
    bytes.append(raw.data(), raw.size());
  };
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      if (wide) {
        append(static_cast<double>(cloud.points[i][axis]) + cloud.origin[axis]);
      } else {
        append(cloud.points[i][axis]);
      }
    }
    if (bright) append(cloud.intensity[i]);
    append(static_cast<std::uint32_t>(map.labels[i]));
  }
  return bytes;
}

std::string objects_csv(const SemanticMap& map) {
  std::string csv =
      "class,x_m,y_m,z_m,length_m,width_m,height_m,yaw_rad,base_z_m,canopy_diameter_m,"
      "seen_fraction,confidence\n";
  for (const SemanticObject& object : map.objects) {
    const Vec3 p = object.position + map.origin;
    csv += fmt::format(
        "{},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{:.4f},{:.3f},{:.2f},{:.2f},{:.3f}\n",
        kSemanticClassNames[static_cast<std::size_t>(object.kind)], p.x(), p.y(), p.z(),
        object.size.x(), object.size.y(), object.size.z(), object.yaw_rad,
        object.base_z + map.origin.z(), object.canopy_diameter, object.seen_fraction,
        object.confidence);
  }
  return csv;
}

}  // namespace arex
