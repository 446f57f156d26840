#include "worlds/mesh_builder.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <utility>

namespace arex::worlds {
namespace {

void require(bool holds, const char* what) {
  if (!holds) throw std::invalid_argument(what);
}

/// Any unit vector at a right angle to the unit vector n. Duff et al., Building an orthonormal
/// basis, revisited, 2017.
Vec3 any_normal(const Vec3& n) {
  const double sign = std::copysign(1.0, n.z());
  const double a = -1.0 / (sign + n.z());
  return {1.0 + sign * n.x() * n.x() * a, sign * n.x() * n.y() * a, -sign * n.x()};
}

struct ChunkKey {
  bool leaf;
  int row, column;
  auto operator<=>(const ChunkKey&) const = default;
};

/// Splits order[first, last) into runs of at most kMaxChunkTriangles at medians of the centroids.
void split_chunk(std::span<std::uint32_t> order, const std::vector<Vec3f>& centroids,
                 std::vector<std::uint32_t>& counts) {
  if (order.size() <= MeshBuilder::kMaxChunkTriangles) {
    counts.push_back(static_cast<std::uint32_t>(order.size()));
    return;
  }
  Eigen::AlignedBox3f box;
  for (const std::uint32_t t : order) box.extend(centroids[t]);
  Eigen::Index axis = 0;
  box.sizes().maxCoeff(&axis);
  // Ties fall by index, so that the order is total and the same everywhere.
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return std::pair(centroids[a][axis], a) < std::pair(centroids[b][axis], b);
  });
  const std::size_t half = order.size() / 2;
  split_chunk(order.first(half), centroids, counts);
  split_chunk(order.subspan(half), centroids, counts);
}

/// Triangle indices in chunk order; `counts` receives the chunks' sizes.
std::vector<std::uint32_t> chunk_order(const World& world, std::vector<std::uint32_t>& counts) {
  const Mesh& mesh = world.mesh;
  std::vector<Vec3f> centroids(mesh.triangles.size());
  std::vector<ChunkKey> keys(mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto [a, b, c] = mesh.triangles[t];
    centroids[t] = (mesh.vertices[a] + mesh.vertices[b] + mesh.vertices[c]) / 3.0F;
    constexpr auto kSide = static_cast<float>(MeshBuilder::kChunkSide);
    keys[t] = {world.class_of_triangle(t) == SurfaceClass::kLeaf,
               static_cast<int>(std::floor(centroids[t].y() / kSide)),
               static_cast<int>(std::floor(centroids[t].x() / kSide))};
  }
  std::vector<std::uint32_t> order(mesh.triangles.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return keys[a] < keys[b]; });
  for (std::size_t first = 0; first < order.size();) {
    std::size_t last = first;
    while (last < order.size() && keys[order[last]] == keys[order[first]]) ++last;
    split_chunk(std::span(order).subspan(first, last - first), centroids, counts);
    first = last;
  }
  return order;
}

}  // namespace

std::uint32_t MeshBuilder::add_object(SurfaceClass surface_class, double reflectivity, bool felt) {
  require(reflectivity >= 0 && reflectivity <= 1, "a reflectivity lies in [0, 1]");
  world_.objects.push_back({surface_class, static_cast<float>(reflectivity), felt});
  return static_cast<std::uint32_t>(world_.objects.size() - 1);
}

std::uint32_t MeshBuilder::add_vertex(const Vec3& p) {
  world_.mesh.vertices.push_back(p.cast<float>());
  return static_cast<std::uint32_t>(world_.mesh.vertices.size() - 1);
}

void MeshBuilder::add_face(std::uint32_t object, std::uint32_t a, std::uint32_t b,
                           std::uint32_t c) {
  world_.mesh.triangles.push_back({a, b, c});
  world_.mesh.object_of_triangle.push_back(object);
}

void MeshBuilder::add_triangle(std::uint32_t object, const Vec3& a, const Vec3& b, const Vec3& c) {
  const std::uint32_t first = add_vertex(a);
  add_vertex(b);
  add_vertex(c);
  add_face(object, first, first + 1, first + 2);
}

