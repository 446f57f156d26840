// The maps on 50 scans of the MID-360 flying 1.5 m/s through the default forest, beside OctoMap's
// insertPointCloud on the same scans: same volume, sensor model, range and origins. CPU time of
// this thread. The mapped box holds everything within range, so that neither side is spared a ray.
#include <octomap/OcTree.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <vector>

#include "mapping/mapper.h"
#include "physics/airframe.h"
#include "sensors/mid360.h"
#include "worlds/forest.h"

namespace {

using namespace arex;
using namespace arex::sim;

constexpr int kScans = 50;
constexpr int kPasses = 3;
constexpr int kPicturePeriod = 5;  // 2 Hz
constexpr double kResolution = 0.1;
constexpr double kRange = 20;

double cpu_ms() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

/// A circle of 4 m about a point beside the start, 1.5 m up, leaning 5 degrees; S is the O here.
Truth truth_at(const worlds::World& world, Stamp stamp) {
  Truth truth;
  truth.stamp = stamp;
  const double angle = 1.5 / 4 * to_seconds(stamp);
  truth.X_WB.p = world.X_WS * Vec3(4 * std::sin(angle), 4 - 4 * std::cos(angle), 1.5);
  truth.X_WB.R = world.X_WS.R * so3::from_yaw(angle) * so3::Exp({0.087, 0, 0});
  return truth;
}

/// Scans with every point placed by its own true pose, rays from the frame's middle: OctoMap takes
/// one origin.
std::vector<RegisteredScan> record() {
  const worlds::World world = worlds::build(worlds::ForestRecipe{}, 1);
  const Scene scene(world);
  const VehicleConfig vehicle;
  const Pose X_BL = vehicle.X_BL();
  const Mid360 lidar({}, scene, X_BL, load_airframe().shapes, 1);
  const Pose X_OW = world.X_WS.inverse();
  std::vector<RegisteredScan> scans;
  for (int k = 0; k < kScans; ++k) {
    std::vector<Truth> ticks;
    for (int i = 0; i <= 100; ++i) {
      ticks.push_back(truth_at(world, (k * 100 + i) * kNanosecondsPerTick));
    }
    const LidarScan raw = lidar.scan(ticks);
    auto points = std::make_shared<std::vector<Vec3f>>();
    for (const LidarPoint& point : raw.points) {
      if ((X_BL * point.p_L.cast<double>()).norm() < vehicle.radius_m) continue;
      const Pose X_WB = truth_at(world, raw.stamp + point.offset_ns).X_WB;
      points->push_back((X_OW * (X_WB * (X_BL * point.p_L.cast<double>()))).cast<float>());
    }
    RegisteredScan scan;
    scan.stamp = raw.end;
    const Pose X_OB = X_OW * ticks[50].X_WB;
    scan.p_OB = X_OB.p;
    scan.origin_begin_O = scan.origin_end_O = (X_OB * X_BL.p).cast<float>().cast<double>();
    scan.points_O = points;
    scans.push_back(std::move(scan));
  }
  return scans;
}

/// Times of one pipeline's parts over all scans.
struct Row {
  const char* name;
  std::vector<double> ms;

  void print() {
    std::sort(ms.begin(), ms.end());
    double sum = 0;
    for (const double t : ms) sum += t;
    std::printf("%-44s median %7.2f  p99 %7.2f  mean %7.2f ms\n", name, ms[ms.size() / 2],
                ms[ms.size() * 99 / 100], sum / static_cast<double>(ms.size()));
  }
};

class Clock {
 public:
  void lap(Row& row) {
    const double now = cpu_ms();
    row.ms.push_back(now - last_);
    last_ = now;
  }

