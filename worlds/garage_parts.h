#pragma once

#include "worlds/garage.h"
#include "worlds/garage_plan.h"
#include "worlds/mesh_builder.h"

/// The parts of a garage, each drawn and made solid from one plan. Private to build_garage.
namespace arex::worlds::garage {

/// What every part is built from, and into.
struct Site {
  const GarageRecipe& recipe;
  const GaragePlan& plan;
  MeshBuilder& mesh;

  std::uint32_t add(SurfaceClass surface_class, double reflectivity) const {
    return mesh.add_object(surface_class, reflectivity);
  }
};

/// An axis-aligned box by two corners.
struct Box {
  Vec3 low, high;
  [[nodiscard]] Pose pose() const { return {Mat3::Identity(), 0.5 * (low + high)}; }
  [[nodiscard]] Vec3 half() const { return 0.5 * (high - low); }
};

/// Large faces are cut into tiles of at most this side, so that chunks stay local.
inline constexpr double kTile = 3.0;    // m
inline constexpr double kSlab = 0.3;    // thickness of floors, ramp and roof, m
inline constexpr double kMark = 0.003;  // thickness of a painted line, m

/// A parallelogram from `corner` along `u` and `v`, in tiles.
void add_tiled_face(MeshBuilder& mesh, std::uint32_t object, const Vec3& corner, const Vec3& u,
                    const Vec3& v);
/// A solid box with faces in tiles.
void add_tiled_box(MeshBuilder& mesh, std::uint32_t object, const Pose& X_WP, const Vec3& half);
void add_tiled_box(MeshBuilder& mesh, std::uint32_t object, const Box& box);
/// A solid box, each face one quad.
void add_small_box(MeshBuilder& mesh, std::uint32_t object, const Box& box);

void add_hall(const Site& site);      ///< floor, ceiling, outer walls, pillars, beams
void add_entrance(const Site& site);  ///< forecourt and ramp
void add_rooms(const Site& site);
void add_bays(const Site& site);      ///< markings, wheel stops, kerbs, cars
void add_services(const Site& site);  ///< pipes, ducts, trays, sprinklers, lamps, signs

}  // namespace arex::worlds::garage
