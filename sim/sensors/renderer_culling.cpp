#include "sensors/renderer_culling.h"

#include <algorithm>
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

ClusteredMesh cluster_mesh(const worlds::Mesh& mesh, std::uint32_t max_triangles) {
  ClusteredMesh out;
  out.triangles.reserve(mesh.triangles.size());
  out.source.reserve(mesh.triangles.size());
  out.vertices.reserve(mesh.vertices.size());
  constexpr std::uint32_t kUnused = 0xFFFFFFFFU;
  std::vector<std::uint32_t> new_index(mesh.vertices.size(), kUnused);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> order;  // Morton code, triangle
  for (const worlds::Chunk& chunk : mesh.chunks) {
    order.clear();
    for (std::uint32_t i = 0; i < chunk.triangle_count; ++i) {
      const std::uint32_t triangle = chunk.first_triangle + i;
      const auto& [a, b, c] = mesh.triangles[triangle];
      const Vec3f centroid = (mesh.vertices[a] + mesh.vertices[b] + mesh.vertices[c]) / 3.0F;
      order.emplace_back(morton_code(centroid, chunk.bounds), triangle);
    }
    std::sort(order.begin(), order.end());
    for (std::size_t i = 0; i < order.size(); ++i) {
      if (i % max_triangles == 0) {
        out.clusters.push_back({static_cast<std::uint32_t>(out.triangles.size()), 0, {}});
      }
      worlds::Chunk& cluster = out.clusters.back();
      std::array<std::uint32_t, 3> triangle = mesh.triangles[order[i].second];
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
      out.source.push_back(order[i].second);
      ++cluster.triangle_count;
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
