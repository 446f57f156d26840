#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>

#include "math/types.h"
#include "worlds/occupancy.h"
#include "worlds/world.h"

namespace arex::sim {

/// What a ray meets first.
struct Hit {
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  double distance_m = std::numeric_limits<double>::infinity();
  Vec3 normal_W = Vec3::Zero();    ///< unit, towards the ray's origin
  std::uint32_t triangle = kNone;  ///< index into Mesh::triangles
  std::uint32_t object = kNone;    ///< index into World::objects

  [[nodiscard]] bool valid() const { return triangle != kNone; }
};

/// A ray of a batch. Only the part between the two distances is searched.
struct Ray {
  Vec3f origin_W = Vec3f::Zero();      ///< m
  Vec3f direction_W = Vec3f::UnitX();  ///< unit
  float min_distance_m = 0;
  float max_distance_m = 0;
};

/// What a ray of a batch meets first; the same answer as Hit, in the form the LiDAR needs.
struct RayHit {
  float distance_m = std::numeric_limits<float>::infinity();
  Vec3f normal_W = Vec3f::Zero();  ///< unit, not oriented
  float reflectivity = 0;
  std::uint32_t object = Hit::kNone;

  [[nodiscard]] bool valid() const { return object != Hit::kNone; }
};

/// How far along the ray o + t d a triangle lies that it meets, in lengths of d.
double distance_along(const Vec3& o, const Vec3& d, const std::array<Vec3f, 3>& corners);

/// Ray casts and distances against the triangles of one world. Constant once built: any number of
/// threads may ask.
///
/// Embree answers which triangles a ray meets. That is the same on every host: its robust mode
/// searches every box that the ray may touch, and on which side of an edge the ray passes it
/// decides by products and sums alone. Its distances are not, for they come from reciprocals that
/// differ between CPU vendors: they only bound the search, with a margin, and the first triangle is
/// the one that is nearest by distance_along, of equally near ones the first in the mesh.
class Scene {
 public:
  /// When the tree of the triangles is built, seconds for a large world: before the constructor
  /// returns, or on a thread of its own, where whoever asks first waits for it.
  enum class Build : std::uint8_t { kNow, kBeside };
  explicit Scene(const worlds::World& world, Build build = Build::kNow);
  ~Scene();
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  /// First surface along a unit direction, at most `max_distance_m` away. Both are rounded to
  /// single precision first.
  [[nodiscard]] Hit cast(const Vec3& origin_W, const Vec3& direction_W,
                         double max_distance_m) const;

  /// The same for many rays, in packets of eight consecutive ones: fast where neighbours in the
  /// span are neighbours in space. A ray whose max_distance_m is negative meets nothing.
  void cast(std::span<const Ray> rays, std::span<RayHit> hits) const;

  /// Surfaces that stand in a vehicle's way.
  static constexpr worlds::ClassSet kWithoutLeaves =
      worlds::ClassSet::all().without(worlds::SurfaceClass::kLeaf);
  /// Distance from a point to the nearest triangle of these classes, exact; `max_distance_m` where
  /// none is nearer.
  [[nodiscard]] double distance_to_surface(const Vec3& p_W, double max_distance_m,
                                           worlds::ClassSet classes = kWithoutLeaves) const;

 private:
  struct Embree;
  std::unique_ptr<Embree> embree_;
};

}  // namespace arex::sim