void MeshBuilder::add_quad(std::uint32_t object, const Vec3& a, const Vec3& b, const Vec3& c,
                           const Vec3& d) {
  const std::uint32_t first = add_vertex(a);
  add_vertex(b);
  add_vertex(c);
  add_vertex(d);
  add_face(object, first, first + 1, first + 2);
  add_face(object, first, first + 2, first + 3);
}

void MeshBuilder::add_box(std::uint32_t object, const Pose& X_WP, const Vec3& half_extent) {
  const Vec3& h = half_extent;
  const std::array<Vec2, 4> outline{Vec2(-h.x(), -h.y()), Vec2(h.x(), -h.y()), Vec2(h.x(), h.y()),
                                    Vec2(-h.x(), h.y())};
  add_prism(object, X_WP, outline, -h.z(), h.z());
}

void MeshBuilder::add_tube(std::uint32_t object, std::span<const Vec3> points,
                           std::span<const double> radii, int sides) {
  require(points.size() >= 2 && points.size() == radii.size() && sides >= 3,
          "a tube has two points, a radius at each and three sides at least");
  const auto n = static_cast<std::uint32_t>(sides);
  Vec3 tangent = (points[1] - points[0]).normalized();
  Vec3 u = any_normal(tangent);
  // First vertex of the previous ring, and whether that ring is a single point.
  std::uint32_t previous = 0;
  bool previous_is_tip = false;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3 before = i > 0 ? Vec3((points[i] - points[i - 1]).normalized()) : tangent;
    const Vec3 after =
        i + 1 < points.size() ? Vec3((points[i + 1] - points[i]).normalized()) : before;
    const Vec3 next = (before + after).normalized();
    u = (Quat::FromTwoVectors(tangent, next) * u).eval();
    u = (u - u.dot(next) * next).normalized();
    tangent = next;
    const Vec3 v = tangent.cross(u);

    const bool tip = radii[i] <= 0;
    const auto ring = static_cast<std::uint32_t>(world_.mesh.vertices.size());
    for (std::uint32_t k = 0; k < (tip ? 1 : n); ++k) {
      const double angle = 2 * std::numbers::pi * k / n;
      add_vertex(points[i] + radii[i] * (std::cos(angle) * u + std::sin(angle) * v));
    }
    for (std::uint32_t k = 0; i > 0 && k < n; ++k) {
      const std::uint32_t k1 = (k + 1) % n;
      if (!previous_is_tip) add_face(object, previous + k, previous + k1, tip ? ring : ring + k1);
      if (!tip) add_face(object, previous_is_tip ? previous : previous + k, ring + k1, ring + k);
    }
    const bool end = i == 0 || i + 1 == points.size();
    for (std::uint32_t k = 1; end && !tip && k + 1 < n; ++k) {
      add_face(object, ring, ring + k, ring + k + 1);
    }
    previous = ring;
    previous_is_tip = tip;
  }
}

void MeshBuilder::add_cylinder(std::uint32_t object, const Pose& X_WP, double radius,
                               double half_length, int sides) {
  add_cone(object, X_WP, radius, radius, half_length, sides);
}

void MeshBuilder::add_cone(std::uint32_t object, const Pose& X_WP, double radius_low,
                           double radius_high, double half_length, int sides) {
  const std::array<Vec3, 2> points{X_WP * Vec3(0, 0, -half_length), X_WP * Vec3(0, 0, half_length)};
  const std::array<double, 2> radii{radius_low, radius_high};
  add_tube(object, points, radii, sides);
}

void MeshBuilder::add_disc(std::uint32_t object, const Pose& X_WP, double radius, int sides) {
  require(sides >= 3, "a disc has three sides at least");
  const auto n = static_cast<std::uint32_t>(sides);
  const auto first = static_cast<std::uint32_t>(world_.mesh.vertices.size());
  for (std::uint32_t k = 0; k < n; ++k) {
    const double angle = 2 * std::numbers::pi * k / n;
    add_vertex(X_WP * Vec3(radius * std::cos(angle), radius * std::sin(angle), 0));
  }
  for (std::uint32_t k = 1; k + 1 < n; ++k) add_face(object, first, first + k, first + k + 1);
}

