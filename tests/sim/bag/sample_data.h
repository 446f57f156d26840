#pragma once

#include "bag/bag_writer.h"

/// A second of made-up measurements. check_bag.py knows the same formulas; all values are exact in
/// binary, so that it can demand equality.
namespace arex::sim::test {

inline constexpr Stamp kImuPeriod = 5'000'000;
inline constexpr Stamp kScanPeriod = 100'000'000;
inline constexpr Stamp kDepthPeriod = 33'333'333;
inline constexpr int kImuSamples = 200;
inline constexpr int kScans = 10;
inline constexpr int kScanPoints = 20'000;
inline constexpr int kDepthImages = 3;

inline ImuSample imu_sample(int i) {
  return {i * kImuPeriod,
          {0.25 * i, -0.5 * i, 1.0 + i},
          {0.125, -0.0625 * i, 9.75 + i},
          {0.5, 0.25 * i, -0.125}};
}

/// Two packets of which the second is stamped 100 us before the first's end; every fifth firing
/// returned.
inline LidarScan scan_with_misses() {
  LidarScan scan{"", 0, kScanPeriod, {}, {1000, 381'000}};
  for (int k = 0; k < 192; k += 5) {
    LidarPoint point;
    point.p_L = {static_cast<float>(1 + k), 2, 3};
    point.intensity = 7;
    point.firing = static_cast<std::uint16_t>(k);
    point.offset_ns = scan.firing_ns(k);
    point.line = static_cast<std::uint8_t>(k % 4);
    point.tag = 5;
    scan.points.push_back(point);
  }
  return scan;
}

inline LidarScan lidar_scan(int i) {
  LidarScan scan{"", i * kScanPeriod, (i + 1) * kScanPeriod, {}};
  // Never the same number twice; the last frame saw nothing.
  const int count = i + 1 == kScans ? 0 : kScanPoints - i;
  for (int k = 0; k < count; ++k) {
    const auto f = static_cast<float>(k);
    scan.points.push_back({Vec3f(0.25F * f, static_cast<float>(-i), 0.5F - f),
                           static_cast<float>(k % 256), static_cast<std::uint32_t>(5000 * k),
                           static_cast<std::uint8_t>(k % 4), static_cast<std::uint8_t>(k % 17)});
  }
  return scan;
}

inline DepthImage depth_image(int i) {
  DepthImage image{"", i * kDepthPeriod, {8, 6, 4.5, 4.25, 3.5, 2.75}, {}};
  for (int k = 0; k < 48; ++k) image.depth_m.push_back(k % 5 == i ? 0.0F : 0.125F * float(k + i));
  return image;
}

/// Yawed by 90 degrees: forward in B is y in O.
inline Pose true_pose(int i) {
  Pose X_OB;
  X_OB.R << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  X_OB.p = {0.5 * i, -0.25 * i, 1.5};
  return X_OB;
}

/// One message of each kind of what viewers show.
inline void write_display(DisplayWriter& display, Stamp now) {
  OccupancyMap2D map;
  map.origin = {-1, -2};
  map.resolution = 0.5;
  map.width = 3;
  map.height = 2;
  map.cells = {-1, 0, 1, 0, 1, -1};
  display.map(now, map);
  const std::vector<Vec3f> cloud{{0.25F, 0, 1}, {0.5F, -1, 1}, {0.75F, -2, 1}};
  display.cloud(now, cloud);
  // Of 2 x 2 x 2 cells the second and the last; y runs fastest, then x.
  const std::vector<std::uint8_t> cells{0,
                                        GridView::kOccupied | GridView::kKnown,
                                        0,
                                        0,
                                        0,
                                        0,
                                        GridView::kInflated,
                                        GridView::kBlocked};
  display.grid(now, {cells.data(), {1, 2, 3}, 0.5, {2, 2, 2}});
  const std::vector<PathPose> path{{0, true_pose(0)}, {now, true_pose(1)}};
  display.path(now, path);
  const std::vector<Vec3> plan{{1, 2, 3}, {1.5, 2, 3}};
  display.plan(now, plan);
  const std::vector<Vec3> reached{{4, 5, 6}};
  display.targets(now, reached, &plan.back());
  Decision decision;
  decision.stamp = now;
  decision.kind = DecisionKind::kNewTarget;
  decision.target = {2, 3};
  decision.candidates.resize(3);
  for (std::size_t i = 0; i < 3; ++i) {
    Candidate& c = decision.candidates[i];
    const auto k = static_cast<double>(i);
    c.point = {2 * k, i == 0 ? 1 : 3};
    c.viewpoint = {2 * k, 2};
    c.verdict = i == 0 ? Verdict::kNearObstacle : Verdict::kKept;
    c.information_m2 = 12.25;
    c.distance_m = 4.5;
    c.direction = 0.5;
    c.revenue = 6.25 - 2.5 * k;
  }
  decision.winner = 1;
  display.decision(decision, 1.5);
  const std::vector<Marker> solids{{"vehicle",
                                    0,
                                    Marker::Shape::kCylinder,
                                    {Mat3::Identity(), {0.25, 0, -0.5}},
                                    {0.5, 0.5, 0.125},
                                    {0.5F, 0.25F, 0.75F, 1}}};
  display.vehicle(now, solids);
  display.event({now, EventKind::kStuck, "no_path"});
}

inline void write_samples(BagWriter& bag) {
  bag.place_odom(Pose(), true);
  for (int i = 0; i < kImuSamples; ++i) {
    const Stamp now = i * kImuPeriod;
    bag.begin(now);
    bag.imu(imu_sample(i));
    bag.truth(now, true_pose(i), {1.0 * i, 2.0, -0.5}, {0.5, 0.25 * i, -3});
    bag.estimate(now, true_pose(i));
    // A scan arrives late, as from a driver: the recording is not in order of time.
    if (now % kScanPeriod == kImuPeriod && now > kScanPeriod) {
      bag.scan(lidar_scan(static_cast<int>(now / kScanPeriod) - 1));
    }
    if (i < kDepthImages) bag.depth(depth_image(i));
  }
  bag.scan(lidar_scan(kScans - 1));
  write_display(bag.display(), (kImuSamples - 1) * kImuPeriod);
}

}  // namespace arex::sim::test
