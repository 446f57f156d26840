#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <set>
#include <vector>

#include "mapping/ray_caster.h"
#include "messages/registered_scan.h"

/// Brute-force ray casting to compare with.
namespace arex::test {

using Voxel = std::array<int, 3>;
struct VoxelSets {
  std::set<Voxel> hit;
  std::set<Voxel> passed;  ///< without those that were hit
};

inline Voxel voxel_of(const Vec3& p, double resolution_m) {
  const Cell c = (p * (1 / resolution_m)).array().floor().cast<int>();
  return {c.x(), c.y(), c.z()};
}

/// Amanatides and Woo in double: the voxels from p to q without q's own.
inline void traverse(const Vec3& from, const Vec3& to, double resolution_m,
                     std::set<Voxel>& voxels) {
  Voxel at = voxel_of(from, resolution_m);
  const Voxel end = voxel_of(to, resolution_m);
  const Vec3 p = from / resolution_m;
  const Vec3 d = to / resolution_m - p;
  Vec3 t_max, t_delta;
  std::array<int, 3> step{};
  for (int i = 0; i < 3; ++i) {
    const auto a = static_cast<std::size_t>(i);
    step[a] = d[i] > 0 ? 1 : -1;
    const double boundary = d[i] > 0 ? at[a] + 1 : at[a];
    t_max[i] = d[i] == 0 ? std::numeric_limits<double>::infinity() : (boundary - p[i]) / d[i];
    t_delta[i] = d[i] == 0 ? std::numeric_limits<double>::infinity() : 1 / std::abs(d[i]);
  }
  while (at != end) {
    voxels.insert(at);
    int axis = 0;
    if (t_max.minCoeff(&axis) > 1 + 1e-9) break;
    at[static_cast<std::size_t>(axis)] += step[static_cast<std::size_t>(axis)];
    t_max[axis] += t_delta[axis];
  }
}

struct TestRay {
  Vec3 from, to;
  bool hit = true;
};

inline VoxelSets cast_brute_force(const std::vector<TestRay>& rays, double resolution_m,
                                  const CellBox& box) {
  VoxelSets all, out;
  for (const TestRay& ray : rays) {
    traverse(ray.from, ray.to, resolution_m, all.passed);
    if (ray.hit) all.hit.insert(voxel_of(ray.to, resolution_m));
  }
  const auto inside = [&](const Voxel& v) { return box.contains({v[0], v[1], v[2]}); };
  for (const Voxel& v : all.hit) {
    if (inside(v)) out.hit.insert(v);
  }
  for (const Voxel& v : all.passed) {
    if (inside(v) && !all.hit.contains(v)) out.passed.insert(v);
  }
  return out;
}

/// What a caster reports inside the box.
inline VoxelSets sets_of(const RayCaster& rays, const CellBox& box) {
  VoxelSets out;
  for (const BrickRays& brick : rays.bricks()) {
    for (std::size_t i = 0; i < kBrickVoxels; ++i) {
      const auto& c = kBrickCoordinates.of[i];
      const Voxel v{brick.brick.x() * 8 + c[0], brick.brick.y() * 8 + c[1],
                    brick.brick.z() * 8 + c[2]};
      if (!box.contains({v[0], v[1], v[2]})) continue;
      if ((brick.hit[i / 64] >> (i % 64) & 1U) != 0) out.hit.insert(v);
      if ((brick.passed[i / 64] >> (i % 64) & 1U) != 0) out.passed.insert(v);
    }
  }
  return out;
}

/// A scan of a box-shaped room about `centre`; a share of its points, `clutter`, stands in the air.
inline RegisteredScan scan_room(const Vec3& origin, const Vec3& centre, const Vec3& half_size,
                                int points, std::mt19937_64& random, double clutter = 0.1) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  auto cloud = std::make_shared<std::vector<Vec3f>>();
  for (int i = 0; i < points; ++i) {
    const Vec3 d = Vec3(normal(random), normal(random), 0.4 * normal(random)).normalized();
    double range = std::numeric_limits<double>::infinity();
    for (int a = 0; a < 3; ++a) {
      if (d[a] == 0) continue;
      const double wall = centre[a] + (d[a] > 0 ? half_size[a] : -half_size[a]);
      range = std::min(range, (wall - origin[a]) / d[a]);
    }
    if (uniform(random) < clutter) range *= 0.2 + 0.8 * uniform(random);
    cloud->push_back((origin + range * d).cast<float>());
  }
  RegisteredScan scan;
  scan.origin_begin_O = scan.origin_end_O = scan.p_OB = origin;
  scan.points_O = cloud;
  return scan;
}

/// The rays that cast_frame makes of a scan.
inline std::vector<TestRay> rays_of(const RegisteredScan& scan, double range_m,
                                    double body_radius_m) {
  std::vector<TestRay> rays;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const Vec3 from = scan.origin_of(i);
    const Vec3 to = (*scan.points_O)[i].cast<double>();
    const Vec3 p_OB = scan.p_OB + from - scan.origin_end_O;
    if ((to - p_OB).norm() < body_radius_m) continue;
    const double range = (to - from).norm();
    if (range <= range_m) {
      rays.push_back({from, to, true});
    } else {
      rays.push_back({from, from + range_m / range * (to - from), false});
    }
  }
  return rays;
}

}  // namespace arex::test
