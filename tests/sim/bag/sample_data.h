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
  return {i * kImuPeriod, {0.25 * i, -0.5 * i, 1.0 + i}, {0.125, -0.0625 * i, 9.75 + i}};
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
}

}  // namespace arex::sim::test