 private:
  double last_ = cpu_ms();
};

GlobalMapConfig whole_volume() {
  GlobalMapConfig config;
  config.low_m = {-36, -36, -24};
  config.high_m = {36, 36, 24};
  config.range_m = kRange;
  return config;
}

void compare(const GlobalMap& map, const octomap::OcTree& oracle) {
  std::size_t theirs = 0, both = 0, same = 0;
  for (auto leaf = oracle.begin_leafs(); leaf != oracle.end_leafs(); ++leaf) {
    const octomap::OcTreeKey key = leaf.getIndexKey();  // the lowest voxel of a pruned cube
    const int cells = 1 << (16 - static_cast<int>(leaf.getDepth()));
    const int state = oracle.isNodeOccupied(*leaf) ? 1 : 0;
    for (int i = 0; i < cells * cells * cells; ++i) {
      const Cell cell(key[0] - 32768 + i % cells, key[1] - 32768 + i / cells % cells,
                      key[2] - 32768 + i / cells / cells);
      const int ours = map.state(cell);
      ++theirs;
      both += ours >= 0;
      same += ours == state;
    }
  }
  const auto ours = static_cast<std::size_t>(
      std::lround(map.known_volume() / (kResolution * kResolution * kResolution)));
  const std::size_t either = ours + theirs - both;
  std::printf("voxels known: OctoMap %zu, here %zu; of the %zu that either knows %.3f %% agree\n",
              theirs, ours, either,
              100.0 * static_cast<double>(same) / static_cast<double>(either));
}

}  // namespace

int main() {
  const std::vector<RegisteredScan> scans = record();
  std::size_t points = 0;
  for (const RegisteredScan& scan : scans) points += scan.size();
  std::printf("%d scans, %zu points each\n", kScans, points / kScans);
  VehicleConfig nobody;  // the scans are without the body already; OctoMap would not filter it
  nobody.radius_m = 1e-6;

  Row octo{"OctoMap insertPointCloud", {}};
  octomap::OcTree oracle(kResolution);
  for (const RegisteredScan& scan : scans) {
    octomap::Pointcloud cloud;
    for (const Vec3f& p : *scan.points_O) cloud.push_back(p.x(), p.y(), p.z());
    const Vec3f origin = scan.origin_end_O.cast<float>();
    Clock clock;
    oracle.insertPointCloud(cloud, {origin.x(), origin.y(), origin.z()}, kRange, false, false);
    clock.lap(octo);
  }

  Row cast{"ray casting, 20 m", {}}, global{"voxels and octree", {}}, whole{"global map", {}};
  Row local_cast{"ray casting, local box", {}}, update{"local grid's cells", {}};
  Row snapshot{"snapshot with inflation 0.5 m", {}},
      local{"local grid, from points to snapshot", {}};
  Row picture{"2D map, every fifth scan", {}};
  Row mapper_row{"Mapper: both, default bounds, one casting", {}};
  for (int pass = 0; pass < kPasses; ++pass) {
    RayCaster rays(kResolution);
    GlobalMap map(whole_volume(), kResolution);
    int frames = 0;
    for (const RegisteredScan& scan : scans) {
      Clock parts, all;
      cast_frame(scan, kRange, nobody, map.box(), rays);
      parts.lap(cast);
      map.add_frame(rays);
      parts.lap(global);
      all.lap(whole);
      if (++frames % kPicturePeriod != 0) continue;
      Clock made;
      (void)map.occupancy_2d();
      made.lap(picture);
    }
    LocalGrid grid({}, 0.5, kResolution);
    for (const RegisteredScan& scan : scans) {
      Clock parts, all;
      grid.recentre(scan.p_OB);
      cast_frame(scan, kRange, nobody, grid.box(), rays);
      parts.lap(local_cast);
      grid.add_frame(rays, LocalGrid::FrameKind::kLidar, scan.stamp);
      parts.lap(update);
      (void)grid.snapshot();
      parts.lap(snapshot);
      all.lap(local);
    }
    Mapper mapper({}, {}, kResolution, 0.5, nobody);
    for (const RegisteredScan& scan : scans) {
      Clock clock;
      mapper.integrate(scan);
      (void)mapper.snapshot();
      clock.lap(mapper_row);
    }
    if (pass == 0) compare(map, oracle);
  }
  for (Row* row : {&octo, &cast, &global, &whole, &picture, &local_cast, &update, &snapshot, &local,
                   &mapper_row}) {
    row->print();
  }
  const auto mean = [](const Row& row) {
    double sum = 0;
    for (const double t : row.ms) sum += t;
    return sum / static_cast<double>(row.ms.size());
  };
  std::printf("global map over OctoMap: %.1f times faster\n", mean(octo) / mean(whole));
  return 0;
}
