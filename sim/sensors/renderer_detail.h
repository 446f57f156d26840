#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "worlds/world.h"

namespace arex::sim {

/// What of a world may be drawn with less detail from afar, by triangles of its mesh.
///
/// Of foliage fewer and larger leaves are drawn, of the same area in all: which ones is a random
/// order that stays, so that coming nearer adds leaves and moves none.
/// Source: Cook, Halstead, Planck and Ryu, Stochastic Simplification of Aggregate Detail, 2007.
/// Solids thinner than a part of a pixel, far twigs, are left out.
struct DetailOfMesh {
  static constexpr float kAlways = std::numeric_limits<float>::infinity();
  enum class Part : std::uint8_t { kNone, kFirst, kSecond };

  /// Of a leaf the side of a square of its area, of a solid its width, averaged over the
  /// directions that it may be seen from, m; kAlways: what is drawn as it is from everywhere.
  std::vector<float> width_m;
  std::vector<Part> leaf;  ///< the triangles of leaves, which follow upon each other in pairs

  /// @param winding outward_winding() of the world's mesh
  DetailOfMesh(const worlds::World& world, const std::vector<std::int8_t>& winding);
  /// All is drawn as it is.
  DetailOfMesh() = default;

  [[nodiscard]] bool none() const { return width_m.empty(); }
};

}  // namespace arex::sim
