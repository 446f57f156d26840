#include "mapping/frame_rays.h"

namespace arex {

void cast_frame(const RegisteredScan& scan, double range_m, const VehicleConfig& vehicle,
                const CellBox& clip, RayCaster& rays) {
  rays.begin(scan.origin_end_O, clip);
  const double range2 = range_m * range_m;
  const double body2 = vehicle.own_returns_m * vehicle.own_returns_m;
  const Vec3 p_LB_O = scan.p_OB - scan.origin_end_O;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const Vec3 origin = scan.origin_of(i);
    const Vec3 point = (*scan.points_O)[i].cast<double>();
    const Vec3 ray = point - origin;
    if (!((ray - p_LB_O).squaredNorm() >= body2)) continue;
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
  const double body2 = vehicle.own_returns_m * vehicle.own_returns_m;
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
