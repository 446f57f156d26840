#include "stack/perception.h"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "math/so3.h"

namespace arex {
namespace {

constexpr Stamp kMillisecond = kNanosecondsPerTick;
constexpr Stamp kFrame = 100 * kMillisecond;
const Vec3 kAirO(0, 0, 1.5);  // where the vehicle is

/// Points of an upright wall 2 m wide and 1 m high across the x axis, in whatever frame.
std::vector<Vec3f> wall(float x) {
  std::vector<Vec3f> points;
  for (float y = -0.975F; y < 1; y += 0.05F) {
    for (float z = 1.025F; z < 2; z += 0.05F) points.emplace_back(x, y, z);
  }
  return points;
}

RegisteredScan scan_of(std::vector<Vec3f> points_O, Stamp end) {
  RegisteredScan scan;
  scan.begin = end - kFrame;
  scan.stamp = end;
  scan.origin_begin_O = scan.origin_end_O = scan.p_OB = kAirO;
  scan.points_O = std::make_shared<const std::vector<Vec3f>>(std::move(points_O));
  return scan;
}

StackConfig defaults() {
  StackConfig config;
  config.mapping.local.remember = false;  // one frame is enough
  config.mapping.local.lone_range_m = 0;
  return config;
}

/// The maps of a vehicle whose estimates come every 5 ms from 5 ms on.
struct Maps {
  explicit Maps(const StackConfig& config = defaults()) : perception(config, jobs) {}

  /// @param speed_mps along x, from kAirO at 0 s
  void estimate(Stamp until, double speed_mps = 0, OdometryStatus status = OdometryStatus::kOk) {
    for (; known < until; known += 5 * kMillisecond) {
      Odometry odometry;
      odometry.stamp = known + 5 * kMillisecond;
      odometry.status = status;
      odometry.X_OB.p = kAirO + speed_mps * to_seconds(odometry.stamp) * Vec3::UnitX();
      perception.add_odometry(odometry);
    }
  }
  /// A frame of the LiDAR that hits a wall at `x` of L's own, all at half of the frame's time.
  void see_from_lidar(Stamp end, float x) {
    LidarScan scan;
    scan.stamp = end - kFrame;
    scan.end = end;
    const Pose X_LB = StackConfig().vehicle.X_BL("").inverse();
    for (const Vec3f& p : wall(x)) {
      LidarPoint point;
      point.p_L = (X_LB * (p.cast<double>() - kAirO)).cast<float>();
      point.offset_ns = kFrame / 2;
      scan.points.push_back(point);
    }
    perception.add_scan(end, scan);
  }
  [[nodiscard]] bool occupied(const Vec3& p_O) const {
    const auto& grid = perception.grid();
    return grid && (grid->view.at(p_O) & GridView::kOccupied) != 0;
  }

