// LiDAR-inertial odometry without anything around it: a sensor that stands in a room and then
// slides a metre to the side. Feed it your own samples in the same way.
//
//     build/autonomy/examples/02_odometry_alone

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>

#include "math/random.h"
#include "odometry/lidar_inertial_odometry.h"

namespace {

using namespace arex;

constexpr Stamp kImuPeriod = kNanosecondsPerSecond / 200;
constexpr Stamp kFrame = kNanosecondsPerSecond / 10;

/// Where it is: at rest for two seconds, then a metre along y within two more, jerk-free.
double y_at(double t) {
  const double s = std::clamp((t - 2) / 2, 0.0, 1.0);
  return s * s * s * (10 + s * (6 * s - 15));
}

/// From a point in a room of 8 m x 6 m x 3 m along a direction to the wall.
double range(const Vec3& p, const Vec3& direction) {
  const Vec3 low(-3, -3, -1), high(5, 3, 2);
  double nearest = 1e9;
  for (int axis = 0; axis < 3; ++axis) {
    if (direction[axis] == 0) continue;
    const double wall = direction[axis] > 0 ? high[axis] : low[axis];
    nearest = std::min(nearest, (wall - p[axis]) / direction[axis]);
  }
  return nearest;
}

LidarScanPtr scan_at(Stamp begin, RandomStream& random) {
  auto scan = std::make_shared<LidarScan>();
  scan->stamp = begin;
  scan->end = begin + kFrame;
  for (std::uint32_t i = 0; i < 4000; ++i) {
    LidarPoint point;
    point.offset_ns = i * 25'000;
    const Vec3 p_OL(0, y_at(to_seconds(begin + point.offset_ns)), 0);
    const double azimuth = random.uniform(-3.14159, 3.14159), elevation = random.uniform(-0.1, 0.9);
    const Vec3 direction(std::cos(elevation) * std::cos(azimuth),
                         std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
    point.p_L = ((range(p_OL, direction) + 0.01 * random.normal()) * direction).cast<float>();
    scan->points.push_back(point);
  }
  return scan;
}

ImuSample imu_at(Stamp stamp) {
  constexpr double kStep = 1e-3;
  const double t = to_seconds(stamp);
  const double a = (y_at(t + kStep) - 2 * y_at(t) + y_at(t - kStep)) / (kStep * kStep);
  return {stamp, Vec3::Zero(), Vec3(0, a, kGravity)};
}

}  // namespace

int main() {
  LidarInertialConfig config;
  config.imu.delay_s = 0;  // these readings are of the moment that they are stamped with
  LidarInertialOdometry odometry(config, Pose(), 0.3);
  RandomStream random(1, "scans");
  for (Stamp now = 0; now <= 5 * kNanosecondsPerSecond; now += kImuPeriod) {
    odometry.add_imu(imu_at(now));
    if (now % kFrame == 0 && now > 0) odometry.add_scan(scan_at(now - kFrame, random));
    if (now % (kNanosecondsPerSecond / 2) != 0) continue;
    const Odometry& estimate = odometry.odometry();
    std::printf("%.1f s  %-12s  y %.3f m, true %.3f m\n", to_seconds(now),
                kOdometryStatusNames[static_cast<std::size_t>(estimate.status)].data(),
                estimate.X_OB.p.y(), y_at(to_seconds(now)));
  }
  const bool found = odometry.odometry().status == OdometryStatus::kOk &&
                     std::abs(odometry.odometry().X_OB.p.y() - 1) < 0.03;
  return found ? 0 : 1;
}
