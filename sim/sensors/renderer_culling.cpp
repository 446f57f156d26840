#include "sensors/renderer_culling.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <limits>
#include <span>
#include <utility>

#include "math/mix.h"
#include "sensors/mesh_surfaces.h"

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

/// The winding of one surface after the other; triangles are counted within theirs.
class WindingOfSurface {
 public:
  explicit WindingOfSurface(const worlds::Mesh& mesh) : mesh_(mesh) {}

  /// Sets that of one surface's triangles; 0 stays where it is open.
  void find(std::span<const std::uint32_t> triangles, std::uint32_t vertex,
            std::vector<std::int8_t>& winding) {
    if (!match_edges(triangles)) return;
    // Carry one triangle's winding over its surface; the sign of the volume tells in from out.
    local_.assign(triangles.size(), 0);
    for (std::uint32_t seed = 0; seed < triangles.size(); ++seed) {
      if (local_[seed] != 0) continue;
      reached_.assign(1, seed);
      local_[seed] = 1;
      double volume = 0;
      bool orientable = true;
      for (std::size_t i = 0; i < reached_.size(); ++i) {
        const std::uint32_t t = reached_[i];
        volume += local_[t] * signed_volume(mesh_, triangles[t], mesh_.vertices[vertex]);
        for (const Neighbour& next : neighbours_[t]) {
          const auto expected = static_cast<std::int8_t>(next.flipped ? -local_[t] : local_[t]);
          if (local_[next.triangle] == 0) {
            local_[next.triangle] = expected;
            reached_.push_back(next.triangle);
          }
          orientable = orientable && local_[next.triangle] == expected;
        }
      }
      const int sign = !orientable || volume == 0 ? 0 : volume > 0 ? 1 : -1;
      for (const std::uint32_t t : reached_) {
        winding[triangles[t]] = static_cast<std::int8_t>(local_[t] * sign);
      }
      if (sign == 0) return;  // the rest of such a surface counts as open
    }
  }

 private:
  /// @return whether each edge bounds exactly two triangles
  bool match_edges(std::span<const std::uint32_t> triangles) {
    sides_.clear();
    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
      const auto& corners = mesh_.triangles[triangles[t]];
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint64_t from = corners[k], to = corners[(k + 1) % 3];
        sides_.push_back({std::min(from, to) << 32U | std::max(from, to), t, from < to});
      }
    }
    std::sort(sides_.begin(), sides_.end());
    neighbours_.assign(triangles.size(), {});
    filled_.assign(triangles.size(), 0);
    for (std::size_t i = 0; i < sides_.size(); i += 2) {
      const bool pair = i + 1 < sides_.size() && sides_[i].edge == sides_[i + 1].edge;
      const bool more = i + 2 < sides_.size() && sides_[i].edge == sides_[i + 2].edge;
      if (!pair || more) return false;
      const EdgeSide &a = sides_[i], &b = sides_[i + 1];
      // Two triangles that run along their edge in the same direction are wound differently.
      const bool flipped = a.forward == b.forward;
      neighbours_[a.triangle][filled_[a.triangle]++] = {b.triangle, flipped};
      neighbours_[b.triangle][filled_[b.triangle]++] = {a.triangle, flipped};
    }
    return true;
  }

  const worlds::Mesh& mesh_;
  std::vector<EdgeSide> sides_;
  std::vector<std::array<Neighbour, 3>> neighbours_;
  std::vector<std::uint8_t> filled_;
  std::vector<std::int8_t> local_;
  std::vector<std::uint32_t> reached_;
};

/// Where a triangle comes among its chunk's.
struct InCluster {
  ClusterKind kind = ClusterKind::kOpen;
  int width_step = 0;      ///< of the logarithm of its width: what is alike from afar
  std::uint64_t code = 0;  ///< along the Morton curve
  std::uint32_t piece = 0, triangle = 0;
  auto operator<=>(const InCluster&) const = default;
};

