#pragma once

#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include "worlds/world.h"

namespace arex::sim {

/// Triangles that hang together by shared vertices, each such surface named by one of its vertices.
class MeshSurfaces {
 public:
  /// The mesh must outlive this.
  explicit MeshSurfaces(const worlds::Mesh& mesh) : mesh_(mesh), parent_(mesh.vertices.size()) {
    std::iota(parent_.begin(), parent_.end(), 0U);
    for (const auto& [a, b, c] : mesh.triangles) {
      parent_[find(b)] = find(a);
      parent_[find(c)] = find(a);
    }
    for (std::uint32_t vertex = 0; vertex < parent_.size(); ++vertex)
      parent_[vertex] = find(vertex);
  }

  /// Hands over each surface's triangles, ascending, and its name.
  template <class Visit>
  void each(const Visit& visit) const {
    std::vector<std::uint32_t> end(parent_.size() + 1, 0);
    for (const auto& triangle : mesh_.triangles) ++end[parent_[triangle[0]] + 1];
    for (std::size_t vertex = 0; vertex < parent_.size(); ++vertex) end[vertex + 1] += end[vertex];
    std::vector<std::uint32_t> grouped(mesh_.triangles.size());
    for (std::uint32_t t = 0; t < grouped.size(); ++t) {
      grouped[end[parent_[mesh_.triangles[t][0]]]++] = t;
    }
    // What began where the one before ended now ends there itself.
    for (std::uint32_t vertex = 0, first = 0; vertex < parent_.size(); ++vertex) {
      const std::uint32_t last = end[vertex];
      if (last > first) visit(std::span(grouped).subspan(first, last - first), vertex);
      first = last;
    }
  }

 private:
  std::uint32_t find(std::uint32_t vertex) {
    while (parent_[vertex] != vertex) vertex = parent_[vertex] = parent_[parent_[vertex]];
    return vertex;
  }
  const worlds::Mesh& mesh_;
  std::vector<std::uint32_t> parent_;
};

}  // namespace arex::sim
