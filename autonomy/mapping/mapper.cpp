#include "mapping/mapper.h"

#include "mapping/map_files.h"

namespace arex {

Mapper::Mapper(const LocalGridConfig& local, const GlobalMapConfig& global, double resolution_m,
               double inflation_m, const VehicleConfig& vehicle)
    : config_(local),
      vehicle_(vehicle),
      range_m_(global.range_m),
      rays_(resolution_m),
      local_(local, inflation_m, resolution_m),
      global_(global, resolution_m) {}

void Mapper::integrate(const RegisteredScan& scan) {
  local_.recentre(scan.p_OB);
  const CellBox local = local_.box();
  const CellBox& global = global_.box();
  cast_frame(scan, range_m_, vehicle_,
             {local.low.cwiseMin(global.low), local.high.cwiseMax(global.high)}, rays_);
  local_.add_frame(rays_, LocalGrid::FrameKind::kLidar, scan.stamp);
  global_.add_frame(rays_);
}

void Mapper::integrate(const RegisteredDepth& depth) {
  if (!config_.use_depth || !depth.image) return;
  cast_frame(depth, config_, vehicle_, local_.box(), rays_);
  local_.add_frame(rays_, LocalGrid::FrameKind::kDepth, depth.image->stamp);
}

bool Mapper::write(const std::filesystem::path& folder) const {
  const bool tree = global_.write_octomap(folder / "map.bt");
  return write_map_2d(global_.occupancy_2d(), folder, "map2d") && tree;
}

}  // namespace arex
