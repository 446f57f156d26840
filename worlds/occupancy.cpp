#include "worlds/occupancy.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

namespace arex::worlds {
namespace {

/// Surfaces within this of a cell touch it: absorbs float vertices that stand on cell borders, m.
constexpr double kTouch = 1e-6;

/// The overlap test of one triangle against axis-aligned cubes of one size, set up once per
/// triangle: the plane of the triangle and, in each coordinate plane, its three edges.
class TriangleOverlap {
 public:
  TriangleOverlap(const std::array<Vec3, 3>& v, double side) {
    const std::array<Vec3, 3> e{v[1] - v[0], v[2] - v[1], v[0] - v[2]};
    normal_ = e[0].cross(e[1]);
    const double reach = 0.5 * side * normal_.lpNorm<1>() + kTouch * normal_.norm();
    const double centre = normal_.dot(v[0]) - 0.5 * side * normal_.sum();
    plane_low_ = centre - reach;
    plane_high_ = centre + reach;
    for (int axis = 0; axis < 3; ++axis) {
      const int a = (axis + 1) % 3;
      const int b = (axis + 2) % 3;
      const double sign = normal_[axis] >= 0 ? 1 : -1;
      for (std::size_t i = 0; i < 3; ++i) {
        Edge& edge = edges_[static_cast<std::size_t>(axis)][i];
        edge.na = -e[i][b] * sign;
        edge.nb = e[i][a] * sign;
        edge.d = -(edge.na * v[i][a] + edge.nb * v[i][b]) + std::max(0.0, side * edge.na) +
                 std::max(0.0, side * edge.nb) + kTouch * std::hypot(edge.na, edge.nb);
      }
    }
  }

  /// @pre the cube with its least corner at p overlaps the triangle's bounding box.
  [[nodiscard]] bool overlaps(const Vec3& p) const {
    const double s = normal_.dot(p);
    if (s < plane_low_ || s > plane_high_) return false;
    for (int axis = 0; axis < 3; ++axis) {
      const double a = p[(axis + 1) % 3];
      const double b = p[(axis + 2) % 3];
      for (const Edge& edge : edges_[static_cast<std::size_t>(axis)]) {
        if (edge.na * a + edge.nb * b + edge.d < 0) return false;
      }
    }
    return true;
  }

 private:
  struct Edge {
    double na, nb, d;
  };
  Vec3 normal_;
  double plane_low_, plane_high_;
  std::array<std::array<Edge, 3>, 3> edges_;
};

constexpr float kFar = std::numeric_limits<float>::infinity();

/// One-dimensional squared distance transform of `f` in place: the lower envelope of parabolas.
class LineTransform {
 public:
  explicit LineTransform(int longest)
      : vertex_(static_cast<std::size_t>(longest)),
        value_(static_cast<std::size_t>(longest)),
        border_(static_cast<std::size_t>(longest) + 1) {}

  void run(std::span<float> f) {
    int count = 0;
    const int n = static_cast<int>(f.size());
    for (int q = 0; q < n; ++q) {
      const float height = f[static_cast<std::size_t>(q)];
      if (height == kFar) continue;
      double start = -std::numeric_limits<double>::infinity();
      while (count > 0) {
        // Where the parabola at q falls below the last one of the envelope.
        const auto last = static_cast<std::size_t>(count - 1);
        const int v = vertex_[last];
        const double rise = static_cast<double>(height) - static_cast<double>(value_[last]) +
                            static_cast<double>(q) * q - static_cast<double>(v) * v;
        start = rise / (2.0 * (q - v));
        if (start > border_[last]) break;
        --count;
        start = -std::numeric_limits<double>::infinity();
      }
      const auto next = static_cast<std::size_t>(count++);
      vertex_[next] = q;
      value_[next] = height;
      border_[next] = start;
    }
    if (count == 0) return;
    std::size_t k = 0;
    for (int q = 0; q < n; ++q) {
      while (k + 1 < static_cast<std::size_t>(count) && border_[k + 1] < q) ++k;
      const float d = static_cast<float>(q - vertex_[k]);
      f[static_cast<std::size_t>(q)] = d * d + value_[k];
    }
  }

