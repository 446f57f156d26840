#pragma once

#include <filesystem>
#include <memory>

#include "mapping/frame_rays.h"
#include "mapping/global_map.h"
#include "mapping/local_grid.h"

namespace arex {

/// Both maps, fed by one ray casting per LiDAR frame. Used from one job lane, never concurrently;
/// snapshots may be read from anywhere.
class Mapper {
 public:
  Mapper(const LocalGridConfig& local, const GlobalMapConfig& global, double resolution_m,
         double inflation_m, const VehicleConfig& vehicle);

  void integrate(const RegisteredScan& scan);
  /// Into the local grid only; without `use_depth` nothing.
  void integrate(const RegisteredDepth& depth);
  /// After a jump of the pose: the local grid starts anew.
  void forget_local() { local_.clear(); }

  [[nodiscard]] std::shared_ptr<const GridSnapshot> snapshot() { return local_.snapshot(); }
  [[nodiscard]] const GlobalMap& global() const { return global_; }
  [[nodiscard]] const OccupancyMap2D& occupancy_2d() const { return global_.occupancy_2d(); }
  /// map.bt, map2d.pgm and map2d.yaml. @return whether all could be written.
  [[nodiscard]] bool write(const std::filesystem::path& folder) const;

 private:
  LocalGridConfig config_;
  VehicleConfig vehicle_;
  double range_m_;
  RayCaster rays_;
  LocalGrid local_;
  GlobalMap global_;
};

}  // namespace arex