void MeshBuilder::add_prism(std::uint32_t object, const Pose& X_WP, std::span<const Vec2> outline,
                            double low, double high) {
  require(outline.size() >= 3, "a prism's outline has three corners at least");
  const auto n = static_cast<std::uint32_t>(outline.size());
  const auto first = static_cast<std::uint32_t>(world_.mesh.vertices.size());
  for (const Vec2& corner : outline) add_vertex(X_WP * Vec3(corner.x(), corner.y(), low));
  for (const Vec2& corner : outline) add_vertex(X_WP * Vec3(corner.x(), corner.y(), high));
  for (std::uint32_t k = 0; k < n; ++k) {
    const std::uint32_t k1 = (k + 1) % n;
    add_face(object, first + k, first + k1, first + n + k1);
    add_face(object, first + k, first + n + k1, first + n + k);
  }
  for (std::uint32_t k = 1; k + 1 < n; ++k) {
    add_face(object, first, first + k, first + k + 1);
    add_face(object, first + n, first + n + k, first + n + k + 1);
  }
}

void MeshBuilder::add_height_field(std::uint32_t object, HeightField terrain) {
  require(terrain.columns >= 2 && terrain.rows >= 2 && terrain.spacing_m > 0 &&
              terrain.height_m.size() == static_cast<std::size_t>(terrain.columns) *
                                             static_cast<std::size_t>(terrain.rows),
          "a height field has two columns and rows at least, and a height at each sample");
  const auto first = static_cast<std::uint32_t>(world_.mesh.vertices.size());
  const auto columns = static_cast<std::uint32_t>(terrain.columns);
  std::size_t sample = 0;
  for (int row = 0; row < terrain.rows; ++row) {
    for (int column = 0; column < terrain.columns; ++column) {
      add_vertex({terrain.origin.x() + column * terrain.spacing_m,
                  terrain.origin.y() + row * terrain.spacing_m, terrain.height_m[sample++]});
    }
  }
  for (std::uint32_t row = 0; row + 1 < static_cast<std::uint32_t>(terrain.rows); ++row) {
    for (std::uint32_t column = 0; column + 1 < columns; ++column) {
      const std::uint32_t corner = first + row * columns + column;
      add_face(object, corner, corner + 1, corner + columns + 1);
      add_face(object, corner, corner + columns + 1, corner + columns);
    }
  }
  world_.terrain = std::move(terrain);
}

void MeshBuilder::add_mesh(std::span<const Vec3> vertices,
                           std::span<const std::array<std::uint32_t, 3>> triangles,
                           std::span<const std::uint32_t> object_of_triangle) {
  require(triangles.size() == object_of_triangle.size(), "each triangle belongs to an object");
  Mesh& mesh = world_.mesh;
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.reserve(mesh.vertices.size() + vertices.size());
  mesh.triangles.reserve(mesh.triangles.size() + triangles.size());
  for (const Vec3& vertex : vertices) add_vertex(vertex);
  for (const auto& [a, b, c] : triangles) {
    mesh.triangles.push_back({first + a, first + b, first + c});
  }
  mesh.object_of_triangle.insert(mesh.object_of_triangle.end(), object_of_triangle.begin(),
                                 object_of_triangle.end());
}

void MeshBuilder::add_collision_box(std::uint32_t object, const Pose& X_WS,
                                    const Vec3& half_extent) {
  world_.collision_shapes.push_back({CollisionShape::Kind::kBox, X_WS, half_extent, object});
}

void MeshBuilder::add_collision_cylinder(std::uint32_t object, const Pose& X_WS, double radius,
                                         double half_length) {
  world_.collision_shapes.push_back(
      {CollisionShape::Kind::kCylinder, X_WS, Vec3(radius, half_length, 0), object});
}

void MeshBuilder::add_collision_capsule(std::uint32_t object, const Vec3& a, const Vec3& b,
                                        double radius) {
  world_.collision_shapes.push_back({CollisionShape::Kind::kCapsule, pose_along(a, b),
                                     Vec3(radius, 0.5 * (b - a).norm(), 0), object});
}

void MeshBuilder::add_solid_box(std::uint32_t object, const Pose& X_WP, const Vec3& half_extent) {
  add_box(object, X_WP, half_extent);
  add_collision_box(object, X_WP, half_extent);
}

void MeshBuilder::add_solid_cylinder(std::uint32_t object, const Pose& X_WP, double radius,
                                     double half_length, int sides) {
  add_cylinder(object, X_WP, radius, half_length, sides);
  add_collision_cylinder(object, X_WP, radius, half_length);
}