 private:
  std::vector<int> vertex_;
  std::vector<float> value_;
  std::vector<double> border_;
};

/// Distances along x, where lines are contiguous and two sweeps do.
void sweep_x(const OccupancyGrid& occupancy, std::vector<float>& distance) {
  const auto nx = static_cast<std::size_t>(occupancy.grid.size.x());
  for (std::size_t row = 0; row < distance.size(); row += nx) {
    float run = kFar;
    for (std::size_t i = row; i < row + nx; ++i) {
      run = occupancy.occupied[i] ? 0.0F : run + 1.0F;
      distance[i] = run;
    }
    run = kFar;
    for (std::size_t i = row + nx; i-- > row;) {
      run = occupancy.occupied[i] ? 0.0F : run + 1.0F;
      const float d = std::min(distance[i], run);
      distance[i] = d * d;
    }
  }
}

/// The transform along an axis with this stride, for the `width` contiguous lines that start at
/// `first`: gathered in blocks, so that every cache line is read once.
void sweep_strided(std::vector<float>& distance, std::size_t first, std::size_t width,
                   std::size_t stride, std::size_t length, LineTransform& transform,
                   std::vector<float>& block) {
  constexpr std::size_t kBlock = 16;
  for (std::size_t x = 0; x < width; x += kBlock) {
    const std::size_t lines = std::min(kBlock, width - x);
    for (std::size_t i = 0; i < length; ++i) {
      for (std::size_t l = 0; l < lines; ++l) {
        block[l * length + i] = distance[first + x + l + i * stride];
      }
    }
    for (std::size_t l = 0; l < lines; ++l) {
      transform.run(std::span(block).subspan(l * length, length));
    }
    for (std::size_t i = 0; i < length; ++i) {
      for (std::size_t l = 0; l < lines; ++l) {
        distance[first + x + l + i * stride] = block[l * length + i];
      }
    }
  }
}

}  // namespace

GridGeometry make_grid(const Bounds& bounds, double resolution_m) {
  GridGeometry grid;
  grid.resolution_m = resolution_m;
  // A bound that stands on a cell border does not ask for another cell.
  constexpr double kSlack = 1e-6;
  const Vec3 low = (bounds.low / resolution_m).array() + kSlack;
  const Vec3 high = (bounds.high / resolution_m).array() - kSlack;
  const Vec3 first = low.array().floor();
  const Vec3 last = high.array().ceil();
  grid.origin = resolution_m * first;
  grid.size = (last - first).cast<int>().cwiseMax(1);
  return grid;
}

OccupancyGrid voxelize(const World& world, const GridGeometry& grid, ClassSet classes) {
  OccupancyGrid out{grid, std::vector<std::uint8_t>(grid.cells(), 0)};
  const Mesh& mesh = world.mesh;
  const Eigen::Vector3i last = grid.size - Eigen::Vector3i::Ones();
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!classes.contains(world.class_of_triangle(t))) continue;
    // Relative to the grid's origin.
    std::array<Vec3, 3> v;
    for (std::size_t i = 0; i < 3; ++i) {
      v[i] = mesh.vertices[mesh.triangles[t][i]].cast<double>() - grid.origin;
    }
    const Vec3 low = v[0].cwiseMin(v[1]).cwiseMin(v[2]).array() - kTouch;
    const Vec3 high = v[0].cwiseMax(v[1]).cwiseMax(v[2]).array() + kTouch;
    const Eigen::Vector3i first_cell = (low / grid.resolution_m).array().floor().cast<int>().max(0);
    const Eigen::Vector3i last_cell =
        (high / grid.resolution_m).array().floor().cast<int>().min(last.array());
    if ((first_cell.array() > last_cell.array()).any()) continue;
    const TriangleOverlap overlap(v, grid.resolution_m);
    for (int k = first_cell.z(); k <= last_cell.z(); ++k) {
      for (int j = first_cell.y(); j <= last_cell.y(); ++j) {
        std::uint8_t* row = &out.occupied[grid.index({0, j, k})];
        for (int i = first_cell.x(); i <= last_cell.x(); ++i) {
          if (!row[i] && overlap.overlaps(grid.resolution_m * Vec3(i, j, k))) row[i] = 1;
        }
      }
    }
  }
  return out;
}