  JobQueue jobs{1};
  Perception perception;
  Stamp known = 0;
};

TEST(Perception, AScanIsInTheGridWhenItsLatencyIsOver) {
  Maps maps;
  maps.perception.add_scan(kFrame, scan_of(wall(4.05F), kFrame));
  maps.jobs.advance(kFrame + 19 * kMillisecond);
  EXPECT_FALSE(maps.perception.grid());
  maps.jobs.advance(kFrame + 20 * kMillisecond);
  ASSERT_TRUE(maps.perception.grid());
  EXPECT_TRUE(maps.occupied({4.05, 0.05, 1.55}));
  EXPECT_FALSE(maps.occupied({3.85, 0.05, 1.55}));
  EXPECT_TRUE(maps.perception.grid()->view.known({2, 0.05, 1.55}));  // the rays passed
  // The 2D map follows in its own lane, the cloud is there after a second.
  maps.jobs.advance(kFrame + kNanosecondsPerSecond);
  ASSERT_TRUE(maps.perception.map_2d());
  EXPECT_GT(maps.perception.known_volume_m3(), 0);
  EXPECT_GT(maps.perception.cloud().size(), 100U);
}

TEST(Perception, AFurtherLidarsFrameIsPlacedByThePosesOfItsOwnTime) {
  constexpr double kSpeed = 4;
  Maps maps;
  maps.estimate(4 * kFrame, kSpeed);
  maps.see_from_lidar(4 * kFrame, 4.05F);
  maps.jobs.advance(5 * kFrame);
  const double fired = 4.05 + kSpeed * 0.35;  // 0.35 s: the middle of the frame
  EXPECT_TRUE(maps.occupied({fired, 0.05, 1.55}));
  EXPECT_FALSE(maps.occupied({4.05 + kSpeed * 0.4, 0.05, 1.55}));
  EXPECT_FALSE(maps.occupied({4.05, 0.05, 1.55}));
}

TEST(Perception, ADepthFrameIsPlacedByThePoseAtItsStamp) {
  constexpr double kSpeed = 4;
  StackConfig config = defaults();
  config.vehicle.camera_pitch_rad = 0;
  Maps maps(config);
  maps.estimate(4 * kFrame, kSpeed);
  DepthImage image;
  image.stamp = 3 * kFrame;
  image.camera = {80, 60, 60, 60, 39.5, 29.5};
  image.depth_m.assign(80 * 60, 3.0F);  // a wall across the view
  // The grid rolls with the LiDAR's frames.
  maps.perception.add_scan(3 * kFrame, scan_of(wall(-3.05F), 3 * kFrame));
  maps.perception.add_depth(4 * kFrame, std::make_shared<const DepthImage>(image));
  maps.jobs.advance(5 * kFrame);
  const Vec3 camera = kAirO + config.vehicle.camera_position_m + kSpeed * 0.3 * Vec3::UnitX();
  const int stride = config.mapping.local.depth_hit_stride_px;
  for (int u = 6 * stride; u <= 14 * stride; u += stride) {
    const Vec3 p_C = image.camera.unproject(u, 7 * stride, 3.0);
    const Vec3 p_O = camera + MountConfig::forward() * p_C;
    EXPECT_TRUE(maps.occupied(p_O)) << u;
    EXPECT_FALSE(maps.occupied(p_O + kSpeed * 0.1 * Vec3::UnitX())) << u;
  }
}

TEST(Perception, NothingIsPlacedByPosesThatAreLostUntilTheyAreOkAgain) {
  using Status = OdometryStatus;
  Maps maps;
  maps.see_from_lidar(kFrame, 4.05F);  // no pose at all
  maps.estimate(kFrame);
  maps.estimate(2 * kFrame, 0, Status::kLost);
  maps.see_from_lidar(2 * kFrame, 4.05F);
  maps.estimate(3 * kFrame, 0, Status::kDegenerate);  // not yet
  maps.see_from_lidar(3 * kFrame, 4.05F);
  maps.jobs.advance(4 * kFrame);
  EXPECT_FALSE(maps.perception.grid());
  maps.estimate(5 * kFrame);
  maps.see_from_lidar(5 * kFrame, 4.05F);
  maps.jobs.advance(6 * kFrame);
  EXPECT_TRUE(maps.occupied({4.05, 0.05, 1.55}));
}

TEST(Perception, AfterAJumpNothingOfBeforeIsLeftOrComesIn) {
  Maps maps;
  maps.estimate(kFrame);
  maps.perception.add_scan(kFrame, scan_of(wall(4.05F), kFrame));
  maps.jobs.advance(2 * kFrame);
  ASSERT_TRUE(maps.occupied({4.05, 0.05, 1.55}));
  // One is under way when the pose jumps.
  maps.perception.add_scan(2 * kFrame, scan_of(wall(3.05F), 2 * kFrame));
  const Stamp jump = 2 * kFrame + kMillisecond;
  maps.perception.forget_local(jump, jump);
  EXPECT_FALSE(maps.perception.grid());
  maps.jobs.advance(2 * kFrame + 50 * kMillisecond);
  EXPECT_FALSE(maps.perception.grid());
  // Begun before the jump.
  maps.perception.add_scan(3 * kFrame, scan_of(wall(2.05F), 3 * kFrame));
  maps.jobs.advance(4 * kFrame);
  EXPECT_FALSE(maps.perception.grid());
  maps.perception.add_scan(5 * kFrame, scan_of(wall(1.05F), 5 * kFrame));
  maps.jobs.advance(6 * kFrame);
  EXPECT_TRUE(maps.occupied({1.05, 0.05, 1.55}));
  for (const double x : {2.05, 3.05, 4.05}) EXPECT_FALSE(maps.occupied({x, 0.05, 1.55})) << x;
}

TEST(Perception, TellsOnceThatTheCloudIsFull) {
  StackConfig config = defaults();
  config.mapping.cloud.max_points = 50;
  config.mapping.enabled = false;  // the cloud is kept all the same
  Maps maps(config);
  int told = 0;
  for (Stamp end = kFrame; end <= 5 * kFrame; end += kFrame) {
    maps.perception.add_scan(end, scan_of(wall(4.05F), end));
  }
  maps.jobs.advance(10 * kNanosecondsPerSecond);
  for (int k = 0; k < 3; ++k) told += maps.perception.take_cloud_cut();
  EXPECT_EQ(told, 1);
  EXPECT_EQ(maps.perception.cloud().size(), 50U);
  EXPECT_FALSE(maps.perception.grid());
}

}  // namespace
}  // namespace arex
