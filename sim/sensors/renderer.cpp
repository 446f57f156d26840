#include "sensors/renderer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <cstdint>
#include <cstring>
#include <limits>
#include <utility>

#include "sensors/renderer_culling.h"
#include "sensors/renderer_mesh.h"

namespace arex::sim {
namespace {

// Pixels are decided four at a time: GCC's vectors, whose arithmetic is each number's own.
constexpr int kLanes = 4;
using Double4 = double __attribute__((vector_size(32)));
using Long4 = std::int64_t __attribute__((vector_size(32)));
using Float4 = float __attribute__((vector_size(16)));
using Uint4 = std::uint32_t __attribute__((vector_size(16)));

template <class Vector, class Scalar>
Vector load(const Scalar* from) {
  Vector v;
  std::memcpy(&v, from, sizeof v);
  return v;
}

// A triangle seen more nearly edge-on than this sine covers no pixel's centre, and its depth would
// have no digits.
constexpr double kEdgeOn = 1e-9;
// What a triangle's bounds in the image are widened by, px: far more than their rounding.
constexpr double kBoundsMargin = 1e-6;
// From this width on, each row's run between the edges is worth looking for, px.
constexpr int kWide = 16;

/// The corners of one cluster in C, m, and where they fall in the picture, px.
struct Corners {
  std::array<double, DepthChunk::kMostCorners> x, y, z, u, v;
  [[nodiscard]] Vec3 at(std::size_t i) const { return {x[i], y[i], z[i]}; }
};

/// Pixels from the first up to the last, both included.
struct Box {
  int u_first = 0, u_last = -1, v_first = 0, v_last = -1;
  [[nodiscard]] bool empty() const { return u_first > u_last || v_first > v_last; }
};

/// A triangle as functions of a pixel's ray (x, y, 1): linear, n . ray.
struct Footprint {
  std::array<Vec3, 3> edges;  ///< none is negative where the ray passes inside
  Vec3 inverse_depth;         ///< 1/z of its plane, 1/m
};

/// Sixteen pixels with the triangles that they show: a leaf's lie in one place of the memory or
/// two, where a row of depths and one of triangles would be two for each row that it covers.
struct alignas(64) Tile {
  static constexpr int kRows = 4;
  std::array<float, kRows * kLanes> inverse_depth;     ///< 1/z so far, rows from the top
  std::array<std::uint32_t, kRows * kLanes> triangle;  ///< where anything is drawn
};

/// A cluster that may be seen; nearer ones come first, of equally near ones the first in the mesh.
struct Seen {
  double depth = 0;
  std::uint32_t chunk = 0, cluster = 0;
  auto operator<=>(const Seen&) const = default;
};

}  // namespace

struct Renderer::Impl {
  Impl(const worlds::World& world, const PinholeCamera& camera_in,
       const RendererOptions& options_in)
      : camera(camera_in),
        options(options_in),
        mesh(world.mesh),
        stride((camera.width + kLanes - 1) / kLanes * kLanes) {
    for (int u = 0; u < stride; ++u) ray_x.push_back((u - camera.cx) / camera.fx);
    for (int v = 0; v < camera.height; ++v) ray_y.push_back((v - camera.cy) / camera.fy);
  }

  /// What a picture is made of: depths alone, or with the triangle of each pixel.
  enum class Content : std::uint8_t { kDepth, kTriangles };

  template <Content content>
  void draw_all(const Pose& X_WC);
  void crop(std::vector<float>& out) const;
  /// The first tile of those that hold row v.
  [[nodiscard]] std::size_t first_tile(int v) const {
    return static_cast<std::size_t>(v / Tile::kRows) * static_cast<std::size_t>(stride / kLanes);
  }
  template <Content content>
  void draw(const DepthChunk& chunk, const Cluster& cluster, const Pose& X_CW);
  void place(const DepthChunk& chunk, const Cluster& cluster, const Pose& X_CW);
  [[nodiscard]] std::vector<Seen> visible(const Pose& X_WC);
  [[nodiscard]] Box box_of(std::size_t a, std::size_t b, std::size_t c) const;
  [[nodiscard]] bool footprint(const Vec3& a, const Vec3& b, const Vec3& c, bool closed,
                               Footprint& out) const;
  template <Content content>
  void fill(const Footprint& footprint, const Box& box, std::uint32_t triangle);
  template <Content content>
  void fill_row(const Footprint& footprint, int v, int u_first, int u_last, std::uint32_t triangle);

