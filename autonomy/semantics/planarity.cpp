#include "semantics/planarity.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

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
  bool plane = false;
};

/// Whether a cube's plane goes on beside it, where a stem's bark curves away.
bool goes_on(const Cube& cube, const std::vector<Cube>& cubes) {
  constexpr double kAlike = 0.94;  // cosine between the normals, 20 degrees
  constexpr double kFlush = 0.06;  // m, of the neighbour's middle from the plane
  const bool along_x = std::abs(cube.normal.x()) < std::abs(cube.normal.y());
  for (const std::int64_t side : {-1, 1}) {
    // The plane may leave by the neighbour's side.
    for (const std::int64_t aside : {0, -1, 1}) {
      const Cell at = cube.cell + (along_x ? Cell(side, aside, 0) : Cell(aside, side, 0));
      if (at.minCoeff() < 0) continue;
      const std::uint64_t key = key_of(at);
      const auto other =
          std::lower_bound(cubes.begin(), cubes.end(), key,
                           [](const Cube& c, std::uint64_t wanted) { return c.key < wanted; });
      if (other == cubes.end() || other->key != key || !other->plane) continue;
      if (std::abs(other->normal.dot(cube.normal)) > kAlike &&
          std::abs(cube.normal.dot(other->mean - cube.mean)) < kFlush) {
        return true;
      }
    }
  }
  return false;
}

}  // namespace

double planar_fraction(const WorkingCloud& cloud) {
  constexpr float kCube = 0.4F;           // m
  constexpr std::size_t kFewest = 8;      // points
  constexpr double kThin = 0.025;         // m, deviation across a plane
  constexpr double kWide = 0.06;          // m, deviation along it
  constexpr double kLevel = 0.64;         // |n_z| of what may be ground, up to 50 degrees
  constexpr std::size_t kMost = 400'000;  // points that are looked at, in whole blocks
  struct Keyed {
    std::uint64_t key;
    std::uint32_t point;
  };
  std::vector<Keyed> keyed(cloud.points.size());
  for (std::size_t i = 0; i < keyed.size(); ++i) {
    const Cell c = ((cloud.points[i] - cloud.low) / kCube).array().floor().cast<std::int64_t>();
    keyed[i] = {key_of(c), static_cast<std::uint32_t>(i)};
  }
  // Of a large cloud every n-th block by a mixed key: even over the scene.
  const std::uint64_t stride = 1 + cloud.points.size() / kMost;
  // Four cubes on each side.
  constexpr std::uint64_t kOfBlock = ~((3ULL << 42) | (3ULL << 21) | 3ULL);
  std::erase_if(keyed, [&](const Keyed& k) {
    return ((k.key & kOfBlock) * 0x9e3779b97f4a7c15ULL >> 40) % stride != 0;
  });
  std::sort(keyed.begin(), keyed.end(), [](const Keyed& a, const Keyed& b) {
    return a.key != b.key ? a.key < b.key : a.point < b.point;
  });
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
    cube.plane = deviation[0] < kThin && deviation[1] > kWide;
    if (cube.plane && std::abs(cube.normal.z()) > kLevel) continue;
    cube.key = keyed[first].key;
    cube.cell = Cell(static_cast<std::int64_t>(cube.key >> 42),
                     static_cast<std::int64_t>(cube.key >> 21 & 0x1fffff),
                     static_cast<std::int64_t>(cube.key & 0x1fffff));
    cubes.push_back(cube);
  }
  std::size_t plane = 0;
  for (const Cube& cube : cubes) plane += cube.plane && goes_on(cube, cubes);
  return cubes.empty() ? 0 : static_cast<double>(plane) / static_cast<double>(cubes.size());
}

}  // namespace arex
