#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "sensors/renderer_culling.h"
#include "sensors/renderer_detail.h"
#include "worlds/world.h"

namespace arex::sim {

/// A few dozen triangles that lie close together, with corners of their own.
struct Cluster {
  worlds::Chunk part;  ///< its triangles, counted within the chunk
  std::uint32_t first_corner = 0, corner_count = 0;
  ClusterKind kind = ClusterKind::kOpen;
  float width_m = DetailOfMesh::kAlways;  ///< of its widest piece
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
             const std::vector<std::int8_t>& winding, const DetailOfMesh& detail);
};

/// The world's mesh, of which a chunk is prepared when a view first touches it: far from where the
/// camera ever gets nothing is.
class DepthMesh {
 public:
  /// The world must outlive this. @param with_detail whether its clusters know their widths
  DepthMesh(const worlds::World& world, bool with_detail);

  [[nodiscard]] const std::vector<worlds::Chunk>& bounds() const { return mesh_.chunks; }
  const DepthChunk& chunk(std::size_t i);
  /// How far corners of chunk i's leaves lie from the middles of their leaves at most, m; 0 without
  /// detail.
  [[nodiscard]] float leaf_reach_m(std::size_t i) const {
    return reach_m_.empty() ? 0 : reach_m_[i];
  }

 private:
  const worlds::Mesh& mesh_;
  std::vector<std::int8_t> winding_;
  DetailOfMesh detail_;
  std::vector<float> reach_m_;  ///< of each chunk
  std::vector<std::unique_ptr<DepthChunk>> chunks_;
};

}  // namespace arex::sim
