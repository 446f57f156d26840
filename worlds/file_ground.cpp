#include "worlds/file_ground.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>

#include "worlds/mesh_builder.h"

namespace arex::worlds {
namespace {

constexpr double kOneFloor = 0.01;  // between levels that are the same, m

/// Not a number: the column through p misses the triangle.
double height_in(const std::array<Vec3, 3>& v, const Vec2& p) {
  const Vec3 normal = (v[1] - v[0]).cross(v[2] - v[0]);
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec2 a = v[i].head<2>(), edge = v[(i + 1) % 3].head<2>() - a;
    const double side = edge.x() * (p.y() - a.y()) - edge.y() * (p.x() - a.x());
    if (side * normal.z() < 0) return std::nan("");
  }
  return v[0].z() - normal.head<2>().dot(p - v[0].head<2>()) / normal.z();
}

/// A storey's ground on its way out from the start.
class Sheet {
 public:
  Sheet(const World& world, HeightField& field) : ground_(world), field_(field) {
    known_.assign(field.height_m.size(), 0);
  }

  void spread(const Vec3& start) {
    // Up a kerb or down it, and as steep as what can be stood on.
    const double step = kStep + field_.spacing_m;
    const Vec2 sample = (start.head<2>() - field_.origin) / field_.spacing_m;
    const int column = std::clamp(static_cast<int>(std::lround(sample.x())), 0, field_.columns - 1);
    const int row = std::clamp(static_cast<int>(std::lround(sample.y())), 0, field_.rows - 1);
    set(column, row, start.z());
    follow([&](int c, int r, double from) { return nearest_floor(c, r, from, step); });
    // What is left has no such ground.
    for (std::size_t i = 0; i < known_.size(); ++i) {
      if (known_[i]) rim_.push_back(i);
    }
    follow([](int, int, double from) { return from; });
  }

 private:
  static constexpr double kStep = 0.5;  // m

  void set(int column, int row, double height) {
    const std::size_t i = static_cast<std::size_t>(row) * static_cast<std::size_t>(field_.columns) +
                          static_cast<std::size_t>(column);
    field_.height_m[i] = static_cast<float>(height);
    known_[i] = 1;
    rim_.push_back(i);
  }

  /// Not a number: none within a step of the height it is walked to from.
  [[nodiscard]] double nearest_floor(int column, int row, double from, double step) const {
    const Vec2 p = field_.origin + field_.spacing_m * Vec2(column, row);
    double nearest = std::nan("");
    for (const double z : ground_.floors(p)) {
      const double off = std::abs(z - from);
      if (off <= step && !(off >= std::abs(nearest - from))) nearest = z;
    }
    return nearest;
  }

  template <class Height>
  void follow(const Height& height) {
    const std::array<int, 4> dx{1, 0, -1, 0}, dy{0, 1, 0, -1};
    while (!rim_.empty()) {
      const std::size_t i = rim_.front();
      rim_.pop_front();
      const int column = static_cast<int>(i % static_cast<std::size_t>(field_.columns));
      const int row = static_cast<int>(i / static_cast<std::size_t>(field_.columns));
      for (std::size_t k = 0; k < 4; ++k) {
        const int c = column + dx[k], r = row + dy[k];
        if (c < 0 || r < 0 || c >= field_.columns || r >= field_.rows) continue;
        const std::size_t to =
            static_cast<std::size_t>(r) * static_cast<std::size_t>(field_.columns) +
            static_cast<std::size_t>(c);
        if (known_[to]) continue;
        const double z = height(c, r, static_cast<double>(field_.height_m[i]));
        if (std::isfinite(z)) set(c, r, z);
      }
    }
  }

  Ground ground_;
  HeightField& field_;
  std::vector<std::uint8_t> known_;
  std::deque<std::size_t> rim_;  ///< samples whose neighbours are still to be looked at
};

/// Triangles below a sheet.
class Cut {
 public:
  Cut(const HeightField& sheet, double height_m, double piece_m)
      : sheet_(sheet), height_m_(height_m), piece_m_(piece_m) {
    const auto [low, high] = std::minmax_element(sheet.height_m.begin(), sheet.height_m.end());
    low_ = static_cast<double>(*low) + height_m;
    high_ = static_cast<double>(*high) + height_m;
  }

  void add(const std::array<Vec3, 3>& v, std::uint32_t object, MeshBuilder& builder) const {
    const double lowest = std::min({v[0].z(), v[1].z(), v[2].z()});
    const double highest = std::max({v[0].z(), v[1].z(), v[2].z()});
    if (lowest > high_) return;
    if (highest < low_) return builder.add_triangle(object, v[0], v[1], v[2]);
    // The sheet is bent; a piece is cut straight.
    std::size_t longest = 0;
    const auto length = [&](std::size_t i) { return (v[(i + 1) % 3] - v[i]).head<2>().norm(); };
    for (std::size_t i = 1; i < 3; ++i) longest = length(i) > length(longest) ? i : longest;
    if (high_ - low_ > kFlat && length(longest) > piece_m_) {
      const Vec3 a = v[longest], b = v[(longest + 1) % 3], c = v[(longest + 2) % 3];
      const Vec3 middle = 0.5 * (a + b);
      add({a, middle, c}, object, builder);
      add({middle, b, c}, object, builder);
      return;
    }
    clip(v, object, builder);
  }