/// Two for each doubling.
int width_step(float width_m) {
  if (width_m == DetailOfMesh::kAlways) return std::numeric_limits<int>::max();
  int exponent = 0;
  constexpr float kRootHalf = 0.70710678F;
  return (std::frexp(width_m, &exponent) < kRootHalf ? -1 : 0) + 2 * exponent;
}

InCluster place_of(const worlds::Mesh& mesh, const worlds::Chunk& chunk,
                   const std::vector<std::int8_t>& winding, const DetailOfMesh& detail,
                   std::uint32_t triangle) {
  using Part = DetailOfMesh::Part;
  InCluster place{winding[triangle] != 0 ? ClusterKind::kSolid : ClusterKind::kOpen, 0, 0, triangle,
                  triangle};
  if (!detail.none()) {
    const bool first_here = detail.leaf[triangle] == Part::kFirst &&
                            triangle + 1 < chunk.first_triangle + chunk.triangle_count;
    const bool second_here =
        detail.leaf[triangle] == Part::kSecond && triangle > chunk.first_triangle;
    if (first_here || second_here) {
      place.kind = ClusterKind::kLeaves;
      place.piece = second_here ? triangle - 1 : triangle;
    }
    const bool torn = detail.leaf[triangle] != Part::kNone && place.kind != ClusterKind::kLeaves;
    place.width_step = width_step(torn ? DetailOfMesh::kAlways : detail.width_m[triangle]);
  }
  const auto& [a, b, c] = mesh.triangles[place.piece];
  const Vec3f centroid = (mesh.vertices[a] + mesh.vertices[b] + mesh.vertices[c]) / 3.0F;
  place.code = morton_code(centroid, chunk.bounds);
  return place;
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
  std::vector<std::int8_t> winding(mesh.triangles.size(), 0);
  const MeshSurfaces surfaces(mesh);
  WindingOfSurface of_surface(mesh);
  surfaces.each([&](std::span<const std::uint32_t> triangles, std::uint32_t vertex) {
    constexpr std::size_t kFewestOfASolid = 4;
    if (triangles.size() >= kFewestOfASolid) of_surface.find(triangles, vertex, winding);
  });
  return winding;
}

ClusteredChunk cluster_chunk(const worlds::Mesh& mesh, const worlds::Chunk& chunk,
                             const std::vector<std::int8_t>& winding, std::uint32_t max_triangles,
                             const DetailOfMesh& detail) {
  std::vector<InCluster> order;
  for (std::uint32_t i = 0; i < chunk.triangle_count; ++i) {
    order.push_back(place_of(mesh, chunk, winding, detail, chunk.first_triangle + i));
  }
  std::sort(order.begin(), order.end());
  ClusteredChunk out;
  out.triangles.reserve(chunk.triangle_count);
  out.source.reserve(chunk.triangle_count);
  for (std::size_t first = 0; first < order.size();) {
    std::size_t end = first;
    const auto alike = [&](const InCluster& other) {
      return other.kind == order[first].kind && other.width_step == order[first].width_step;
    };
    while (end < order.size() && end - first < max_triangles && alike(order[end])) ++end;
    if (order[first].kind == ClusterKind::kLeaves) {
      for (std::size_t i = first; i < end; ++i) order[i].code = mix_bits(order[i].piece);
      std::sort(order.begin() + static_cast<std::ptrdiff_t>(first),
                order.begin() + static_cast<std::ptrdiff_t>(end));
    }
    out.clusters.push_back(
        {static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(end - first), {}});
    out.kind.push_back(order[first].kind);
    out.width_m.push_back(0);
    for (; first < end; ++first) {
      const std::uint32_t source = order[first].triangle;
      std::array<std::uint32_t, 3> triangle = mesh.triangles[source];
      if (winding[source] < 0) std::swap(triangle[1], triangle[2]);
      for (const std::uint32_t vertex : triangle) {
        out.clusters.back().bounds.extend(mesh.vertices[vertex]);
      }
      out.width_m.back() = std::max(out.width_m.back(),
                                    detail.none() ? DetailOfMesh::kAlways : detail.width_m[source]);
      out.triangles.push_back(triangle);
      out.source.push_back(source);
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