  PinholeCamera camera;
  RendererOptions options;
  DepthMesh mesh;
  int stride;                        ///< of the picture under way, a multiple of the lanes, px
  std::vector<double> ray_x, ray_y;  ///< of each column and row
  // The picture under way: of depths alone 1/z so far, with triangles in tiles.
  std::vector<float> picture;
  std::vector<Tile> tiles;
  Corners corners;
  Statistics last_frame;
};

/// Brings a cluster's corners into C and into the picture.
void Renderer::Impl::place(const DepthChunk& chunk, const Cluster& cluster, const Pose& X_CW) {
  const Mat3& R = X_CW.R;
  const Vec3& p = X_CW.p;
  const float* x = &chunk.x[cluster.first_corner];
  const float* y = &chunk.y[cluster.first_corner];
  const float* z = &chunk.z[cluster.first_corner];
  for (std::size_t i = 0; i < cluster.corner_count; ++i) {
    const double x_W = x[i], y_W = y[i], z_W = z[i];
    corners.x[i] = R(0, 0) * x_W + R(0, 1) * y_W + R(0, 2) * z_W + p.x();
    corners.y[i] = R(1, 0) * x_W + R(1, 1) * y_W + R(1, 2) * z_W + p.y();
    corners.z[i] = R(2, 0) * x_W + R(2, 1) * y_W + R(2, 2) * z_W + p.z();
    corners.u[i] = camera.cx + camera.fx * corners.x[i] / corners.z[i];
    corners.v[i] = camera.cy + camera.fy * corners.y[i] / corners.z[i];
  }
}

/// The pixels whose centres a triangle may cover: all of them where it reaches behind the near
/// plane.
Box Renderer::Impl::box_of(std::size_t a, std::size_t b, std::size_t c) const {
  const auto lowest = [&](const auto& k) { return std::min(k[a], std::min(k[b], k[c])); };
  const auto highest = [&](const auto& k) { return std::max(k[a], std::max(k[b], k[c])); };
  const double z_low = lowest(corners.z), z_high = highest(corners.z);
  if (z_high < options.near_m || z_low > options.far_m) return {};
  const double u_end = camera.width - 1, v_end = camera.height - 1;
  if (z_low < options.near_m) return {0, camera.width - 1, 0, camera.height - 1};
  const double u_low = std::max(lowest(corners.u) - kBoundsMargin, 0.0);
  const double v_low = std::max(lowest(corners.v) - kBoundsMargin, 0.0);
  const double u_high = std::min(highest(corners.u) + kBoundsMargin, u_end);
  const double v_high = std::min(highest(corners.v) + kBoundsMargin, v_end);
  if (u_low > u_high || v_low > v_high) return {};
  return {static_cast<int>(std::ceil(u_low)), static_cast<int>(u_high),
          static_cast<int>(std::ceil(v_low)), static_cast<int>(v_high)};
}

/// @return false if the triangle shows the camera its edge or, of a solid, its inside
bool Renderer::Impl::footprint(const Vec3& a, const Vec3& b, const Vec3& c, bool closed,
                               Footprint& out) const {
  const Vec3 normal = (b - a).cross(c - a);
  const double offset = normal.dot(a);  // positive: seen from inside
  if (closed && offset >= 0) return false;
  if (offset * offset <= kEdgeOn * kEdgeOn * normal.squaredNorm() * a.squaredNorm()) return false;
  // a x b is -(b x a) to the last bit: two triangles agree about the edge between them.
  const double sign = offset > 0 ? 1 : -1;
  out.edges = {sign * a.cross(b), sign * b.cross(c), sign * c.cross(a)};
  out.inverse_depth = normal / offset;
  return true;
}

/// Sets the pixels of a row that the triangle covers and nothing nearer does.
template <Renderer::Impl::Content content>
void Renderer::Impl::fill_row(const Footprint& footprint, int v, int u_first, int u_last,
                              std::uint32_t triangle) {
  const double y = ray_y[static_cast<std::size_t>(v)];
  const auto& [e0, e1, e2] = footprint.edges;
  const Vec3& depth = footprint.inverse_depth;
  const double row0 = e0.y() * y + e0.z(), row1 = e1.y() * y + e1.z(), row2 = e2.y() * y + e2.z();
  const double row_depth = depth.y() * y + depth.z();
  const double most = 1 / options.near_m;
  constexpr bool in_tiles = content == Content::kTriangles;
  const std::size_t row = static_cast<std::size_t>(v) * static_cast<std::size_t>(stride);
  const std::size_t tile_row = first_tile(v);
  const auto row_in_tile = static_cast<std::size_t>(v % Tile::kRows * kLanes);
  for (int u = u_first / kLanes * kLanes; u <= u_last; u += kLanes) {
    const auto x = load<Double4>(&ray_x[static_cast<std::size_t>(u)]);
    const Double4 q = depth.x() * x + row_depth;
    const Long4 covered = (e0.x() * x + row0 >= 0) & (e1.x() * x + row1 >= 0) &
                          (e2.x() * x + row2 >= 0) & (q <= most);
    const auto drawn = __builtin_convertvector(covered ? q : Double4{}, Float4);
    Tile* tile = in_tiles ? &tiles[tile_row + static_cast<std::size_t>(u / kLanes)] : nullptr;
    float* so_far =
        in_tiles ? &tile->inverse_depth[row_in_tile] : &picture[row + static_cast<std::size_t>(u)];
    const auto before = load<Float4>(so_far);
    const Float4 after = drawn > before ? drawn : before;
    std::memcpy(so_far, &after, sizeof after);
    if constexpr (in_tiles) {
      std::uint32_t* seen = &tile->triangle[row_in_tile];
      const auto seen_before = load<Uint4>(seen);
      const Uint4 seen_after = drawn > before ? triangle - Uint4{} : seen_before;
      std::memcpy(seen, &seen_after, sizeof seen_after);
    }
  }
}

template <Renderer::Impl::Content content>
void Renderer::Impl::fill(const Footprint& footprint, const Box& box, std::uint32_t triangle) {
  const bool wide = box.u_last - box.u_first >= kWide;
  std::array<double, 3> roots{};  // an edge is zero at x = roots[i] * (its value at x = 0)
  for (std::size_t i = 0; wide && i < 3; ++i) roots[i] = -1 / footprint.edges[i].x();
  for (int v = box.v_first; v <= box.v_last; ++v) {
    double first = box.u_first, last = box.u_last;
    for (std::size_t i = 0; wide && i < 3; ++i) {
      // A pixel of slack on both sides: fill_row decides.
      const Vec3& edge = footprint.edges[i];
      const double at_centre = edge.y() * ray_y[static_cast<std::size_t>(v)] + edge.z();
      const double u = camera.cx + camera.fx * (at_centre * roots[i]);
      if (edge.x() > 0) first = std::max(first, u - 1);
      if (edge.x() < 0) last = std::min(last, u + 1);
      if (edge.x() == 0 && at_centre < 0) last = first - 1;
    }
    if (first > last) continue;
    fill_row<content>(footprint, v, static_cast<int>(first), static_cast<int>(last), triangle);
  }
}

template <Renderer::Impl::Content content>
void Renderer::Impl::draw(const DepthChunk& chunk, const Cluster& cluster, const Pose& X_CW) {
  place(chunk, cluster, X_CW);
  Footprint footprint_of_triangle;
  for (std::uint32_t i = 0; i < cluster.part.triangle_count; ++i) {
    const std::uint32_t triangle = cluster.part.first_triangle + i;
    const auto& [a, b, c] = chunk.triangles[triangle];
    const Box box = box_of(a, b, c);
    if (box.empty()) continue;
    if (!footprint(corners.at(a), corners.at(b), corners.at(c), cluster.closed,
                   footprint_of_triangle)) {
      continue;
    }
    fill<content>(footprint_of_triangle, box, chunk.source[triangle]);
  }
}

/// The clusters to draw, in their order.
std::vector<Seen> Renderer::Impl::visible(const Pose& X_WC) {
  std::vector<Seen> found;
  const ViewVolume view(camera, X_WC, options.far_m);
  for (std::uint32_t i = 0; i < mesh.bounds().size(); ++i) {
    const bool empty = mesh.bounds()[i].triangle_count == 0;
    if (empty || (options.cull && !view.touches(mesh.bounds()[i].bounds))) continue;
    const std::vector<Cluster>& clusters = mesh.chunk(i).clusters;
    for (std::uint32_t k = 0; k < clusters.size(); ++k) {
      const Eigen::AlignedBox3f& bounds = clusters[k].part.bounds;
      if (!options.cull) {
        found.push_back({0, i, k});
      } else if (view.touches(bounds)) {
        found.push_back({view.nearest_depth(bounds), i, k});
      }
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

template <Renderer::Impl::Content content>
void Renderer::Impl::draw_all(const Pose& X_WC) {
  const std::vector<Seen> clusters = visible(X_WC);
  if constexpr (content == Content::kTriangles) {
    tiles.resize(first_tile(camera.height - 1) + static_cast<std::size_t>(stride / kLanes));
    for (Tile& tile : tiles) tile.inverse_depth.fill(0.0F);
  } else {
    picture.assign(static_cast<std::size_t>(stride) * static_cast<std::size_t>(camera.height),
                   0.0F);
  }
  last_frame = {clusters.size(), 0};
  const Pose X_CW = X_WC.inverse();
  for (const Seen& seen_cluster : clusters) {
    const DepthChunk& chunk = mesh.chunk(seen_cluster.chunk);
    const Cluster& cluster = chunk.clusters[seen_cluster.cluster];
    draw<content>(chunk, cluster, X_CW);
    last_frame.triangles += cluster.part.triangle_count;
  }
}

/// Triangles that reach beyond far_m are drawn whole and cut here, so that the picture does not
/// depend on how the world is cut into clusters.
void Renderer::Impl::crop(std::vector<float>& out) const {
  const auto width = static_cast<std::size_t>(camera.width);
  const auto height = static_cast<std::size_t>(camera.height);
  const auto least = static_cast<float>(1 / options.far_m);
  out.resize(width * height);
  for (std::size_t v = 0; v < height; ++v) {
    const float* in = &picture[v * static_cast<std::size_t>(stride)];
    std::transform(in, in + width, &out[v * width],
                   [least](float q) { return q < least ? 0.0F : q; });
  }
}

Renderer::Renderer(const worlds::World& world, const PinholeCamera& camera,
                   const RendererOptions& options)
    : impl_(std::make_unique<Impl>(world, camera, options)) {}

Renderer::~Renderer() = default;

void Renderer::render_inverse_depth(const Pose& X_WC, std::vector<float>& out) {
  impl_->draw_all<Impl::Content::kDepth>(X_WC);
  impl_->crop(out);
}

void Renderer::render_triangles(const Pose& X_WC, std::vector<float>& inverse_depth,
                                std::vector<std::uint32_t>& triangles) {
  Impl& impl = *impl_;
  impl.draw_all<Impl::Content::kTriangles>(X_WC);
  const int width = impl.camera.width, height = impl.camera.height;
  const auto least = static_cast<float>(1 / impl.options.far_m);
  inverse_depth.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  triangles.resize(inverse_depth.size());
  float* to = inverse_depth.data();
  std::uint32_t* to_triangle = triangles.data();
  for (int v = 0; v < height; ++v) {
    const Tile* tile = &impl.tiles[impl.first_tile(v)];
    const auto row_in_tile = static_cast<std::size_t>(v % Tile::kRows * kLanes);
    for (int u = 0; u < width; u += kLanes, ++tile) {
      const float* q = &tile->inverse_depth[row_in_tile];
      const std::uint32_t* seen = &tile->triangle[row_in_tile];
      const int count = std::min(kLanes, width - u);
      for (int i = 0; i < count; ++i) {  // as crop() does
        *to_triangle++ = q[i] < least ? kNoTriangle : seen[i];
        *to++ = q[i] < least ? 0.0F : q[i];
      }
    }
  }
}

Renderer::Statistics Renderer::last_frame() const { return impl_->last_frame; }

}  // namespace arex::sim
