#include "mapping/cloud_io.h"

#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>

#include <system_error>

namespace arex {

bool write_pcd(const std::filesystem::path& file, std::span<const Vec3f> points) {
  pcl::PointCloud<pcl::PointXYZ> cloud;
  cloud.reserve(points.size());
  for (const Vec3f& p : points) cloud.emplace_back(p.x(), p.y(), p.z());
  cloud.width = static_cast<std::uint32_t>(points.size());
  cloud.height = 1;
  const std::filesystem::path part = file.string() + ".part";
  try {
    if (pcl::io::savePCDFileBinary(part.string(), cloud) != 0) return false;
  } catch (const pcl::IOException&) {  // a missing folder, and an empty cloud
    return false;
  }
  std::error_code error;
  std::filesystem::rename(part, file, error);
  return !error;
}

}  // namespace arex
