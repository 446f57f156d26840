#pragma once

#include <cstdint>
#include <span>

#include "worlds/world.h"

namespace arex::worlds {

/// Collects primitives, each with the object it belongs to, and turns them into a World.
///
/// Lengths in m, poses X_WP of the primitive's frame P in W. Faces are two-sided. The result is a
/// pure function of the calls and their order.
class MeshBuilder {
 public:
  /// Triangles of a chunk have their centroids in one square column of this side.
  static constexpr double kChunkSide = 6.0;
  /// A fuller column is split at the median of its longest side until it is below this.
  static constexpr std::uint32_t kMaxChunkTriangles = 4000;

  /// Registers a thing of the world; returns its id. @pre reflectivity in [0, 1].
  /// @param felt the vehicle touches its triangles
  std::uint32_t add_object(SurfaceClass surface_class, double reflectivity, bool felt = false);

  // Surfaces: seen by the sensors; felt only where their object is.

  void add_triangle(std::uint32_t object, const Vec3& a, const Vec3& b, const Vec3& c);
  /// Corners in order around the quad.
  void add_quad(std::uint32_t object, const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);
  void add_box(std::uint32_t object, const Pose& X_WP, const Vec3& half_extent);
  /// A closed tube through `points` (at least two, no two successive ones equal) with a radius at
  /// each; a zero radius makes a tip. Sections are regular polygons inscribed in their circle, in
  /// the plane that halves the bend, carried along without twist.
  void add_tube(std::uint32_t object, std::span<const Vec3> points, std::span<const double> radii,
                int sides);
  /// Centred in P, axis z, closed.
  void add_cylinder(std::uint32_t object, const Pose& X_WP, double radius, double half_length,
                    int sides);
  /// A cylinder with a radius of its own at each end (z = -half_length, z = +half_length).
  void add_cone(std::uint32_t object, const Pose& X_WP, double radius_low, double radius_high,
                double half_length, int sides);
  /// In the plane z = 0 of P.
  void add_disc(std::uint32_t object, const Pose& X_WP, double radius, int sides);
  /// A convex outline in P's xy plane (in order around it), from z = low to z = high, closed.
  void add_prism(std::uint32_t object, const Pose& X_WP, std::span<const Vec2> outline, double low,
                 double high);
  /// Many triangles at once. @pre their corners are indices into `vertices`.
  void add_mesh(std::span<const Vec3> vertices,
                std::span<const std::array<std::uint32_t, 3>> triangles,
                std::span<const std::uint32_t> object_of_triangle);
  /// The surface of `terrain`, which also becomes World::terrain.
  void add_height_field(std::uint32_t object, HeightField terrain);

  // Solids: felt, not seen. Sizes as CollisionShape's.

  void add_collision_box(std::uint32_t object, const Pose& X_WS, const Vec3& half_extent);
  void add_collision_cylinder(std::uint32_t object, const Pose& X_WS, double radius,
                              double half_length);
  /// A capsule whose axis runs from `a` to `b`; its caps reach `radius` beyond them.
  void add_collision_capsule(std::uint32_t object, const Vec3& a, const Vec3& b, double radius);

  // Both.

  void add_solid_box(std::uint32_t object, const Pose& X_WP, const Vec3& half_extent);
  void add_solid_cylinder(std::uint32_t object, const Pose& X_WP, double radius, double half_length,
                          int sides);

  /// The bounding box of everything drawn so far.
  [[nodiscard]] Bounds bounds() const;

  /// Sorts the triangles into chunks (leaves in chunks of their own, so that they can be culled
  /// nearer) and hands everything over. World::bounds is that of the mesh; X_WS is left to the
  /// recipe. The builder is empty afterwards.
  [[nodiscard]] World finish();

 private:
  std::uint32_t add_vertex(const Vec3& p);
  void add_face(std::uint32_t object, std::uint32_t a, std::uint32_t b, std::uint32_t c);

  World world_;  ///< under construction; the mesh has no chunks yet
};

/// The pose of a frame at the middle of a and b with z along b - a; x and y are any normals.
[[nodiscard]] Pose pose_along(const Vec3& a, const Vec3& b);

/// A fingerprint of everything in the world, bit by bit (FNV-1a over 64-bit words).
[[nodiscard]] std::uint64_t world_hash(const World& world);

}  // namespace arex::worlds
