#include "sensors/renderer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <cstdint>
#include <cstring>

#include "sensors/renderer_culling.h"
#include "sensors/renderer_fill.h"
#include "sensors/renderer_mesh.h"

namespace arex::sim {
namespace {

// A triangle seen more nearly edge-on than this sine covers no pixel's centre, and its depth would
// have no digits.
constexpr double kEdgeOn = 1e-9;
// What a triangle's bounds in the image are widened by, px: far more than their rounding.
constexpr double kBoundsMargin = 1e-6;
// What leaves are enlarged to at most.
constexpr double kMostLarger = 4;

/// A corner of a triangle.
struct Corner {
  Double4 in_C;        ///< x, y, z, m
  Double4 in_picture;  ///< u, v, px, and twice z, m
};

/// A triangle that may cover pixels.
struct Shown {
  Footprint footprint;
  PixelBox box;
  std::uint32_t triangle = 0;  ///< counted within the chunk
};

/// A cluster that may be seen; nearer ones come first, of equally near ones the first in the mesh.
struct Seen {
  double depth = 0;
  std::uint32_t chunk = 0, cluster = 0;
  double share = 1;  ///< of its leaves that is drawn
  auto operator<=>(const Seen&) const = default;
};

/// Where the camera is, for vectors of four.
struct View {
  Double4 x_axis, y_axis, z_axis, origin;  ///< of X_CW
  Double4 focal, centre;

  View(const Pose& X_CW, const PinholeCamera& camera)
      : x_axis(packed(X_CW.R.col(0))),
        y_axis(packed(X_CW.R.col(1))),
        z_axis(packed(X_CW.R.col(2))),
        origin(packed(X_CW.p)),
        focal{camera.fx, camera.fy, 1, 1},
        centre{camera.cx, camera.cy, 0, 0} {}

 private:
  static Double4 packed(const Vec3& v) { return Double4{v.x(), v.y(), v.z(), 0}; }
};

}  // namespace

struct Renderer::Impl {
  using Corners = std::array<Corner, DepthChunk::kMostCorners>;

  /// A strip of the picture, and what drawing it needs.
  template <bool with_triangles>
  struct Canvas {
    Canvas(const PinholeCamera& camera, const Columns& of)
        : columns(of), picture(camera, of.first, of.count) {}

    Columns columns;
    TiledPicture<with_triangles> picture;
    Corners corners;                                         ///< of one cluster
    std::array<Shown, DepthChunk::kClusterTriangles> shown;  ///< and its triangles
    std::size_t triangles = 0;                               ///< drawn
  };

  Impl(const worlds::World& world, const PinholeCamera& camera_in,
       const RendererOptions& options_in)
      : camera(camera_in),
        options(options_in),
        mesh(world, options_in.least_leaf_px > 0 || options_in.least_width_px > 0),
        depths(camera, {0, camera.width}) {
    const int align = options.strip_align_px, strips = options.strips;
    const int wide = (camera.width + strips * align - 1) / (strips * align) * align;
    for (int first = 0; first < camera.width; first += wide) {
      surfaces.emplace_back(camera, Columns{first, std::min(wide, camera.width - first)});
    }
  }

  void find_visible(const Pose& X_WC);
  template <class AnyCanvas>
  void draw_all(AnyCanvas& canvas);
  template <class AnyCanvas>
  void draw(const DepthChunk& chunk, const Cluster& cluster, double share, const View& view,
            AnyCanvas& canvas) const;
  [[nodiscard]] double share_of(const Cluster& cluster, const Vec3& eye_W) const;
  static std::size_t place_leaves(const DepthChunk& chunk, const Cluster& cluster, double share,
                                  const View& view, Corners& corners);
  [[nodiscard]] PixelBox box_of(const Corner& a, const Corner& b, const Corner& c,
                                const Columns& columns) const;
  [[nodiscard]] static bool footprint(const Double4& a, const Double4& b, const Double4& c,
                                      bool closed, Footprint& out);