 private:
  static constexpr double kFlat = 0.2;  // m

  /// Source: Sutherland and Hodgman, Reentrant polygon clipping, 1974.
  void clip(const std::array<Vec3, 3>& v, std::uint32_t object, MeshBuilder& builder) const {
    std::array<double, 3> above{};
    for (std::size_t i = 0; i < 3; ++i) {
      above[i] = v[i].z() - sheet_.at(v[i].x(), v[i].y()) - height_m_;
    }
    std::vector<Vec3> kept;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t next = (i + 1) % 3;
      if (above[i] <= 0) kept.push_back(v[i]);
      if ((above[i] <= 0) == (above[next] <= 0)) continue;
      kept.push_back(v[i] + above[i] / (above[i] - above[next]) * (v[next] - v[i]));
    }
    for (std::size_t i = 2; i < kept.size(); ++i) {
      builder.add_triangle(object, kept[0], kept[i - 1], kept[i]);
    }
  }

  const HeightField& sheet_;
  double height_m_, piece_m_;
  double low_ = 0, high_ = 0;  ///< of the sheet, raised
};

}  // namespace

std::array<Vec3, 3> corners_of(const World& world, std::size_t triangle) {
  std::array<Vec3, 3> v;
  for (std::size_t i = 0; i < 3; ++i) {
    v[i] = world.mesh.vertices[world.mesh.triangles[triangle][i]].cast<double>();
  }
  return v;
}

Ground::Ground(const World& world) : world_(world), low_(world.bounds.low.head<2>()) {
  const Vec2 size = (world.bounds.high - world.bounds.low).head<2>();
  cell_m_ = std::max(1.0, std::sqrt(size.prod() / 1e6));
  columns_ = std::max(1, static_cast<int>(std::ceil(size.x() / cell_m_)));
  rows_ = std::max(1, static_cast<int>(std::ceil(size.y() / cell_m_)));
  members_.resize(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_));
  for (std::size_t t = 0; t < world.mesh.triangles.size(); ++t) {
    if (world.class_of_triangle(t) == SurfaceClass::kLeaf) continue;
    const std::array<Vec3, 3> v = corners_of(world, t);
    if (std::abs((v[1] - v[0]).cross(v[2] - v[0]).normalized().z()) < kStandable) continue;
    add(v, static_cast<std::uint32_t>(t));
  }
}

std::vector<double> Ground::floors(const Vec2& p) const {
  const std::vector<double> all = heights(p);
  std::vector<double> open;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto above = std::find_if(all.begin() + static_cast<std::ptrdiff_t>(i), all.end(),
                                    [&](double z) { return z > all[i] + kOneFloor; });
    if (above == all.end() || *above >= all[i] + kHeadroom) open.push_back(all[i]);
  }
  return open;
}

std::vector<double> Ground::heights(const Vec2& p) const {
  std::vector<double> found;
  const int x = column(p.x()), y = row(p.y());
  if (x < 0 || y < 0 || x >= columns_ || y >= rows_) return found;
  for (const std::uint32_t t : members_[index(x, y)]) {
    if (const double z = height_in(corners_of(world_, t), p); std::isfinite(z)) found.push_back(z);
  }
  std::sort(found.begin(), found.end());
  return found;
}

int Ground::column(double x) const {
  return static_cast<int>(std::floor((x - low_.x()) / cell_m_));
}

int Ground::row(double y) const { return static_cast<int>(std::floor((y - low_.y()) / cell_m_)); }

void Ground::add(const std::array<Vec3, 3>& v, std::uint32_t triangle) {
  const Vec3 low = v[0].cwiseMin(v[1]).cwiseMin(v[2]), high = v[0].cwiseMax(v[1]).cwiseMax(v[2]);
  for (int y = std::max(0, row(low.y())); y <= std::min(rows_ - 1, row(high.y())); ++y) {
    for (int x = std::max(0, column(low.x())); x <= std::min(columns_ - 1, column(high.x())); ++x) {
      members_[index(x, y)].push_back(triangle);
    }
  }
}

HeightField storey_of(const World& world) {
  constexpr double kMostSamples = 400;  // along the longer side
  const Vec2 size = (world.bounds.high - world.bounds.low).head<2>();
  HeightField field;
  field.origin = world.bounds.low.head<2>();
  field.spacing_m = std::max(0.5, size.maxCoeff() / kMostSamples);
  field.columns = static_cast<int>(std::ceil(size.x() / field.spacing_m)) + 1;
  field.rows = static_cast<int>(std::ceil(size.y() / field.spacing_m)) + 1;
  field.height_m.assign(
      static_cast<std::size_t>(field.columns) * static_cast<std::size_t>(field.rows), 0.0F);
  Sheet(world, field).spread(world.X_WS.p);
  return field;
}

World cut_above(const World& world, const HeightField& sheet, double height_m) {
  MeshBuilder builder;
  for (const Object& object : world.objects) {
    builder.add_object(object.surface_class, static_cast<double>(object.reflectivity));
  }
  const Cut cut(sheet, height_m, 2 * sheet.spacing_m);
  for (std::size_t t = 0; t < world.mesh.triangles.size(); ++t) {
    cut.add(corners_of(world, t), world.mesh.object_of_triangle[t], builder);
  }
  World below = builder.finish();
  below.X_WS = world.X_WS;
  return below;
}

}  // namespace arex::worlds
