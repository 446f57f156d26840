#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "math/types.h"
#include "pictures/picture.h"
#include "worlds/world.h"

namespace arex::sim {

/// One corner of a triangle as the picture's shader reads it.
struct PictureVertex {
  Vec3f p_W;
  Vec3f normal_W;                      ///< unit; its sign carries no meaning
  std::array<std::uint8_t, 4> colour;  ///< linear red, green, blue; the surface's class
};
static_assert(sizeof(PictureVertex) == 28);

/// A colour for every object: by class and reflectivity, with a variation of its own.
std::vector<std::array<std::uint8_t, 4>> object_colours(const worlds::World& world);

/// Three vertices per triangle, in the mesh's order. Normals are averaged where triangles of an
/// object share a vertex without a crease.
std::vector<PictureVertex> picture_vertices(
    const worlds::Mesh& mesh, const std::vector<std::array<std::uint8_t, 4>>& colours);

/// The overlay's tubes and vehicles as triangles.
std::vector<PictureVertex> overlay_vertices(const PictureOverlay& overlay);

}  // namespace arex::sim