  PinholeCamera camera;
  RendererOptions options;
  DepthMesh mesh;
  Canvas<false> depths;
  std::vector<Canvas<true>> surfaces;  ///< from left to right
  Pose X_WC;                           ///< of the picture that is drawn
  std::vector<Seen> visible;           ///< the clusters to draw there, in their order
};

namespace {

/// A corner in C and in the picture.
Corner placed(double x_W, double y_W, double z_W, const View& view) {
  const Double4 p = view.x_axis * x_W + view.y_axis * y_W + view.z_axis * z_W + view.origin;
  const Double4 depth = __builtin_shufflevector(p, p, 2, 2, 2, 2);
  return {p, __builtin_shufflevector(view.centre + view.focal * p / depth, depth, 0, 1, 4, 4)};
}

/// A box around leaves that are drawn larger, corners lying up to reach_m from their middles.
Eigen::AlignedBox3f grown(const Eigen::AlignedBox3f& box, float reach_m, double larger) {
  const Vec3f more = Vec3f::Constant(reach_m * static_cast<float>(larger - 1));
  return {box.min() - more, box.max() + more};
}

/// What of a cluster is drawn lies in it.
Eigen::AlignedBox3f bounds_of(const Cluster& cluster, float reach_m, double share) {
  const Eigen::AlignedBox3f& own = cluster.part.bounds;
  return share < 1 ? grown(own, reach_m, std::sqrt(1 / share)) : own;
}

/// The camera of a picture's columns alone.
PinholeCamera narrowed(PinholeCamera camera, const Renderer::Columns& columns) {
  camera.cx -= columns.first;
  camera.width = columns.count;
  return camera;
}

}  // namespace

/// The corners of a cluster's first leaves, each leaf larger about its middle, so that a share of
/// them covers what all of them do. The last one grows with the share, so that nothing jumps.
/// @return how many leaves
std::size_t Renderer::Impl::place_leaves(const DepthChunk& chunk, const Cluster& cluster,
                                         double share, const View& view, Corners& corners) {
  constexpr std::size_t kCorners = 4;
  const double wanted = share * cluster.corner_count / kCorners;
  const auto whole = static_cast<std::size_t>(wanted);
  const double rest = wanted - static_cast<double>(whole);
  const std::size_t count = whole + (rest > 0 ? 1 : 0);
  const double scale = std::sqrt(1 / share);
  for (std::size_t leaf = 0; leaf < count; ++leaf) {
    const double larger = leaf < whole ? scale : scale * std::sqrt(rest);
    std::array<Vec3, kCorners> p_W;
    Vec3 sum = Vec3::Zero();
    for (std::size_t k = 0; k < kCorners; ++k) {
      const std::size_t i = cluster.first_corner + kCorners * leaf + k;
      p_W[k] = Vec3(chunk.x[i], chunk.y[i], chunk.z[i]);
      sum += p_W[k];
    }
    const Vec3 middle = sum / kCorners;
    for (std::size_t k = 0; k < kCorners; ++k) {
      const Vec3 p = middle + larger * (p_W[k] - middle);
      corners[kCorners * leaf + k] = placed(p.x(), p.y(), p.z(), view);
    }
  }
  return count;
}

/// The pixels of a strip, in its own columns, whose centres a triangle may cover: all of them where
/// it reaches behind the near plane.
PixelBox Renderer::Impl::box_of(const Corner& a, const Corner& b, const Corner& c,
                                const Columns& columns) const {
  const auto lower = [](const Double4& l, const Double4& r) { return l < r ? l : r; };
  const auto higher = [](const Double4& l, const Double4& r) { return l > r ? l : r; };
  const Double4 lowest = lower(a.in_picture, lower(b.in_picture, c.in_picture));
  const Double4 highest = higher(a.in_picture, higher(b.in_picture, c.in_picture));
  const Double4 margin{kBoundsMargin, kBoundsMargin, 0, 0};
  const Double4 begin{static_cast<double>(columns.first), 0, 0, 0};
  const Double4 end{columns.first + columns.count - 1.0, camera.height - 1.0, options.far_m,
                    options.far_m};
  const Double4 first = higher(lowest - margin, begin);
  const Double4 last = lower(highest + margin, end);
  const Double4 limits{0, 0, options.near_m, options.far_m};
  // Lanes 0 and 1: beside the picture; 2: all of it before the near plane; 3: all beyond the far.
  const unsigned outside = lanes_of(__builtin_shufflevector(first, limits, 0, 1, 6, 3) >
                                    __builtin_shufflevector(last, limits, 0, 1, 2, 7));
  if (lowest[2] < options.near_m) {  // its place in the picture means nothing
    if ((outside & 0b1100U) != 0) return {};
    return {0, columns.count - 1, 0, camera.height - 1};
  }
  const Double4 within = lower(first, end);
  const Double4 cut = __builtin_convertvector(__builtin_convertvector(within, Int4), Double4);
  const Int4 from = __builtin_convertvector(cut < within ? cut + 1.0 : cut, Int4);
  const Int4 to = __builtin_convertvector(last, Int4);
  return {from[0] - columns.first, outside != 0 ? -1 : to[0] - columns.first, from[1], to[1]};
}

/// @return false if the triangle shows the camera its edge or, of a solid, its inside
bool Renderer::Impl::footprint(const Double4& a, const Double4& b, const Double4& c, bool closed,
                               Footprint& out) {
  // a x b is -(b x a) to the last bit: two triangles agree about the edge between them.
  const auto cross = [](const Double4& l, const Double4& r) {
    return __builtin_shufflevector(l, l, 1, 2, 0, 3) * __builtin_shufflevector(r, r, 2, 0, 1, 3) -
           __builtin_shufflevector(l, l, 2, 0, 1, 3) * __builtin_shufflevector(r, r, 1, 2, 0, 3);
  };
  const auto dot = [](const Double4& l, const Double4& r) {
    const Double4 p = l * r;
    return p[0] + p[1] + p[2];
  };
  const Double4 normal = cross(b - a, c - a);
  const double offset = dot(normal, a);  // positive: seen from inside
  const double sign = offset > 0 ? 1 : -1;
  const Double4 ab = sign * cross(a, b), bc = sign * cross(b, c), ca = sign * cross(c, a);
  const Double4 inverse_depth = normal / offset;
  const Double4 ab_bc_xz = __builtin_shufflevector(ab, bc, 0, 4, 2, 6);
  const Double4 ab_bc_y = __builtin_shufflevector(ab, bc, 1, 5, 1, 5);
  const Double4 ca_q_xz = __builtin_shufflevector(ca, inverse_depth, 0, 4, 2, 6);
  const Double4 ca_q_y = __builtin_shufflevector(ca, inverse_depth, 1, 5, 1, 5);
  out.of_x = __builtin_shufflevector(ab_bc_xz, ca_q_xz, 0, 1, 4, 5);
  out.of_y = __builtin_shufflevector(ab_bc_y, ca_q_y, 0, 1, 4, 5);
  out.of_one = __builtin_shufflevector(ab_bc_xz, ca_q_xz, 2, 3, 6, 7) + 0.0;
  const bool edge_on = offset * offset <= kEdgeOn * kEdgeOn * dot(normal, normal) * dot(a, a);
  return !(edge_on | (closed & (offset >= 0)));
}

template <class AnyCanvas>
void Renderer::Impl::draw(const DepthChunk& chunk, const Cluster& cluster, double share,
                          const View& view, AnyCanvas& canvas) const {
  auto& [columns, picture, corners, shown, drawn] = canvas;
  std::size_t triangles = cluster.part.triangle_count;
  if (share < 1) {
    triangles = 2 * place_leaves(chunk, cluster, share, view, corners);
  } else {
    const std::size_t first = cluster.first_corner;
    for (std::size_t i = 0; i < cluster.corner_count; ++i) {
      corners[i] = placed(chunk.x[first + i], chunk.y[first + i], chunk.z[first + i], view);
    }
  }
  drawn += triangles;
  // Step by step, so that what becomes of one triangle does not keep the next one waiting.
  const bool closed = cluster.kind == ClusterKind::kSolid;
  std::size_t count = 0;
  for (std::uint32_t i = 0; i < triangles; ++i) {
    const auto& [a, b, c] = chunk.triangles[cluster.part.first_triangle + i];
    Shown& next = shown[count];
    next.box = box_of(corners[a], corners[b], corners[c], columns);
    next.triangle = cluster.part.first_triangle + i;
    count += next.box.empty() ? 0 : 1;
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const auto& [a, b, c] = chunk.triangles[shown[i].triangle];
    Shown& next = shown[kept];
    const bool seen =
        footprint(corners[a].in_C, corners[b].in_C, corners[c].in_C, closed, next.footprint);
    next.box = shown[i].box;
    next.triangle = shown[i].triangle;
    kept += seen ? 1 : 0;
  }
  const double most = 1 / options.near_m;
  for (std::size_t i = 0; i < kept; ++i) {
    picture.fill(shown[i].footprint, shown[i].box, most, chunk.source[shown[i].triangle]);
  }
}

/// What share of its leaves is drawn of a cluster; 0: nothing of it, 1: all of it.
double Renderer::Impl::share_of(const Cluster& cluster, const Vec3& eye_W) const {
  if (cluster.width_m == DetailOfMesh::kAlways) return 1;
  // The distance, not the depth: a camera that turns sees the same leaves.
  const double distance = (cluster.part.bounds.center().cast<double>() - eye_W).norm();
  const double width_px = cluster.width_m * camera.fx / distance;
  if (cluster.kind != ClusterKind::kLeaves) return width_px < options.least_width_px ? 0 : 1;
  const double wanted_px = std::min(options.least_leaf_px, kMostLarger * width_px);
  return width_px < wanted_px ? (width_px / wanted_px) * (width_px / wanted_px) : 1;
}

/// Prepares what the camera sees, and puts it in order.
void Renderer::Impl::find_visible(const Pose& X_WC_in) {
  X_WC = X_WC_in;
  visible.clear();
  depths.triangles = 0;
  for (Canvas<true>& canvas : surfaces) canvas.triangles = 0;
  const ViewVolume view(camera, X_WC, options.far_m);
  for (std::uint32_t i = 0; i < mesh.bounds().size(); ++i) {
    const bool empty = mesh.bounds()[i].triangle_count == 0;
    const float reach_m = mesh.leaf_reach_m(i);
    if (empty ||
        (options.cull && !view.touches(grown(mesh.bounds()[i].bounds, reach_m, kMostLarger)))) {
      continue;
    }
    const std::vector<Cluster>& clusters = mesh.chunk(i).clusters;
    for (std::uint32_t k = 0; k < clusters.size(); ++k) {
      const double share = share_of(clusters[k], X_WC.p);
      if (share == 0) continue;
      if (!options.cull) {
        visible.push_back({0, i, k, share});
        continue;
      }
      const Eigen::AlignedBox3f bounds = bounds_of(clusters[k], reach_m, share);
      if (view.touches(bounds)) visible.push_back({view.nearest_depth(bounds), i, k, share});
    }
  }
  std::sort(visible.begin(), visible.end());
}

/// Draws of what is visible what lies in a canvas. The mesh only reads: find_visible() has prepared
/// its chunks.
template <class AnyCanvas>
void Renderer::Impl::draw_all(AnyCanvas& canvas) {
  canvas.picture.clear();
  const View view(X_WC.inverse(), camera);
  const bool narrow = canvas.columns.count < camera.width;
  const ViewVolume volume(narrowed(camera, canvas.columns), X_WC, options.far_m);
  for (const Seen& next : visible) {
    const DepthChunk& chunk = mesh.chunk(next.chunk);
    const Cluster& cluster = chunk.clusters[next.cluster];
    if (narrow && options.cull &&
        !volume.touches(bounds_of(cluster, mesh.leaf_reach_m(next.chunk), next.share))) {
      continue;
    }
    draw(chunk, cluster, next.share, view, canvas);
  }
}

Renderer::Renderer(const worlds::World& world, const PinholeCamera& camera,
                   const RendererOptions& options)
    : impl_(std::make_unique<Impl>(world, camera, options)) {}

Renderer::~Renderer() = default;

// Triangles that reach beyond far_m are drawn whole and cut here, so that the picture does not
// depend on how the world is cut into clusters.

void Renderer::render_inverse_depth(const Pose& X_WC, std::vector<float>& out) {
  impl_->find_visible(X_WC);
  impl_->draw_all(impl_->depths);
  const auto width = static_cast<std::size_t>(impl_->camera.width);
  const auto height = static_cast<std::size_t>(impl_->camera.height);
  const auto least = static_cast<float>(1 / impl_->options.far_m);
  out.resize(width * height);
  float* to = out.data();
  for (int v = 0; v < impl_->camera.height; ++v) {
    impl_->depths.picture.visit_row(v, [&](const float* q, int count) {
      for (int i = 0; i < count; ++i) *to++ = q[i] < least ? 0.0F : q[i];
    });
  }
}

void Renderer::render_triangles(const Pose& X_WC, std::vector<float>& inverse_depth,
                                std::vector<std::uint32_t>& triangles) {
  find_visible(X_WC);
  const auto width = static_cast<std::size_t>(impl_->camera.width);
  const int height = impl_->camera.height;
  inverse_depth.resize(width * static_cast<std::size_t>(height));
  triangles.resize(inverse_depth.size());
  for (std::size_t strip = 0; strip < strips(); ++strip) {
    draw_strip(strip);
    for (int v = 0; v < height; ++v) {
      const std::size_t at =
          static_cast<std::size_t>(v) * width + static_cast<std::size_t>(columns(strip).first);
      read_rows(strip, v, 1, &inverse_depth[at], &triangles[at]);
    }
  }
}

void Renderer::find_visible(const Pose& X_WC) { impl_->find_visible(X_WC); }

void Renderer::draw_strip(std::size_t strip) { impl_->draw_all(impl_->surfaces.at(strip)); }

std::size_t Renderer::strips() const { return impl_->surfaces.size(); }

Renderer::Columns Renderer::columns(std::size_t strip) const {
  return impl_->surfaces.at(strip).columns;
}

void Renderer::read_rows(std::size_t strip, int v, int count, float* inverse_depth,
                         std::uint32_t* triangles) const {
  const auto least = static_cast<float>(1 / impl_->options.far_m);
  const auto crop = [&](const float* q, const std::uint32_t* seen, int pixels) {
    for (int i = 0; i < pixels; ++i) {
      *triangles++ = q[i] < least ? kNoTriangle : seen[i];
      *inverse_depth++ = q[i] < least ? 0.0F : q[i];
    }
  };
  const auto crop_four = [&](const float* q, const std::uint32_t* seen) {
    const auto depths = load_vector<Float4>(q);
    const auto seen_four = load_vector<Uint4>(seen);
    const Int4 too_far = depths < least;
    const Uint4 triangles_four = too_far ? kNoTriangle - Uint4{} : seen_four;
    const Float4 depths_four = too_far ? Float4{} : depths;
    std::memcpy(triangles, &triangles_four, sizeof triangles_four);
    std::memcpy(inverse_depth, &depths_four, sizeof depths_four);
    triangles += kLanes;
    inverse_depth += kLanes;
  };
  for (int row = v; row < v + count; ++row) {
    impl_->surfaces.at(strip).picture.visit_row(
        row, [&](const float* q, const std::uint32_t* seen, int pixels) {
          pixels == kLanes ? crop_four(q, seen) : crop(q, seen, pixels);
        });
  }
}

Renderer::Statistics Renderer::last_frame() const {
  Statistics frame{impl_->visible.size(), impl_->depths.triangles};
  for (const auto& canvas : impl_->surfaces) frame.triangles += canvas.triangles;
  return frame;
}

}  // namespace arex::sim
