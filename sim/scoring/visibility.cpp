#include "scoring/visibility.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

namespace arex::sim {
namespace {

// A sample's own surface is no obstacle to seeing it; nor is what lies this close before it, m.
constexpr double kSkin = 0.001;

// The ray that must meet nothing for the sample to be seen; max_distance_m < 0 if out of the
// question.
Ray sight_line(const Vec3& viewpoint_W, const SurfaceSample& sample, double range_m,
               double min_cosine) {
  Ray ray;
  const Vec3 line = sample.p_W.cast<double>() - viewpoint_W;
  const double distance = line.norm();
  ray.max_distance_m = -1;
  if (distance > range_m || distance <= kSkin) return ray;
  ray.origin_W = viewpoint_W.cast<float>();
  ray.direction_W = (line / distance).cast<float>();
  if (std::abs(ray.direction_W.dot(sample.normal_W)) < static_cast<float>(min_cosine)) return ray;
  ray.max_distance_m = static_cast<float>(distance - kSkin);
  return ray;
}

double min_cosine(const VisibilityConfig& config) {
  return std::cos(to_radians(config.max_incidence_deg));
}

// Sample indices sorted by the cube they lie in.
std::vector<std::uint32_t> sort_by_cube(const Viewpoints& viewpoints,
                                        const std::vector<SurfaceSample>& samples) {
  std::vector<std::array<int, 3>> cube(samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Eigen::Vector3i c = viewpoints.cube_of(samples[i].p_W.cast<double>());
    cube[i] = {c.z(), c.y(), c.x()};
  }
  std::vector<std::uint32_t> order(samples.size());
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::stable_sort(order, {}, [&](std::uint32_t i) { return cube[i]; });
  return order;
}

}  // namespace

Viewpoints::Viewpoints(const ReachableSpace& space, double spacing_m) {
  const worlds::GridGeometry& fine = space.grid;
  const Vec3 high = fine.origin + fine.resolution_m * fine.size.cast<double>();
  grid_ = worlds::make_grid({fine.origin, high}, spacing_m);
  point_of_cube_.assign(grid_.cells(), -1);
  std::vector<double> best;
  std::size_t index = 0;
  for (int k = 0; k < fine.size.z(); ++k) {
    for (int j = 0; j < fine.size.y(); ++j) {
      for (int i = 0; i < fine.size.x(); ++i, ++index) {
        if (!space.reachable[index]) continue;
        const Vec3 p = fine.centre({i, j, k});
        const Eigen::Vector3i cube = grid_.cell_of(p);
        const double distance = (p - grid_.centre(cube)).squaredNorm();
        std::int32_t& slot = point_of_cube_[grid_.index(cube)];
        if (slot < 0) {
          slot = static_cast<std::int32_t>(points_W_.size());
          points_W_.push_back(p);
          best.push_back(distance);
        } else if (distance < best[static_cast<std::size_t>(slot)]) {
          points_W_[static_cast<std::size_t>(slot)] = p;
          best[static_cast<std::size_t>(slot)] = distance;
        }
      }
    }
  }
}

const Vec3* Viewpoints::in_cube(const Eigen::Vector3i& cube) const {
  if (!grid_.contains(cube)) return nullptr;
  const std::int32_t slot = point_of_cube_[grid_.index(cube)];
  return slot < 0 ? nullptr : &points_W_[static_cast<std::size_t>(slot)];
}

std::vector<Vec3> Viewpoints::around(const Vec3& p_W, double range_m) const {
  const Eigen::Vector3i home = grid_.cell_of(p_W);
  std::vector<Vec3> found;
  if (const Vec3* own = in_cube(home)) found.push_back(*own);
  for (int direction = 0; direction < 27; ++direction) {
    const Eigen::Vector3i step(direction % 3 - 1, direction / 3 % 3 - 1, direction / 9 - 1);
    const double length = grid_.resolution_m * step.cast<double>().norm();
    if (length == 0) continue;
    for (int n = 1; n * length <= range_m; ++n) {
      if (const Vec3* point = in_cube(home + n * step)) {
        found.push_back(*point);
        break;
      }
    }
  }
  const Vec3 middle = grid_.centre(home);
  std::ranges::stable_sort(found, {}, [&](const Vec3& v) { return (v - middle).squaredNorm(); });
  return found;
}

bool sees(const Scene& scene, const Vec3& viewpoint_W, const SurfaceSample& sample,
          const VisibilityConfig& config) {
  const Ray ray = sight_line(viewpoint_W, sample, config.range_m, min_cosine(config));
  if (ray.max_distance_m < 0) return false;
  std::array<RayHit, 1> hit;
  scene.cast(std::span(&ray, 1), hit);
  return !hit[0].valid();
}

std::vector<std::uint8_t> find_visible(const Scene& scene, const Viewpoints& viewpoints,
                                       const std::vector<SurfaceSample>& samples,
                                       const VisibilityConfig& config) {
  std::vector<std::uint8_t> visible(samples.size(), 0);
  const std::vector<std::uint32_t> order = sort_by_cube(viewpoints, samples);
  const double cosine = min_cosine(config);
  std::vector<std::uint32_t> pending;
  std::vector<Ray> rays;
  std::vector<RayHit> hits;
  // Cube by cube, so that the rays of a batch share their origin and nearly their direction.
  for (std::size_t first = 0; first < order.size();) {
    const Vec3 p = samples[order[first]].p_W.cast<double>();
    const Eigen::Vector3i cube = viewpoints.cube_of(p);
    std::size_t last = first;
    while (last < order.size() &&
           viewpoints.cube_of(samples[order[last]].p_W.cast<double>()) == cube) {
      ++last;
    }
    pending.assign(order.begin() + static_cast<std::ptrdiff_t>(first),
                   order.begin() + static_cast<std::ptrdiff_t>(last));
    first = last;
    for (const Vec3& viewpoint : viewpoints.around(p, config.range_m)) {
      rays.clear();
      std::vector<std::uint32_t> asked, left;
      for (const std::uint32_t i : pending) {
        const Ray ray = sight_line(viewpoint, samples[i], config.range_m, cosine);
        if (ray.max_distance_m < 0) {
          left.push_back(i);
        } else {
          rays.push_back(ray);
          asked.push_back(i);
        }
      }
      hits.resize(rays.size());
      scene.cast(rays, hits);
      for (std::size_t r = 0; r < asked.size(); ++r) {
        if (hits[r].valid()) {
          left.push_back(asked[r]);
        } else {
          visible[asked[r]] = 1;
        }
      }
      pending.swap(left);
      if (pending.empty()) break;
    }
  }
  return visible;
}

}  // namespace arex::sim
