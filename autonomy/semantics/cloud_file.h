#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "math/types.h"
#include "semantics/semantic_map.h"

namespace arex {

/// A cloud from a file. Coordinates that are too large for single precision (a map projection's)
/// are kept as an origin in double precision and points relative to it.
struct CloudFile {
  Vec3 origin = Vec3::Zero();    ///< m; zero unless the cloud lies more than a kilometre away
  std::vector<Vec3f> points;     ///< less `origin`, m; may hold values that are no numbers
  std::vector<float> intensity;  ///< one per point, or empty: the file has none
};

/// Reads a PCD (0.7 and older; ascii, binary, binary_compressed) or a PLY (ascii, binary of either
/// byte order): any number types, other fields and elements are skipped. Which of the two it is,
/// its first bytes say. Memory is bounded by the file's size, whatever its header claims.
/// @throws ConfigError, one line, for what is no such file, has no x, y, z, is cut short or holds
/// fewer than kFewestPoints numbers.
CloudFile read_cloud_file(const std::filesystem::path& file);

inline constexpr std::size_t kFewestPoints = 100;

/// The bytes of the labelled cloud as a binary PCD: x, y, z (float; double if the origin is not
/// zero), intensity (float, if there is any), label (uint32, the value of SemanticClass; the
/// header's comments name them). Points keep their order.
std::string semantic_pcd(const CloudFile& cloud, const SemanticMap& map);

/// The text of objects.csv: class,x_m,y_m,z_m,length_m,width_m,height_m,yaw_rad,base_z_m,
/// canopy_diameter_m,seen_fraction,confidence; coordinates as in the cloud's file. Of a trunk,
/// length and width are the diameter at breast height.
std::string objects_csv(const SemanticMap& map);

}  // namespace arex
