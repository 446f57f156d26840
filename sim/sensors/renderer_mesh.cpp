#include "sensors/renderer_mesh.h"

#include <algorithm>
#include <utility>

#include "sensors/renderer_culling.h"

namespace arex::sim {

DepthChunk::DepthChunk(const worlds::Mesh& mesh, const worlds::Chunk& chunk,
                       const std::vector<std::int8_t>& winding, const DetailOfMesh& detail) {
  ClusteredChunk clustered = cluster_chunk(mesh, chunk, winding, kClusterTriangles, detail);
  source = std::move(clustered.source);
  triangles.reserve(source.size());
  std::vector<std::uint32_t> corners;  // of one cluster, in the order of their first use
  for (std::size_t i = 0; i < clustered.clusters.size(); ++i) {
    const worlds::Chunk& part = clustered.clusters[i];
    corners.clear();
    const auto corner_of = [&](std::uint32_t vertex) {
      const auto found = std::find(corners.begin(), corners.end(), vertex);
      const auto corner = static_cast<std::uint8_t>(found - corners.begin());
      if (found == corners.end()) corners.push_back(vertex);
      return corner;
    };
    for (std::uint32_t t = part.first_triangle; t < part.first_triangle + part.triangle_count;
         ++t) {
      const auto& [a, b, c] = clustered.triangles[t];
      const std::uint8_t first = corner_of(a), second = corner_of(b);
      triangles.push_back({first, second, corner_of(c)});
    }
    clusters.push_back({part, static_cast<std::uint32_t>(x.size()),
                        static_cast<std::uint32_t>(corners.size()), clustered.kind[i],
                        clustered.width_m[i]});
    for (const std::uint32_t vertex : corners) {
      x.push_back(mesh.vertices[vertex].x());
      y.push_back(mesh.vertices[vertex].y());
      z.push_back(mesh.vertices[vertex].z());
    }
  }
}

DepthMesh::DepthMesh(const worlds::World& world, bool with_detail)
    : mesh_(world.mesh), winding_(outward_winding(mesh_)), chunks_(mesh_.chunks.size()) {
  if (!with_detail) return;
  detail_ = DetailOfMesh(world, winding_);
  reach_m_.resize(mesh_.chunks.size(), 0);
  for (std::size_t i = 0; i < mesh_.chunks.size(); ++i) {
    const worlds::Chunk& chunk = mesh_.chunks[i];
    for (std::uint32_t k = 0; k + 1 < chunk.triangle_count; ++k) {
      const std::uint32_t t = chunk.first_triangle + k;
      if (detail_.leaf[t] != DetailOfMesh::Part::kFirst) continue;
      Eigen::AlignedBox3f leaf;
      for (const std::uint32_t vertex : mesh_.triangles[t]) leaf.extend(mesh_.vertices[vertex]);
      for (const std::uint32_t vertex : mesh_.triangles[t + 1]) leaf.extend(mesh_.vertices[vertex]);
      reach_m_[i] = std::max(reach_m_[i], leaf.diagonal().norm());
    }
  }
}

const DepthChunk& DepthMesh::chunk(std::size_t i) {
  if (!chunks_[i]) {
    chunks_[i] = std::make_unique<DepthChunk>(mesh_, mesh_.chunks[i], winding_, detail_);
  }
  return *chunks_[i];
}

}  // namespace arex::sim
