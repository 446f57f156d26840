#include "semantics/planarity.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "config/config.h"

namespace arex {
namespace {

using Cell = Eigen::Array<std::int64_t, 3, 1>;

std::uint64_t key_of(const Cell& c) {
  return static_cast<std::uint64_t>(c[0] << 42 | c[1] << 21 | c[2]);
}

/// What a cube holds.
struct Cube {
  std::uint64_t key = 0;
  Cell cell;
  Vec3 mean = Vec3::Zero(), normal = Vec3::Zero();
  bool plane = false;                ///< and not level
  bool level = false;                ///< a plane that may be ground or a ceiling
  bool wall = false;                 ///< a plane that goes on beside it
  std::size_t first = 0, count = 0;  ///< of the keyed points
};

struct InCube {
  std::uint64_t key;
  std::uint32_t point;
};

/// The cube at a cell; null: there is none with enough points.
const Cube* cube_at(const Cell& cell, const std::vector<Cube>& cubes) {
  if (cell.minCoeff() < 0) return nullptr;
  const std::uint64_t key = key_of(cell);
  const auto found =
      std::lower_bound(cubes.begin(), cubes.end(), key,
                       [](const Cube& c, std::uint64_t wanted) { return c.key < wanted; });
  return found != cubes.end() && found->key == key ? &*found : nullptr;
}

/// Whether a cube's plane goes on beside it, where a stem's bark curves away.
bool goes_on(const Cube& cube, const std::vector<Cube>& cubes) {
  constexpr double kAlike = 0.94;  // cosine between the normals, 20 degrees
  constexpr double kFlush = 0.06;  // m, of the neighbour's middle from the plane
  const bool along_x = std::abs(cube.normal.x()) < std::abs(cube.normal.y());
  for (const std::int64_t side : {-1, 1}) {
    // The plane may leave by the neighbour's side.
    for (const std::int64_t aside : {0, -1, 1}) {
      const Cell at = cube.cell + (along_x ? Cell(side, aside, 0) : Cell(aside, side, 0));
      const Cube* other = cube_at(at, cubes);
      if (other == nullptr || !other->plane) continue;
      if (std::abs(other->normal.dot(cube.normal)) > kAlike &&
          std::abs(cube.normal.dot(other->mean - cube.mean)) < kFlush) {
        return true;
      }
    }
  }
  return false;
}

/// Whether two walls meet in a cube, which holds no plane for that.
bool is_corner(const Cube& cube, const std::vector<Cube>& cubes) {
  constexpr double kAcross = 0.5;  // cosine between the normals
  std::vector<const Cube*> walls;
  for (std::int64_t dx = -1; dx <= 1; ++dx) {
    for (std::int64_t dy = -1; dy <= 1; ++dy) {
      const Cube* beside = cube_at(cube.cell + Cell(dx, dy, 0), cubes);
      if (beside != nullptr && beside->wall) walls.push_back(beside);
    }
  }
  return std::any_of(walls.begin(), walls.end(), [&](const Cube* wall) {
    return std::abs(wall->normal.dot(walls.front()->normal)) < kAcross;
  });
}

/// The points by their cubes; of more than `most` those of every n-th tower of cubes.
std::vector<InCube> by_cube(const WorkingCloud& cloud, std::size_t most) {
  constexpr float kCube = 0.4F;  // m
  std::vector<InCube> keyed(cloud.points.size());
  for (std::size_t i = 0; i < keyed.size(); ++i) {
    const Cell c = ((cloud.points[i] - cloud.low) / kCube).array().floor().cast<std::int64_t>();
    keyed[i] = {key_of(c), static_cast<std::uint32_t>(i)};
  }
  // By a mixed key: even over the scene.
  const std::uint64_t stride = 1 + cloud.points.size() / most;
  // Four cubes on each side, and all above each other.
  constexpr std::uint64_t kOfTower = ~((3ULL << 42) | (3ULL << 21) | 0x1fffffULL);
  std::erase_if(keyed, [&](const InCube& k) {
    return ((k.key & kOfTower) * 0x9e3779b97f4a7c15ULL >> 40) % stride != 0;
  });
  std::sort(keyed.begin(), keyed.end(), [](const InCube& a, const InCube& b) {
    return a.key != b.key ? a.key < b.key : a.point < b.point;
  });
  return keyed;
}

/// Those with enough points, in the order of their keys.
std::vector<Cube> cubes_of(const WorkingCloud& cloud, const std::vector<InCube>& keyed) {
  constexpr std::size_t kFewest = 8;  // points
  constexpr double kThin = 0.025;     // m, deviation across a plane
  constexpr double kWide = 0.06;      // m, deviation along it
  constexpr double kLevel = 0.64;     // |n_z| of what may be ground, up to 50 degrees
  std::vector<Cube> cubes;
  for (std::size_t first = 0, last = 0; first < keyed.size(); first = last) {
    Cube cube;
    for (last = first; last < keyed.size() && keyed[last].key == keyed[first].key; ++last) {
      cube.mean += cloud.points[keyed[last].point].cast<double>();
    }
    if (last - first < kFewest) continue;
    cube.mean /= static_cast<double>(last - first);
    Mat3 spread = Mat3::Zero();
    for (std::size_t i = first; i < last; ++i) {
      const Vec3 d = cloud.points[keyed[i].point].cast<double>() - cube.mean;
      spread += d * d.transpose() / static_cast<double>(last - first);
    }
    Eigen::SelfAdjointEigenSolver<Mat3> solver;
    solver.computeDirect(spread);
    const Vec3 deviation = solver.eigenvalues().cwiseMax(0).cwiseSqrt();
    cube.normal = solver.eigenvectors().col(0);
    const bool plane = deviation[0] < kThin && deviation[1] > kWide;
    cube.level = plane && std::abs(cube.normal.z()) > kLevel;
    cube.plane = plane && !cube.level;
    cube.key = keyed[first].key;
    cube.cell = Cell(static_cast<std::int64_t>(cube.key >> 42),
                     static_cast<std::int64_t>(cube.key >> 21 & 0x1fffff),
                     static_cast<std::int64_t>(cube.key & 0x1fffff));
    cube.first = first;
    cube.count = last - first;
    cubes.push_back(cube);
  }
  return cubes;
}

/// Of the columns of cubes with a level surface, the share with another that far above it.
double roofed_fraction(const std::vector<Cube>& cubes) {
  constexpr std::int64_t kCeiling = 5;  // cubes, 2 m
  int columns = 0, roofed = 0;
  std::optional<Cell> floor;
  bool counted = false;
  for (const Cube& cube : cubes) {  // column by column, each from below
    if (!cube.level) continue;
    if (!floor || (floor->head<2>() != cube.cell.head<2>()).any()) {
      floor = cube.cell;
      counted = false;
      ++columns;
    }
    if (!counted && cube.cell[2] - (*floor)[2] >= kCeiling) {
      counted = true;
      ++roofed;
    }
  }
  return columns == 0 ? 0 : static_cast<double>(roofed) / columns;
}

}  // namespace

Planarity planarity(const WorkingCloud& cloud) {
  constexpr std::size_t kMost = 400'000;  // points that are looked at
  const std::vector<Cube> cubes = cubes_of(cloud, by_cube(cloud, kMost));
  std::size_t upright = 0, plane = 0;
  for (const Cube& cube : cubes) {
    upright += !cube.level;
    plane += cube.plane && goes_on(cube, cubes);
  }
  Planarity found;
  found.roofed = roofed_fraction(cubes);
  if (upright > 0) found.fraction = static_cast<double>(plane) / static_cast<double>(upright);
  return found;
}

void expect_extent(std::span<const Vec3f> points) {
  constexpr double kThin = 0.0015;  // m: a scanner's noise alone is more
  Vec3 mean = Vec3::Zero();
  std::size_t count = 0;
  for (const Vec3f& p : points) {
    if (!p.allFinite()) continue;
    ++count;
    mean += (p.cast<double>() - mean) / static_cast<double>(count);
  }
  if (count == 0) return;
  Mat3 spread = Mat3::Zero();
  for (const Vec3f& p : points) {
    if (!p.allFinite()) continue;
    const Vec3 d = p.cast<double>() - mean;
    spread += d * d.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(spread / static_cast<double>(count),
                                                   Eigen::EigenvaluesOnly);
  const Vec3 deviation = solver.eigenvalues().cwiseMax(0).cwiseSqrt();  // rising
  if (!(deviation[0] < kThin)) return;
  throw ConfigError(std::string("its points lie ") +
                    (deviation[2] < kThin   ? "in one place"
                     : deviation[1] < kThin ? "on one line"
                                            : "in one plane") +
                    ", expected a cloud of a place");
}

std::vector<bool> points_on_walls(const WorkingCloud& cloud) {
  const std::vector<InCube> keyed = by_cube(cloud, cloud.points.size() + 1);
  std::vector<Cube> cubes = cubes_of(cloud, keyed);
  for (Cube& cube : cubes) cube.wall = cube.plane && goes_on(cube, cubes);
  std::vector<bool> on_wall(cloud.points.size(), false);
  for (const Cube& cube : cubes) {
    if (!cube.wall && (cube.level || !is_corner(cube, cubes))) continue;
    for (std::size_t i = 0; i < cube.count; ++i) on_wall[keyed[cube.first + i].point] = true;
  }
  return on_wall;
}

}  // namespace arex
