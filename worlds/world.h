#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "math/pose.h"
#include "math/types.h"

/// Worlds: a recipe and a seed, or somebody's file, give one labelled triangle mesh, a few
/// collision shapes and the free space. Built once, constant after; Embree, the depth renderer, the
/// physics, the scorer and the exporter all read this one value. Frame W: z up, m.
namespace arex::worlds {

enum class SurfaceClass : std::uint8_t {
  kGround,
  kTrunk,
  kBranch,
  kLeaf,
  kShrub,
  kLog,
  kFloor,
  kRamp,
  kWall,
  kCeiling,
  kPillar,
  kBeam,
  kPipe,
  kCar,
  kKerb,
  kDoor,
};
inline constexpr std::array<std::string_view, 16> kSurfaceClassNames{
    "ground", "trunk",   "branch", "leaf", "shrub", "log", "floor", "ramp",
    "wall",   "ceiling", "pillar", "beam", "pipe",  "car", "kerb",  "door"};
constexpr const auto& enum_names(SurfaceClass) { return kSurfaceClassNames; }

/// One thing of the world: a tree's trunk, one car, the ground. Its id is its index in
/// World::objects.
struct Object {
  SurfaceClass surface_class = SurfaceClass::kGround;
  float reflectivity = 0.3F;  ///< diffuse, at 905 nm, 0..1
  bool felt = false;  ///< the vehicle touches its triangles; otherwise its collision shapes, if any
};

/// A contiguous range of triangles that lie close together: the unit of culling.
struct Chunk {
  std::uint32_t first_triangle = 0;
  std::uint32_t triangle_count = 0;
  Eigen::AlignedBox3f bounds;  ///< in W, m
};

/// Triangles in W, grouped by chunk. Two-sided: winding carries no meaning.
struct Mesh {
  std::vector<Vec3f> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::uint32_t> object_of_triangle;  ///< one per triangle: index into World::objects
  std::vector<Chunk> chunks;                      ///< cover all triangles exactly once, in order
};

/// A convex solid that the vehicle can hit. Sizes as in MuJoCo's half-extent convention:
/// box (hx, hy, hz); capsule and cylinder (radius, half length, unused) along the shape's z.
struct CollisionShape {
  enum class Kind : std::uint8_t { kBox, kCapsule, kCylinder };
  Kind kind = Kind::kBox;
  Pose X_WS;
  Vec3 size = Vec3::Zero();
  std::uint32_t object = 0;
};

/// Terrain on a regular grid, bilinear over triangles split along the (0,0)-(1,1) diagonal as in
/// the mesh. Empty (columns == 0) where the ground is made of shapes (garage).
struct HeightField {
  Vec2 origin = Vec2::Zero();  ///< x, y of sample (0, 0), m
  double spacing_m = 0;
  int columns = 0;              ///< along x
  int rows = 0;                 ///< along y
  std::vector<float> height_m;  ///< columns * rows, row-major: index = row * columns + column

  /// Height of the surface at (x, y), clamped to the border outside.
  [[nodiscard]] double at(double x, double y) const;
};

/// A box in which the vehicle may explore, and score.
struct Bounds {
  Vec3 low = Vec3::Zero();
  Vec3 high = Vec3::Zero();
  [[nodiscard]] bool contains(const Vec3& p) const {
    return (p.array() >= low.array()).all() && (p.array() <= high.array()).all();
  }
};

struct World {
  Mesh mesh;
  std::vector<Object> objects;
  std::vector<CollisionShape> collision_shapes;
  HeightField terrain;
  Bounds bounds;  ///< of the whole world, m
  Pose X_WS;  ///< the start pad S: on the ground, z up, x the vehicle's heading; free around and
              ///< above it

  [[nodiscard]] SurfaceClass class_of_triangle(std::size_t triangle) const {
    return objects[mesh.object_of_triangle[triangle]].surface_class;
  }
};

}  // namespace arex::worlds