Bounds MeshBuilder::bounds() const {
  Eigen::AlignedBox3f box;
  for (const Vec3f& vertex : world_.mesh.vertices) box.extend(vertex);
  if (box.isEmpty()) return {};
  return {box.min().cast<double>(), box.max().cast<double>()};
}

World MeshBuilder::finish() {
  world_.bounds = bounds();
  std::vector<std::uint32_t> counts;
  const std::vector<std::uint32_t> order = chunk_order(world_, counts);

  // Vertices follow the triangles that use them, so that a chunk reads one stretch of memory.
  constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
  const Mesh old = std::exchange(world_.mesh, {});
  std::vector<std::uint32_t> new_vertex(old.vertices.size(), kUnused);
  Mesh& mesh = world_.mesh;
  mesh.vertices.reserve(old.vertices.size());
  mesh.triangles.reserve(order.size());
  mesh.object_of_triangle.reserve(order.size());
  for (const std::uint32_t t : order) {
    std::array<std::uint32_t, 3> corners = old.triangles[t];
    for (std::uint32_t& corner : corners) {
      if (new_vertex[corner] == kUnused) {
        new_vertex[corner] = static_cast<std::uint32_t>(mesh.vertices.size());
        mesh.vertices.push_back(old.vertices[corner]);
      }
      corner = new_vertex[corner];
    }
    mesh.triangles.push_back(corners);
    mesh.object_of_triangle.push_back(old.object_of_triangle[t]);
  }
  std::uint32_t first = 0;
  for (const std::uint32_t count : counts) {
    Chunk chunk{first, count, {}};
    for (std::uint32_t t = first; t < first + count; ++t) {
      for (const std::uint32_t v : mesh.triangles[t]) chunk.bounds.extend(mesh.vertices[v]);
    }
    mesh.chunks.push_back(chunk);
    first += count;
  }
  return std::exchange(world_, {});
}

Pose pose_along(const Vec3& a, const Vec3& b) {
  Pose X;
  X.p = 0.5 * (a + b);
  const Vec3 z = (b - a).normalized();
  const Vec3 x = any_normal(z);
  X.R.col(0) = x;
  X.R.col(1) = z.cross(x);
  X.R.col(2) = z;
  return X;
}

namespace {

class Fnv {
 public:
  void add(std::uint64_t word) { hash_ = (hash_ ^ word) * 1099511628211ULL; }
  void add(double value) { add(std::bit_cast<std::uint64_t>(value)); }
  void add(float value) { add(std::uint64_t{std::bit_cast<std::uint32_t>(value)}); }
  void add(const auto& matrix) {
    for (Eigen::Index i = 0; i < matrix.size(); ++i) add(*(matrix.data() + i));
  }
  [[nodiscard]] std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_ = 14695981039346656037ULL;
};

}  // namespace

std::uint64_t world_hash(const World& world) {
  Fnv hash;
  for (const Vec3f& vertex : world.mesh.vertices) hash.add(vertex);
  for (const auto& triangle : world.mesh.triangles) {
    for (const std::uint32_t corner : triangle) hash.add(std::uint64_t{corner});
  }
  for (const std::uint32_t object : world.mesh.object_of_triangle) hash.add(std::uint64_t{object});
  for (const Chunk& chunk : world.mesh.chunks) {
    hash.add(std::uint64_t{chunk.first_triangle});
    hash.add(std::uint64_t{chunk.triangle_count});
  }
  for (const Object& object : world.objects) {
    hash.add(static_cast<std::uint64_t>(object.surface_class));
    hash.add(object.reflectivity);
    if (object.felt) hash.add(std::uint64_t{1});
  }
  for (const CollisionShape& shape : world.collision_shapes) {
    hash.add(static_cast<std::uint64_t>(shape.kind));
    hash.add(shape.X_WS.R);
    hash.add(shape.X_WS.p);
    hash.add(shape.size);
    hash.add(std::uint64_t{shape.object});
  }
  for (const float height : world.terrain.height_m) hash.add(height);
  hash.add(world.bounds.low);
  hash.add(world.bounds.high);
  hash.add(world.X_WS.R);
  hash.add(world.X_WS.p);
  return hash.value();
}

}  // namespace arex::worlds
