#include "stack/perception.h"

#include <algorithm>
#include <iterator>
#include <vector>

namespace arex {
namespace {

// Where nobody asks for its picture, the host's threads have until the next frame or so.
constexpr Stamp kGlobalMapDue = kNanosecondsPerSecond / 5;
// Nobody in the loop waits for the cloud: its host threads may work at it when they have nothing
// more urgent.
constexpr Stamp kCloudDue = kNanosecondsPerSecond;
// Frames whose grid is still being made.
constexpr std::size_t kUnderWay = 2;
/// Less than the height of a storey with its slab, more than what is flown over a floor.
constexpr double kStorey_m = 3.5;

}  // namespace

Perception::Perception(const StackConfig& config, JobQueue& jobs)
    : config_(config.mapping),
      vehicle_(config.vehicle),
      jobs_(jobs),
      mapper_(config.mapping.local, config.mapping.global, config.mapping.resolution_m,
              config.planning.inflation_m, config.vehicle),
      trail_(map_geometry(mapper_.global().box(), config.mapping.resolution_m)),
      cloud_(config.mapping.cloud),
      mapping_lane_(jobs.add_lane("mapping")),
      global_map_lane_(jobs.add_lane("global_map")),
      cloud_lane_(jobs.add_lane("cloud")) {
  mapper_.bar_outside(config.planning.floor_m, config.planning.ceiling_m);
}

void Perception::add_odometry(const Odometry& odometry) {
  if (odometry.status == OdometryStatus::kLost) trusted_ = false;
  if (odometry.status == OdometryStatus::kOk) trusted_ = true;
  poses_.add(odometry);
}

void Perception::forget_local(Stamp now, Stamp jumped_at) {
  ++jumps_;
  jumped_at_ = jumped_at;
  grid_.reset();
  scans_.clear();
  depth_.reset();
  poses_.clear();
  jobs_.start(mapping_lane_, now, 0, [this]() -> JobQueue::Delivery {
    mapper_.forget_local();
    return nullptr;
  });
}

MappedFrames Perception::frames() const { return {{scans_.begin(), scans_.end()}, depth_}; }

void Perception::add_scan(Stamp now, const RegisteredScan& scan) {
  if (scan.size() == 0 || scan.begin < jumped_at_) return;
  jobs_.schedule(cloud_lane_, now + kCloudDue, [this, scan]() -> JobQueue::Delivery {
    const Vec3f p_OB = scan.p_OB.cast<float>();
    const auto range = static_cast<float>(config_.cloud_range_m);
    std::vector<Vec3f> near;
    near.reserve(scan.size());
    std::copy_if(scan.points_O->begin(), scan.points_O->end(), std::back_inserter(near),
                 [&](const Vec3f& p) { return (p - p_OB).norm() <= range; });
    cloud_.insert(near);
    if (cloud_.refused() == 0 || std::exchange(refusal_told_, true)) return nullptr;
    return [this] { cloud_cut_ = true; };
  });
  if (!config_.enabled) return;
  scans_.push_back(scan);
  if (scans_.size() > static_cast<std::size_t>(config_.local.lidar_frames) + kUnderWay) {
    scans_.pop_front();
  }
  const bool with_map_2d = now >= next_map_2d_;
  if (with_map_2d) next_map_2d_ = now + from_seconds(1 / config_.map_2d_rate_hz);
  // The local grid has to be there in time; the global map follows in its own lane.
  jobs_.start(mapping_lane_, now, from_seconds(config_.latency_s),
              [this, scan, with_map_2d, jumps = jumps_]() -> JobQueue::Delivery {
                return [this, rays = mapper_.integrate_locally(scan), grid = mapper_.snapshot(),
                        with_map_2d, stamp = scan.stamp, p_OB = scan.p_OB, jumps] {
                  if (jumps == jumps_) grid_ = grid;
                  add_globally(rays, with_map_2d, stamp, p_OB);
                };
              });
}

void Perception::add_globally(const std::shared_ptr<const RayCaster>& rays, bool with_map_2d,
                              Stamp stamp, const Vec3& p_OB) {
  jobs_.schedule(global_map_lane_, with_map_2d ? stamp : stamp + kGlobalMapDue,
                 [this, rays, with_map_2d, p_OB]() -> JobQueue::Delivery {
                   mapper_.integrate_globally(*rays);
                   if (!with_map_2d) return nullptr;
                   mapper_.note_place(p_OB);
                   return [this, volume = mapper_.global().known_volume(),
                           map_2d = std::make_shared<OccupancyMap2D>(mapper_.occupancy_2d())] {
                     add_flown(*map_2d);
                     map_2d_ = map_2d;
                     known_volume_m3_ = volume;
                   };
                 });
}

void Perception::add_flown(OccupancyMap2D& map) {
  flown_in_map_ = trail_.cells().size();
  map.flown.reserve(flown_in_map_);
  map.flown_height_m.reserve(flown_in_map_);
  const auto width = static_cast<std::uint32_t>(map.width);
  for (std::size_t k = 0; k < flown_in_map_; ++k) {
    const std::uint32_t cell = trail_.cells()[k];
    const float height = trail_.heights_m()[k];
    if (config_.global.band == BandReference::kFloor) {
      const Vec2 p =
          map.centre_of({static_cast<int>(cell % width), static_cast<int>(cell / width)});
      const double above = height - map.ground.at(p);
      if (above < 0 || above > kStorey_m) continue;  // over another storey's floor
    }
    map.flown.push_back(cell);
    map.flown_height_m.push_back(height);
  }
}

void Perception::add_scan(Stamp now, const LidarScan& scan) {
  if (poses_.empty() || !trusted_ || scan.points.empty()) return;
  add_scan(now, place_scan(scan, poses_, vehicle_.X_BL(scan.device)));
}

void Perception::add_depth(Stamp now, const DepthImagePtr& depth) {
  if (!config_.enabled || poses_.empty() || !trusted_) return;
  if (depth->stamp < jumped_at_) return;
  const RegisteredDepth frame{poses_.at(depth->stamp) * vehicle_.X_BC(depth->device), depth};
  depth_ = frame;
  jobs_.start(mapping_lane_, now, from_seconds(config_.latency_s),
              [this, frame, jumps = jumps_]() -> JobQueue::Delivery {
                mapper_.integrate(frame);
                return [this, grid = mapper_.snapshot(), jumps] {
                  if (jumps == jumps_) grid_ = grid;
                };
              });
}

}  // namespace arex
