#include "mapping/frame_rays.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace arex {
namespace {

/// How many returns of a frame lie in each small cube about the vehicle.
class NearReturns {
 public:
  NearReturns(const Vec3& centre, double range_m)
      : low_(centre.array() - range_m - kEdge_m),  // a cube of margin on each side
        size_(static_cast<int>(std::ceil(2 * range_m / kEdge_m)) + 2),
        counts_(static_cast<std::size_t>(size_) * static_cast<std::size_t>(size_ * size_)) {}

  /// @pre `p` is within the range.
  void add(const Vec3& p) {
    std::uint8_t& count = counts_[index(cell(p))];
    count = static_cast<std::uint8_t>(std::min(count + 1, 2));
  }
  /// Whether p, which was added, is the only one in its cube and the 26 around it.
  [[nodiscard]] bool is_lone(const Vec3& p) const {
    const Eigen::Vector3i centre = cell(p);
    int sum = 0;
    for (int z = -1; z <= 1; ++z) {
      for (int y = -1; y <= 1; ++y) {
        for (int x = -1; x <= 1; ++x) sum += counts_[index(centre + Eigen::Vector3i(x, y, z))];
      }
    }
    return sum <= 1;
  }

 private:
  static constexpr double kEdge_m = 0.2;
  [[nodiscard]] Eigen::Vector3i cell(const Vec3& p) const {
    return ((p - low_) / kEdge_m).array().floor().cast<int>().max(1).min(size_ - 2);
  }
  [[nodiscard]] std::size_t index(const Eigen::Vector3i& c) const {
    return static_cast<std::size_t>((c.z() * size_ + c.y()) * size_ + c.x());
  }

  Vec3 low_;
  int size_;
  std::vector<std::uint8_t> counts_;
};

}  // namespace

void cast_frame(const RegisteredScan& scan, double range_m, const VehicleConfig& vehicle,
                const CellBox& clip, RayCaster& rays, double lone_range_m) {
  rays.begin(scan.origin_end_O, clip);
  const double range2 = range_m * range_m;
  const double body2 = vehicle.own_returns_m() * vehicle.own_returns_m();
  const double lone2 = lone_range_m * lone_range_m;
  const Vec3 p_LB_O = scan.p_OB - scan.origin_end_O;
  // From B, both when the point was fired.
  const auto distance2_of = [&](const Vec3& ray) { return (ray - p_LB_O).squaredNorm(); };
  NearReturns near(p_LB_O, lone_range_m);
  for (std::size_t i = 0; lone2 > body2 && i < scan.size(); ++i) {
    const Vec3 ray = (*scan.points_O)[i].cast<double>() - scan.origin_of(i);
    const double from_body2 = distance2_of(ray);
    if (from_body2 >= body2 && from_body2 < lone2) near.add(ray);
  }
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const Vec3 origin = scan.origin_of(i);
    const Vec3 point = (*scan.points_O)[i].cast<double>();
    const Vec3 ray = point - origin;
    const double from_body2 = distance2_of(ray);
    if (!(from_body2 >= body2)) continue;
    if (from_body2 < lone2 && near.is_lone(ray)) continue;
    const double distance2 = ray.squaredNorm();
    if (distance2 <= range2) {
      rays.add(origin, point, true);
    } else {
      rays.add(origin, origin + range_m / std::sqrt(distance2) * ray, false);
    }
  }
  rays.finish();
}

void cast_frame(const RegisteredDepth& depth, const LocalGridConfig& config,
                const VehicleConfig& vehicle, const CellBox& clip, RayCaster& rays) {
  const PinholeCamera& camera = depth.image->camera;
  const Vec3 origin = depth.X_OC.p;
  rays.begin(origin, clip);
  const double body2 = vehicle.own_returns_m() * vehicle.own_returns_m();
  const Vec3 p_OB = depth.X_OC * vehicle.X_BC().inverse().p;
  for (int v = 0; v < camera.height; v += config.depth_hit_stride_px) {
    for (int u = 0; u < camera.width; u += config.depth_hit_stride_px) {
      const double z = depth.image->at(u, v);
      if (!(z >= config.depth_min_m)) continue;
      const bool hit = z <= config.depth_max_m;
      const bool ray = u % config.depth_ray_stride_px == 0 && v % config.depth_ray_stride_px == 0;
      if (!hit && !ray) continue;
      const Vec3 point = depth.X_OC * camera.unproject(u, v, hit ? z : config.depth_max_m);
      if ((point - p_OB).squaredNorm() < body2) continue;
      if (ray) {
        rays.add(origin, point, hit);
      } else {
        rays.add_point(point);
      }
    }
  }
  rays.finish();
}

}  // namespace arex
