#include "mapping/mapper.h"

#include "mapping/map_files.h"

namespace arex {

Mapper::Mapper(const LocalGridConfig& local, const GlobalMapConfig& global, double resolution_m,
               double inflation_m, const VehicleConfig& vehicle)
    : config_(local),
      vehicle_(vehicle),
      resolution_m_(resolution_m),
      range_m_(global.range_m),
      local_(local, inflation_m, resolution_m),
      global_(global, resolution_m) {}

std::shared_ptr<RayCaster> Mapper::free_rays() {
  return rays_.take([this] { return std::make_unique<RayCaster>(resolution_m_); });
}

std::shared_ptr<const RayCaster> Mapper::integrate_locally(const RegisteredScan& scan) {
  local_.recentre(scan.p_OB);
  const CellBox local = local_.box();
  const CellBox& global = global_.box();
  const std::shared_ptr<RayCaster> rays = free_rays();
  cast_frame(scan, range_m_, vehicle_,
             {local.low.cwiseMin(global.low), local.high.cwiseMax(global.high)}, *rays,
             config_.lone_range_m);
  local_.add_frame(*rays, LocalGrid::FrameKind::kLidar, scan.stamp);
  return rays;
}

void Mapper::integrate(const RegisteredDepth& depth) {
  if (!config_.use_depth || !depth.image) return;
  const std::shared_ptr<RayCaster> rays = free_rays();
  cast_frame(depth, config_, vehicle_, local_.box(), *rays);
  local_.add_frame(*rays, LocalGrid::FrameKind::kDepth, depth.image->stamp);
}

}  // namespace arex
