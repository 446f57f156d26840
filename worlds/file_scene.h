#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "math/pose.h"
#include "math/types.h"

/// What the readers of foreign files hand over: as it stands in the file, nothing checked yet.
namespace arex::worlds {

/// A thing of the file, by which its class is found.
struct FileGroup {
  std::string name;      ///< of the node or model, as the file has it
  std::string material;  ///< may be empty
  std::string shape;  ///< mesh, box, cylinder, sphere, capsule, ellipsoid, plane, heightmap, voxels
  int surface_class = -1;    ///< where the file itself tells (our own PLY); otherwise negative
  double reflectivity = -1;  ///< likewise
};

/// A solid of a Gazebo world. Sizes as CollisionShape's; a sphere's is its radius.
struct FilePrimitive {
  enum class Kind : std::uint8_t { kBox, kCylinder, kSphere, kCapsule };
  Kind kind = Kind::kBox;
  Pose X_FP;  ///< in the file's frame F
  Vec3 size = Vec3::Zero();
  std::uint32_t group = 0;
};

/// Which way is up in a file's frame.
enum class FileUp : std::uint8_t { kUnknown, kX, kY, kZ };

struct FileScene {
  FileUp up = FileUp::kUnknown;
  double unit_m = 1;  ///< of the file; already applied
  std::vector<FileGroup> groups;
  std::vector<Vec3> vertices;  ///< m
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::uint32_t> group_of_triangle;
  std::vector<FilePrimitive> primitives;

  std::vector<Vec3> points;  ///< of a cloud, m

  double voxel_m = 0;  ///< side of an octree's cells
  /// Occupied cells of an octree: first cell along x, y, z and the side, in cells.
  std::vector<std::array<std::int32_t, 4>> voxels;

  std::vector<std::string> notes;  ///< what is missing or was left out

  [[nodiscard]] std::string pack() const;
  /// @throws ConfigError if the bytes are not what pack() makes
  static FileScene unpack(std::string_view bytes);
};

}  // namespace arex::worlds
