#include "semantics/planarity.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace arex {

double planar_fraction(const WorkingCloud& cloud) {
  constexpr float kCube = 0.4F;           // m
  constexpr std::size_t kFewest = 8;      // points
  constexpr double kThin = 0.025;         // m, deviation across a plane
  constexpr double kWide = 0.06;          // m, deviation along it
  constexpr double kLevel = 0.64;         // |n_z| of what may be ground, up to 50 degrees
  constexpr std::size_t kMost = 400'000;  // points that are looked at, in whole cubes
  struct Keyed {
    std::uint64_t key;
    std::uint32_t point;
  };
  std::vector<Keyed> keyed(cloud.points.size());
  for (std::size_t i = 0; i < keyed.size(); ++i) {
    const Eigen::Array<std::int64_t, 3, 1> c =
        ((cloud.points[i] - cloud.low) / kCube).array().floor().cast<std::int64_t>();
    keyed[i] = {static_cast<std::uint64_t>(c[0] << 42 | c[1] << 21 | c[2]),
                static_cast<std::uint32_t>(i)};
  }
  // Of a large cloud every n-th cube by a mixed key: even over the scene.
  const std::uint64_t stride = 1 + cloud.points.size() / kMost;
  std::erase_if(
      keyed, [&](const Keyed& k) { return (k.key * 0x9e3779b97f4a7c15ULL >> 40) % stride != 0; });
  std::sort(keyed.begin(), keyed.end(), [](const Keyed& a, const Keyed& b) {
    return a.key != b.key ? a.key < b.key : a.point < b.point;
  });
  std::size_t plane = 0, all = 0;
  for (std::size_t first = 0, last = 0; first < keyed.size(); first = last) {
    Vec3 mean = Vec3::Zero();
    for (last = first; last < keyed.size() && keyed[last].key == keyed[first].key; ++last) {
      mean += cloud.points[keyed[last].point].cast<double>();
    }
    if (last - first < kFewest) continue;
    mean /= static_cast<double>(last - first);
    Mat3 spread = Mat3::Zero();
    for (std::size_t i = first; i < last; ++i) {
      const Vec3 d = cloud.points[keyed[i].point].cast<double>() - mean;
      spread += d * d.transpose() / static_cast<double>(last - first);
    }
    Eigen::SelfAdjointEigenSolver<Mat3> solver;
    solver.computeDirect(spread);
    const Vec3 deviation = solver.eigenvalues().cwiseMax(0).cwiseSqrt();
    const bool is_plane = deviation[0] < kThin && deviation[1] > kWide;
    if (is_plane && std::abs(solver.eigenvectors().col(0).z()) > kLevel) continue;
    ++all;
    plane += is_plane;
  }
  return all > 0 ? static_cast<double>(plane) / static_cast<double>(all) : 0;
}

}  // namespace arex