std::vector<float> squared_distances(const OccupancyGrid& occupancy) {
  const auto nx = static_cast<std::size_t>(occupancy.grid.size.x());
  const auto ny = static_cast<std::size_t>(occupancy.grid.size.y());
  const auto nz = static_cast<std::size_t>(occupancy.grid.size.z());
  std::vector<float> distance(occupancy.occupied.size());
  sweep_x(occupancy, distance);
  LineTransform transform(static_cast<int>(std::max(ny, nz)));
  std::vector<float> block(16 * std::max(ny, nz));
  for (std::size_t k = 0; k < nz; ++k) {
    sweep_strided(distance, k * nx * ny, nx, nx, ny, transform, block);
  }
  for (std::size_t j = 0; j < ny; ++j) {
    sweep_strided(distance, j * nx, nx, nx * ny, nz, transform, block);
  }
  return distance;
}

// Run by run along x: what lies beside a run is looked at once, not cell by cell.
std::size_t flood(FreeSpace& space, const Eigen::Vector3i& start) {
  const GridGeometry& grid = space.grid;
  if (!grid.contains(start)) return 0;
  const auto is_open = [&space](std::size_t i) { return space.passable[i] && !space.reachable[i]; };
  std::vector<Eigen::Vector3i> open{start};
  std::size_t count = 0;
  while (!open.empty()) {
    const Eigen::Vector3i seed = open.back();
    open.pop_back();
    const std::size_t row = grid.index({0, seed.y(), seed.z()});
    if (!is_open(row + static_cast<std::size_t>(seed.x()))) continue;
    int first = seed.x(), last = seed.x();
    while (first > 0 && is_open(row + static_cast<std::size_t>(first - 1))) --first;
    while (last + 1 < grid.size.x() && is_open(row + static_cast<std::size_t>(last + 1))) ++last;
    for (int x = first; x <= last; ++x) space.reachable[row + static_cast<std::size_t>(x)] = 1;
    count += static_cast<std::size_t>(last - first + 1);
    for (const auto& [dy, dz] :
         {std::pair(-1, 0), std::pair(1, 0), std::pair(0, -1), std::pair(0, 1)}) {
      const Eigen::Vector3i beside(first, seed.y() + dy, seed.z() + dz);
      if (!grid.contains(beside)) continue;
      const std::size_t other = grid.index({0, beside.y(), beside.z()});
      bool in_run = false;
      for (int x = first; x <= last; ++x) {
        const bool here = is_open(other + static_cast<std::size_t>(x));
        if (here && !in_run) open.emplace_back(x, beside.y(), beside.z());
        in_run = here;
      }
    }
  }
  return count;
}

FreeSpace flood_free_space(const OccupancyGrid& occupancy, const Vec3& start, double radius_m) {
  const GridGeometry& grid = occupancy.grid;
  FreeSpace space{grid, std::vector<std::uint8_t>(grid.cells(), 0),
                  std::vector<std::uint8_t>(grid.cells(), 0)};
  if (radius_m > 0) {
    const std::vector<float> distance = squared_distances(occupancy);
    const auto limit = static_cast<float>(std::pow(radius_m / grid.resolution_m, 2));
    std::transform(distance.begin(), distance.end(), space.passable.begin(),
                   [&](float d) { return static_cast<std::uint8_t>(d > limit); });
  } else {
    std::transform(occupancy.occupied.begin(), occupancy.occupied.end(), space.passable.begin(),
                   [](std::uint8_t occupied) { return static_cast<std::uint8_t>(!occupied); });
  }

  flood(space, grid.cell_of(start));
  return space;
}

}  // namespace arex::worlds
