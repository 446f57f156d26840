#include "sensors/renderer_mesh.h"

#include <algorithm>
#include <utility>

#include "sensors/renderer_culling.h"

namespace arex::sim {

DepthChunk::DepthChunk(const worlds::Mesh& mesh, const worlds::Chunk& chunk,
                       const std::vector<std::int8_t>& winding) {
  ClusteredChunk clustered = cluster_chunk(mesh, chunk, winding, kClusterTriangles);
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
                        static_cast<std::uint32_t>(corners.size()), clustered.closed[i]});
    for (const std::uint32_t vertex : corners) {
      x.push_back(mesh.vertices[vertex].x());
      y.push_back(mesh.vertices[vertex].y());
      z.push_back(mesh.vertices[vertex].z());
    }
  }
}

DepthMesh::DepthMesh(const worlds::Mesh& mesh)
    : mesh_(mesh), winding_(outward_winding(mesh)), chunks_(mesh.chunks.size()) {}

const DepthChunk& DepthMesh::chunk(std::size_t i) {
  if (!chunks_[i]) chunks_[i] = std::make_unique<DepthChunk>(mesh_, mesh_.chunks[i], winding_);
  return *chunks_[i];
}

}  // namespace arex::sim
