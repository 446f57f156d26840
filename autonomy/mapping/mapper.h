#pragma once

#include <filesystem>
#include <memory>

#include "mapping/buffer_pool.h"
#include "mapping/frame_rays.h"
#include "mapping/global_map.h"
#include "mapping/local_grid.h"

namespace arex {

/// Both maps, fed by one ray casting per LiDAR frame. The local grid's calls belong to one job
/// lane, the global map's to one (it may be another); snapshots may be read from anywhere.
class Mapper {
 public:
  Mapper(const LocalGridConfig& local, const GlobalMapConfig& global, double resolution_m,
         double inflation_m, const VehicleConfig& vehicle);

  /// Takes a LiDAR frame into the local grid. @return its rays, for the global map
  [[nodiscard]] std::shared_ptr<const RayCaster> integrate_locally(const RegisteredScan& scan);
  /// The rest of the frame. It may run beside the local grid's next frames, on one thread at a time
  /// and frame by frame.
  void integrate_globally(const RayCaster& rays) { global_.add_frame(rays); }
  /// Where the vehicle was when the frame was taken (GlobalMap); in the global map's lane.
  void note_place(const Vec3& p_OB) { global_.note_place(p_OB); }
  /// Both.
  void integrate(const RegisteredScan& scan) { integrate_globally(*integrate_locally(scan)); }
  /// Into the local grid only; without `use_depth` nothing.
  void integrate(const RegisteredDepth& depth);
  /// The heights in O between which is flown, m.
  void bar_outside(double floor_m, double ceiling_m) { local_.bar_outside(floor_m, ceiling_m); }
  /// After a jump of the pose: the local grid starts anew.
  void forget_local() { local_.clear(); }

  [[nodiscard]] std::shared_ptr<const GridSnapshot> snapshot() { return local_.snapshot(); }
  [[nodiscard]] const GlobalMap& global() const { return global_; }
  [[nodiscard]] const OccupancyMap2D& occupancy_2d() const { return global_.occupancy_2d(); }

 private:
  [[nodiscard]] std::shared_ptr<RayCaster> free_rays();

  LocalGridConfig config_;
  VehicleConfig vehicle_;
  double resolution_m_;
  double range_m_;
  BufferPool<RayCaster> rays_;
  LocalGrid local_;
  GlobalMap global_;
};

}  // namespace arex
