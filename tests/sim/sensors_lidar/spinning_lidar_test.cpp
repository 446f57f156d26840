#include "sensors/spinning_lidar.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>

#include "config/config.h"
#include "math/so3.h"
#include "sim/sensors_lidar/test_world.h"

namespace arex::sim {
namespace {

using test::kRoomHalf;
using test::rest;
using test::room;
using test::to_wall;
using test::WorldMaker;

SpinningLidarConfig exact() {
  SpinningLidarConfig config;
  config.noise_free = true;
  return config;
}

// The maker's arithmetic: 1800 columns a turn at 10 Hz, 16 lasers from -15 to 15 degrees, 2 apart.
TEST(SpinningLidar, FiresItsFanClockwiseAtEqualTimes) {
  const worlds::World world = room();
  const Scene scene(world);
  const Pose X_BL{so3::Exp({0.1, -0.2, 0.3}), {0.1, 0, 0.05}};
  const SpinningLidar lidar(exact(), scene, X_BL, {}, 1);
  for (const Stamp start : {Stamp{0}, Stamp{60'000'000}, Stamp{1'799'900'000'000}}) {
    const LidarScan scan = lidar.scan(rest(Pose{}, 100, start));
    ASSERT_EQ(scan.points.size(), 16U * 1800U);
    const std::int64_t first = start % 100'000'000 * 28'800 / 100'000'000;
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      const LidarPoint& point = scan.points[i];
      const auto number = first + static_cast<std::int64_t>(i);
      EXPECT_NEAR(point.offset_ns, static_cast<double>(i) * 1e8 / 28'800, 1);
      EXPECT_EQ(point.line, number % 16);
      const double azimuth = -2 * std::numbers::pi * static_cast<double>(number / 16 % 1800) / 1800;
      const double elevation =
          (-15 + 2 * static_cast<double>(number % 16)) * std::numbers::pi / 180;
      const Vec3 d_L(std::cos(elevation) * std::cos(azimuth),
                     std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
      const Vec3 p_L = point.p_L.cast<double>();
      ASSERT_LT((p_L.normalized() - d_L).norm(), 1e-6);
      ASSERT_NEAR(p_L.norm(), to_wall(X_BL.p, X_BL.R * d_L), 1e-4);
    }
  }
}

TEST(SpinningLidar, DistortsAFrameAsTheMotionInsideItSays) {
  const worlds::World world = room();
  const Scene scene(world);
  const Pose X_BL{so3::Exp({0, 0.2, 0}), {0.1, 0, 0.05}};
  const SpinningLidar lidar(exact(), scene, X_BL, {}, 1);
  const Vec3 w(0.5, -1, 3), v(2, 1, -0.5);
  const auto pose_at = [&](double t) { return Pose{so3::Exp(t * w), t * v}; };
  std::vector<Truth> ticks = rest(Pose{}, 100);
  for (Truth& tick : ticks) tick.X_WB = pose_at(to_seconds(tick.stamp));
  const LidarScan scan = lidar.scan(ticks);
  ASSERT_GT(scan.points.size(), 25'000U);
  for (const LidarPoint& point : scan.points) {
    const Pose X_WL = pose_at(to_seconds(scan.stamp + point.offset_ns)) * X_BL;
    const Vec3 p_W = X_WL * point.p_L.cast<double>();
    ASSERT_NEAR((p_W.cwiseQuotient(kRoomHalf)).cwiseAbs().maxCoeff(), 1, 2e-4);
  }
}

TEST(SpinningLidar, SameFrameInAnyParts) {
  const worlds::World world = room();
  const Scene scene(world);
  SpinningLidarConfig config;
  config.columns = 1023;  // no whole number of firings in a tick
  const SpinningLidar lidar(config, scene, Pose{}, {}, 5);
  const std::vector<Truth> ticks = rest(Pose{}, 100);
  const LidarScan whole = lidar.scan(ticks);
  std::vector<LidarPoint> joined;
  for (std::size_t begin = 0; begin < 100; begin += 20) {
    const LidarScan part = lidar.scan(std::span(ticks).subspan(begin, 21));
    for (LidarPoint point : part.points) {
      point.offset_ns += static_cast<std::uint32_t>(part.stamp - whole.stamp);
      joined.push_back(point);
    }
  }
  ASSERT_EQ(joined.size(), whole.points.size());
  for (std::size_t i = 0; i < joined.size(); ++i) {
    EXPECT_EQ(joined[i].p_L, whole.points[i].p_L);
    EXPECT_EQ(joined[i].offset_ns, whole.points[i].offset_ns);
  }
}

TEST(SpinningLidar, ItsNoiseIsWhatIsAskedFor) {
  const worlds::World world = room();
  const Scene scene(world);
  SpinningLidarConfig config;
  config.range_sigma_m = 0.03;
  config.dropout_probability = 0.05;
  const SpinningLidar lidar(config, scene, Pose{}, {}, 7);
  double sum = 0, squares = 0;
  int count = 0;
  const int frames = 5;
  for (int k = 0; k < frames; ++k) {
    for (const LidarPoint& point : lidar.scan(rest(Pose{}, 100, k * 100'000'000)).points) {
      const Vec3 p = point.p_L.cast<double>();
      const double error = p.norm() - to_wall(Vec3::Zero(), p.normalized());
      sum += error;
      squares += error * error;
      ++count;
    }
  }
  // Five sigma of each estimate.
  const double n = count, fired = frames * 28'800.0;
  EXPECT_NEAR(sum / n, 0, 5 * 0.03 / std::sqrt(n));
  EXPECT_NEAR(std::sqrt(squares / n), 0.03, 5 * 0.03 / std::sqrt(2 * n));
  EXPECT_NEAR(n / fired, 0.95, 5 * std::sqrt(0.95 * 0.05 / fired));
}

// A black wall returns light up to half the range that the parameter gives for four times as much.
TEST(SpinningLidar, DarkSurfacesReturnFromNearOnly) {
  const worlds::World world =
      WorldMaker().object(0.025F).box(Pose{Mat3::Identity(), {40, 0, 0}}, {0.5, 30, 30}).world();
  const Scene scene(world);
  SpinningLidarConfig config;
  config.range_at_tenth_m = 50;
  config.dropout_probability = 0;
  const auto returns = [&](double x) {
    const SpinningLidar lidar(config, scene, Pose{Mat3::Identity(), {x, 0, 0}}, {}, 1);
    return lidar.scan(rest(Pose{}, 100)).points.size();
  };
  EXPECT_GT(returns(39.5 - 24), 0U);
  EXPECT_EQ(returns(39.5 - 26), 0U);
}

TEST(SpinningLidar, RefusesWhatNoneCanBe) {
  const auto refused = [](const char* yaml) {
    SpinningLidarConfig config;
    EXPECT_THROW(read_config(parse_yaml(yaml, "given"), config), ConfigError) << yaml;
  };
  refused("{rings: 0}");
  refused("{columns: 5000}");
  refused("{lowest_deg: 20}");
  refused("{rate_hz: 3}");  // a third of a second is no whole number of ticks
  refused("{range_min_m: 200}");
}

}  // namespace
}  // namespace arex::sim
