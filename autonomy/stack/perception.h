#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <utility>

#include "jobs/job_queue.h"
#include "mapping/flown_trail.h"
#include "mapping/mapper.h"
#include "mapping/point_cloud_map.h"
#include "messages/registered_scan.h"
#include "odometry/pose_history.h"
#include "odometry/scan_placement.h"
#include "stack/stack_config.h"

namespace arex {

/// From measurements to maps: places LiDAR and depth frames in O by the odometry's poses, feeds the
/// maps in their lanes and hands on snapshots.
class Perception {
 public:
  Perception(const StackConfig& config, JobQueue& jobs);

  /// Every estimate, in order: depth frames are placed by the poses around their stamp.
  void add_odometry(const Odometry& odometry);
  /// After a jump of the pose: what the local grid holds lies elsewhere, and the poses before say
  /// nothing of the time after.
  /// @param jumped_at what was measured before that is not mapped any more
  void forget_local(Stamp now, Stamp jumped_at);
  /// Where the vehicle goes under the planner: the 2D map keeps that way open.
  void note_flown(const Vec3& p_OB) { trail_.add(p_OB); }
  void add_scan(Stamp now, const RegisteredScan& scan);
  /// A frame of a further LiDAR: placed by the poses of the odometry that flies.
  void add_scan(Stamp now, const LidarScan& scan);
  void add_depth(Stamp now, const DepthImagePtr& depth);

  /// The newest local grid; null before the first frame.
  [[nodiscard]] const std::shared_ptr<const GridSnapshot>& grid() const { return grid_; }
  /// The newest frames that went into it.
  [[nodiscard]] MappedFrames frames() const;
  /// The newest 2D map; null before the first.
  [[nodiscard]] const std::shared_ptr<const OccupancyMap2D>& map_2d() const { return map_2d_; }

  /// Cells flown through since map_2d() was made. @pre there is one
  [[nodiscard]] std::vector<std::uint32_t> flown_since_map() const {
    const auto known = static_cast<std::ptrdiff_t>(flown_in_map_);
    return {trail_.cells().begin() + known, trail_.cells().end()};
  }

  /// Volume that the map knew when map_2d() was taken.
  [[nodiscard]] double known_volume_m3() const { return known_volume_m3_; }

  /// Whether the cloud has begun to leave out what it has no room for; true once.
  bool take_cloud_cut() { return std::exchange(cloud_cut_, false); }

  // What follows belongs to its lane: read it in a job of that lane, or when the jobs are drained.
  [[nodiscard]] const Mapper& mapper() const { return mapper_; }
  [[nodiscard]] const PointCloudMap& cloud() const { return cloud_; }
  [[nodiscard]] JobQueue::Lane cloud_lane() const { return cloud_lane_; }

 private:
  void add_globally(const std::shared_ptr<const RayCaster>& rays, bool with_map_2d, Stamp stamp,
                    const Vec3& p_OB);
  /// Gives the map the cells flown through, as far as they lie over the floor that it shows.
  void add_flown(OccupancyMap2D& map);

  MappingConfig config_;
  VehicleConfig vehicle_;
  JobQueue& jobs_;
  Mapper mapper_;
  FlownTrail trail_;
  PointCloudMap cloud_;
  JobQueue::Lane mapping_lane_;  ///< the mapper's local grid
  JobQueue::Lane global_map_lane_;
  JobQueue::Lane cloud_lane_;
  PoseHistory poses_;
  bool trusted_ = true;  ///< the odometry was not lost, or it is ok again
  int jumps_ = 0;        ///< grids of before the last are not handed on
  Stamp jumped_at_ = 0;
  Stamp next_map_2d_ = 0;
  std::shared_ptr<const GridSnapshot> grid_;
  std::deque<RegisteredScan> scans_;  ///< the newest, which share their points
  std::optional<RegisteredDepth> depth_;
  std::shared_ptr<const OccupancyMap2D> map_2d_;
  std::size_t flown_in_map_ = 0;  ///< cells of the trail that were there when map_2d_ was made
  double known_volume_m3_ = 0;
  bool refusal_told_ = false;  ///< in jobs of the cloud's lane
  bool cloud_cut_ = false;
};

}  // namespace arex
