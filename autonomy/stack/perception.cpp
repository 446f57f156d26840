#include "stack/perception.h"

#include <algorithm>
#include <iterator>

namespace arex {
namespace {

// Long enough for a LiDAR frame and every device's latency.
constexpr Stamp kPosesKept = kNanosecondsPerSecond;
// Where nobody asks for its picture, the host's threads have until the next frame or so.
constexpr Stamp kGlobalMapDue = kNanosecondsPerSecond / 5;
// Nobody in the loop waits for the cloud: its host threads may work at it when they have nothing
// more urgent.
constexpr Stamp kCloudDue = kNanosecondsPerSecond;

}  // namespace

Perception::Perception(const StackConfig& config, JobQueue& jobs)
    : config_(config.mapping),
      X_BL_(config.vehicle.X_BL()),
      X_BC_(config.vehicle.X_BC()),
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
  if (odometry.status == OdometryStatus::kInitialising) return;
  if (odometry.status == OdometryStatus::kLost) trusted_ = false;
  if (odometry.status == OdometryStatus::kOk) trusted_ = true;
  if (!poses_.empty() && poses_.back().stamp >= odometry.stamp) {
    poses_.back().X_OB = odometry.X_OB;  // the same moment, corrected
    return;
  }
  poses_.push_back({odometry.stamp, odometry.X_OB});
  while (poses_.back().stamp - poses_.front().stamp > kPosesKept) poses_.pop_front();
}

void Perception::forget_local(Stamp now) {
  ++jumps_;
  grid_.reset();
  poses_.clear();
  jobs_.start(mapping_lane_, now, 0, [this]() -> JobQueue::Delivery {
    mapper_.forget_local();
    return nullptr;
  });
}

Pose Perception::pose_at(Stamp stamp) const {
  const auto after =
      std::lower_bound(poses_.begin(), poses_.end(), stamp,
                       [](const StampedPose& pose, Stamp s) { return pose.stamp < s; });
  if (after == poses_.begin()) return poses_.front().X_OB;
  if (after == poses_.end()) return poses_.back().X_OB;
  const StampedPose& before = *std::prev(after);
  return interpolate(
      before.X_OB, after->X_OB,
      static_cast<double>(stamp - before.stamp) / static_cast<double>(after->stamp - before.stamp));
}

void Perception::add_scan(Stamp now, const ScanUpdate& update) {
  // The frame of a recovery began at a pose that nobody knows.
  if (!update.points_O || update.points_O->empty() || poses_.empty() || update.recovered) return;
  RegisteredScan scan;
  scan.stamp = update.stamp;
  scan.p_OB = update.state.p_OB;
  scan.origin_end_O = (update.state.X_OB() * X_BL_).p;
  scan.origin_begin_O = (pose_at(update.begin) * X_BL_).p;
  scan.points_O = update.points_O;
  scan.fractions = update.fractions;
  add(now, scan);
}

void Perception::add_scan(Stamp now, const LidarScanPtr& raw) {
  if (poses_.empty() || raw->points.empty()) return;
  RegisteredScan scan;
  scan.stamp = raw->end;
  scan.p_OB = pose_at(raw->end).p;
  scan.origin_end_O = (pose_at(raw->end) * X_BL_).p;
  scan.origin_begin_O = (pose_at(raw->stamp) * X_BL_).p;
  auto points = std::make_shared<std::vector<Vec3f>>();
  auto fractions = std::make_shared<std::vector<float>>();
  points->reserve(raw->points.size());
  fractions->reserve(raw->points.size());
  // One pose a millisecond: at 3 rad/s and 20 m that is 3 cm at most, a third of a cell.
  std::int64_t millisecond = -1;
  Pose X_OL;
  for (const LidarPoint& point : raw->points) {
    if (point.offset_ns / kNanosecondsPerTick != millisecond) {
      millisecond = point.offset_ns / kNanosecondsPerTick;
      X_OL = pose_at(raw->stamp + point.offset_ns) * X_BL_;
    }
    points->push_back((X_OL * point.p_L.cast<double>()).cast<float>());
    fractions->push_back(raw->fraction_of(point));
  }
  scan.points_O = points;
  scan.fractions = fractions;
  add(now, scan);
}

void Perception::add(Stamp now, const RegisteredScan& scan) {
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
  const bool with_map_2d = now >= next_map_2d_;
  if (with_map_2d) next_map_2d_ = now + from_seconds(1 / config_.map_2d_rate_hz);
  // The local grid has to be there in time; the global map follows in its own lane.
  jobs_.start(mapping_lane_, now, from_seconds(config_.latency_s),
              [this, scan, with_map_2d, jumps = jumps_]() -> JobQueue::Delivery {
                return [this, rays = mapper_.integrate_locally(scan), grid = mapper_.snapshot(),
                        with_map_2d, stamp = scan.stamp, jumps] {
                  if (jumps == jumps_) grid_ = grid;
                  add_globally(rays, with_map_2d, stamp);
                };
              });
}

void Perception::add_globally(const std::shared_ptr<const RayCaster>& rays, bool with_map_2d,
                              Stamp stamp) {
  jobs_.schedule(global_map_lane_, with_map_2d ? stamp : stamp + kGlobalMapDue,
                 [this, rays, with_map_2d]() -> JobQueue::Delivery {
                   mapper_.integrate_globally(*rays);
                   if (!with_map_2d) return nullptr;
                   return [this, volume = mapper_.global().known_volume(),
                           map_2d = std::make_shared<OccupancyMap2D>(mapper_.occupancy_2d())] {
                     map_2d->flown = trail_.cells();
                     map_2d->flown_height_m = trail_.heights_m();
                     map_2d_ = map_2d;
                     known_volume_m3_ = volume;
                   };
                 });
}

void Perception::add_depth(Stamp now, const DepthImagePtr& depth) {
  if (!config_.enabled || poses_.empty() || !trusted_) return;
  if (jumps_ > 0 && depth->stamp < poses_.front().stamp) return;  // of before the jump
  const RegisteredDepth frame{pose_at(depth->stamp) * X_BC_, depth};
  jobs_.start(mapping_lane_, now, from_seconds(config_.latency_s),
              [this, frame, jumps = jumps_]() -> JobQueue::Delivery {
                mapper_.integrate(frame);
                return [this, grid = mapper_.snapshot(), jumps] {
                  if (jumps == jumps_) grid_ = grid;
                };
              });
}

}  // namespace arex
