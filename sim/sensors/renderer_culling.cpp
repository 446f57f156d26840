#include "sensors/renderer_culling.h"

#include <algorithm>
#include <array>
#include <compare>
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

/// Triangles that hang together by shared vertices, each such surface named by one of its vertices.
class Surfaces {
 public:
  explicit Surfaces(const worlds::Mesh& mesh)
      : parent_(mesh.vertices.size()), triangle_count_(mesh.vertices.size(), 0) {
    std::iota(parent_.begin(), parent_.end(), 0U);
    for (const auto& [a, b, c] : mesh.triangles) {
      parent_[find(b)] = find(a);
      parent_[find(c)] = find(a);
    }
    for (std::uint32_t vertex = 0; vertex < parent_.size(); ++vertex)
      parent_[vertex] = find(vertex);
    for (const auto& triangle : mesh.triangles) ++triangle_count_[of(triangle[0])];
  }
  [[nodiscard]] std::uint32_t of(std::uint32_t vertex) const { return parent_[vertex]; }
  [[nodiscard]] std::uint32_t triangle_count(std::uint32_t vertex) const {
    return triangle_count_[of(vertex)];
  }

 private:
  std::uint32_t find(std::uint32_t vertex) {
    while (parent_[vertex] != vertex) vertex = parent_[vertex] = parent_[parent_[vertex]];
    return vertex;
  }
  std::vector<std::uint32_t> parent_, triangle_count_;
};

/// One triangle's run along an edge, from its lower to its higher vertex or back.
struct EdgeSide {
  std::uint64_t edge;
  std::uint32_t triangle;
  bool forward;
  auto operator<=>(const EdgeSide&) const = default;
};

struct Neighbour {
  std::uint32_t triangle = 0;
  bool flipped = false;
};

/// Six times the volume between a triangle and `apex`, positive if counter-clockwise from beyond.
double signed_volume(const worlds::Mesh& mesh, std::uint32_t triangle, const Vec3f& apex) {
  const auto& [a, b, c] = mesh.triangles[triangle];
  const Vec3 p = (mesh.vertices[a] - apex).cast<double>();
  const Vec3 q = (mesh.vertices[b] - apex).cast<double>();
  const Vec3 r = (mesh.vertices[c] - apex).cast<double>();
  return p.dot(q.cross(r));
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
  const Surfaces surfaces(mesh);
  std::vector<EdgeSide> sides;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    constexpr std::uint32_t kFewestOfASolid = 4;
    if (surfaces.triangle_count(mesh.triangles[t][0]) < kFewestOfASolid) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint64_t from = mesh.triangles[t][k], to = mesh.triangles[t][(k + 1) % 3];
      sides.push_back({std::min(from, to) << 32U | std::max(from, to), t, from < to});
    }
  }
  std::sort(sides.begin(), sides.end());
  // Two triangles that run along their edge in the same direction are wound differently.
  std::vector<bool> open(mesh.vertices.size(), false);
  std::vector<std::array<Neighbour, 3>> neighbours(mesh.triangles.size());
  std::vector<std::uint8_t> filled(mesh.triangles.size(), 0);
  for (std::size_t i = 0; i < sides.size();) {
    std::size_t end = i + 1;
    while (end < sides.size() && sides[end].edge == sides[i].edge) ++end;
    const EdgeSide& a = sides[i];
    const EdgeSide& b = sides[end - 1];
    if (end - i == 2) {
      const bool flipped = a.forward == b.forward;
      neighbours[a.triangle][filled[a.triangle]++] = {b.triangle, flipped};
      neighbours[b.triangle][filled[b.triangle]++] = {a.triangle, flipped};
    } else {
      open[surfaces.of(mesh.triangles[a.triangle][0])] = true;
    }
    i = end;
  }
  // Carry one triangle's winding over its surface; the sign of the volume tells in from out.
  std::vector<std::int8_t> winding(mesh.triangles.size(), 0);
  std::vector<std::uint32_t> reached;
  for (std::uint32_t seed = 0; seed < winding.size(); ++seed) {
    const std::uint32_t surface = surfaces.of(mesh.triangles[seed][0]);
    if (winding[seed] != 0 || filled[seed] != 3 || open[surface]) continue;
    reached.assign(1, seed);
    winding[seed] = 1;
    double volume = 0;
    bool orientable = true;
    for (std::size_t i = 0; i < reached.size(); ++i) {
      const std::uint32_t t = reached[i];
      volume += winding[t] * signed_volume(mesh, t, mesh.vertices[surface]);
      for (const Neighbour& next : neighbours[t]) {
        const auto expected = static_cast<std::int8_t>(next.flipped ? -winding[t] : winding[t]);
        if (winding[next.triangle] == 0) {
          winding[next.triangle] = expected;
          reached.push_back(next.triangle);
        }
        orientable = orientable && winding[next.triangle] == expected;
      }
    }
    const int sign = !orientable || volume == 0 ? 0 : volume > 0 ? 1 : -1;
    for (const std::uint32_t t : reached) winding[t] = static_cast<std::int8_t>(winding[t] * sign);
    if (sign == 0) open[surface] = true;
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
