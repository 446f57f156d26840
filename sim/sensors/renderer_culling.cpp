#include "sensors/renderer_culling.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace arex::sim {
namespace {

/// Largest value of normal . p over the box.
double support(const Vec3& normal, const Eigen::AlignedBox3f& box) {
  double sum = 0;
  for (Eigen::Index i = 0; i < 3; ++i) {
    sum += normal[i] * static_cast<double>(normal[i] > 0 ? box.max()[i] : box.min()[i]);
  }
  return sum;
}

// What chunks are grown by, so that rounding in single precision never drops a visible one, m.
constexpr double kMargin = 1e-3;

/// Spreads the low 10 bits of n to every third bit.
std::uint32_t spread(std::uint32_t n) {
  n = (n | (n << 16U)) & 0x030000FFU;
  n = (n | (n << 8U)) & 0x0300F00FU;
  n = (n | (n << 4U)) & 0x030C30C3U;
  return (n | (n << 2U)) & 0x09249249U;
}

std::uint32_t morton_code(const Vec3f& p, const Eigen::AlignedBox3f& bounds) {
  constexpr float kCells = 1023.0F;
  const float side = std::max(bounds.sizes().maxCoeff(), 1e-6F);
  const Vec3f cell = ((p - bounds.min()) * (kCells / side)).cwiseMax(0.0F).cwiseMin(kCells);
  return spread(static_cast<std::uint32_t>(cell.x())) |
         spread(static_cast<std::uint32_t>(cell.y())) << 1U |
         spread(static_cast<std::uint32_t>(cell.z())) << 2U;
}

}  // namespace

ViewVolume::ViewVolume(const PinholeCamera& camera, const Pose& X_WC, double far_m) {
  const double left = (-0.5 - camera.cx) / camera.fx;
  const double right = (camera.width - 0.5 - camera.cx) / camera.fx;
  const double top = (-0.5 - camera.cy) / camera.fy;
  const double bottom = (camera.height - 0.5 - camera.cy) / camera.fy;
  const auto add = [&](const Vec3& normal_C, double offset) {
    const Vec3 normal = X_WC.R * normal_C.normalized();
    planes_.push_back({normal, offset - normal.dot(X_WC.p) + kMargin});
  };
  add({1, 0, -left}, 0);
  add({-1, 0, right}, 0);
  add({0, 1, -top}, 0);
  add({0, -1, bottom}, 0);
  add({0, 0, 1}, 0);
  add({0, 0, -1}, far_m);
}

bool ViewVolume::touches(const Eigen::AlignedBox3f& box) const {
  return std::all_of(planes_.begin(), planes_.end(), [&box](const Plane& plane) {
    return support(plane.normal, box) + plane.offset >= 0;
  });
}

double ViewVolume::nearest_depth(const Eigen::AlignedBox3f& box) const {
  const Plane& back = planes_[4];
  return back.offset - kMargin - support(-back.normal, box);
}

std::vector<std::int8_t> outward_winding(const worlds::Mesh& mesh) {
  // Surfaces: vertices joined by triangles, each named by one of its vertices.
  std::vector<std::uint32_t> parent(mesh.vertices.size());
  std::iota(parent.begin(), parent.end(), 0U);
  const auto surface_of = [&parent](std::uint32_t vertex) {
    while (parent[vertex] != vertex) vertex = parent[vertex] = parent[parent[vertex]];
    return vertex;
  };
  for (const auto& [a, b, c] : mesh.triangles) {
    parent[surface_of(b)] = surface_of(a);
    parent[surface_of(c)] = surface_of(a);
  }
  std::vector<std::uint32_t> triangle_count(mesh.vertices.size(), 0);
  for (const auto& triangle : mesh.triangles) ++triangle_count[surface_of(triangle[0])];

  // Six times the volume of each surface, and its edges with the direction in the lowest bit.
  std::vector<double> volume(mesh.vertices.size(), 0);
  std::vector<std::uint64_t> edges;
  constexpr std::uint32_t kFewestOfASolid = 4;
  for (const auto& triangle : mesh.triangles) {
    const std::uint32_t surface = surface_of(triangle[0]);
    if (triangle_count[surface] < kFewestOfASolid) continue;
    const Vec3f& origin = mesh.vertices[surface];
    const Vec3 a = (mesh.vertices[triangle[0]] - origin).cast<double>();
    const Vec3 b = (mesh.vertices[triangle[1]] - origin).cast<double>();
    const Vec3 c = (mesh.vertices[triangle[2]] - origin).cast<double>();
    volume[surface] += a.dot(b.cross(c));
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint64_t from = triangle[k], to = triangle[(k + 1) % 3];
      edges.push_back(std::min(from, to) << 33U | std::max(from, to) << 1U | (from < to ? 1U : 0U));
    }
  }
  std::sort(edges.begin(), edges.end());
  std::vector<bool> open(mesh.vertices.size(), false);
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t end = i + 1;
    while (end < edges.size() && edges[end] >> 1U == edges[i] >> 1U) ++end;
    const bool matched = end - i == 2 && edges[i] != edges[i + 1];
    if (!matched) open[surface_of(static_cast<std::uint32_t>(edges[i] >> 33U))] = true;
    i = end;
  }
  std::vector<std::int8_t> winding(mesh.triangles.size(), 0);
  for (std::size_t t = 0; t < winding.size(); ++t) {
    const std::uint32_t surface = surface_of(mesh.triangles[t][0]);
    if (open[surface] || volume[surface] == 0) continue;
    winding[t] = volume[surface] > 0 ? 1 : -1;
  }
  return winding;
}

