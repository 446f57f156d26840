#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "worlds/world.h"

namespace arex::sim {

/// A few dozen triangles that lie close together, with corners of their own.
struct Cluster {
  worlds::Chunk part;  ///< its triangles, counted within the chunk
  std::uint32_t first_corner = 0, corner_count = 0;
  bool closed = false;  ///< part of a solid: its far side is never seen
};

/// One chunk of the world's mesh in clusters, corners split by coordinate.
struct DepthChunk {
  static constexpr std::uint32_t kClusterTriangles = 64;
  static constexpr std::size_t kMostCorners = 3 * kClusterTriangles;  ///< of a cluster

  std::vector<Cluster> clusters;
  std::vector<float> x, y, z;                          ///< corners in W, m
  std::vector<std::array<std::uint8_t, 3>> triangles;  ///< corners, counted within the cluster
  std::vector<std::uint32_t> source;                   ///< of each triangle: its index in the mesh

  /// @param winding that of the mesh
  DepthChunk(const worlds::Mesh& mesh, const worlds::Chunk& chunk,
             const std::vector<std::int8_t>& winding);
};

/// The world's mesh, of which a chunk is prepared when a view first touches it: far from where the
/// camera ever gets nothing is.
class DepthMesh {
 public:
  /// The mesh must outlive this.
  explicit DepthMesh(const worlds::Mesh& mesh);

  [[nodiscard]] const std::vector<worlds::Chunk>& bounds() const { return mesh_.chunks; }
  const DepthChunk& chunk(std::size_t i);

 private:
  const worlds::Mesh& mesh_;
  std::vector<std::int8_t> winding_;
  std::vector<std::unique_ptr<DepthChunk>> chunks_;
};

}  // namespace arex::sim