ClusteredMesh cluster_mesh(const worlds::Mesh& mesh, std::uint32_t max_triangles) {
  ClusteredMesh out;
  out.triangles.reserve(mesh.triangles.size());
  out.source.reserve(mesh.triangles.size());
  out.vertices.reserve(mesh.vertices.size());
  constexpr std::uint32_t kUnused = 0xFFFFFFFFU;
  std::vector<std::uint32_t> new_index(mesh.vertices.size(), kUnused);
  const std::vector<std::int8_t> winding = outward_winding(mesh);

  const auto add_to_last_cluster = [&](std::uint32_t source) {
    worlds::Chunk& cluster = out.clusters.back();
    std::array<std::uint32_t, 3> triangle = mesh.triangles[source];
    if (winding[source] < 0) std::swap(triangle[1], triangle[2]);
    for (std::uint32_t& vertex : triangle) {
      const Vec3f& p = mesh.vertices[vertex];
      cluster.bounds.extend(p);
      if (new_index[vertex] == kUnused) {
        new_index[vertex] = static_cast<std::uint32_t>(out.vertices.size());
        out.vertices.push_back(p);
      }
      vertex = new_index[vertex];
    }
    out.triangles.push_back(triangle);
    out.source.push_back(source);
    ++cluster.triangle_count;
  };

  std::vector<std::pair<std::uint32_t, std::uint32_t>> order;  // Morton code, triangle
  for (const worlds::Chunk& chunk : mesh.chunks) {
    for (const bool closed : {true, false}) {
      order.clear();
      for (std::uint32_t i = 0; i < chunk.triangle_count; ++i) {
        const std::uint32_t triangle = chunk.first_triangle + i;
        if ((winding[triangle] != 0) != closed) continue;
        const auto& [a, b, c] = mesh.triangles[triangle];
        const Vec3f centroid = (mesh.vertices[a] + mesh.vertices[b] + mesh.vertices[c]) / 3.0F;
        order.emplace_back(morton_code(centroid, chunk.bounds), triangle);
      }
      std::sort(order.begin(), order.end());
      for (std::size_t i = 0; i < order.size(); ++i) {
        if (i % max_triangles == 0) {
          out.clusters.push_back({static_cast<std::uint32_t>(out.triangles.size()), 0, {}});
          out.closed.push_back(closed);
        }
        add_to_last_cluster(order[i].second);
      }
    }
  }
  return out;
}

std::vector<std::uint32_t> visible_chunks(const std::vector<worlds::Chunk>& chunks,
                                          const ViewVolume& view) {
  std::vector<std::pair<double, std::uint32_t>> found;
  for (std::uint32_t i = 0; i < chunks.size(); ++i) {
    if (chunks[i].triangle_count == 0 || !view.touches(chunks[i].bounds)) continue;
    found.emplace_back(view.nearest_depth(chunks[i].bounds), i);
  }
  std::sort(found.begin(), found.end());
  std::vector<std::uint32_t> order(found.size());
  std::transform(found.begin(), found.end(), order.begin(), [](const auto& f) { return f.second; });
  return order;
}

}  // namespace arex::sim
