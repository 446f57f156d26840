#include "sensors/mid360_packets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sensors/mid360.h"
#include "sim/sensors_lidar/test_world.h"

namespace arex::sim {
namespace {

using test::rest;
using test::WorldMaker;

/// Frame `index` of a device at rest in a world, as the simulation makes it: parts of 20 ms, the
/// first with the tick before.
LidarScan frame_of(const Mid360& lidar, const Pose& X_WB, std::int64_t index, Stamp period) {
  constexpr std::int64_t kPart = 20;
  const Stamp begin = index * period, end = begin + period;
  std::vector<LidarScan> parts;
  for (Stamp from = begin; from < end; from += kPart * kNanosecondsPerTick) {
    const Stamp lead = from == begin && begin > 0 ? kNanosecondsPerTick : 0;
    const Stamp until = std::min(from + kPart * kNanosecondsPerTick, end);
    const auto ticks = static_cast<int>((until - from + lead) / kNanosecondsPerTick);
    parts.push_back(lidar.scan(rest(X_WB, ticks, from - lead), begin));
  }
  return lidar.frame(begin, end, parts);
}

TEST(LidarPackets, StampsJitterAsMeasured) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const LidarPackets packets(259e-6, seed);
    constexpr int kCount = 20'000;
    double square = 0, earliest = 0, latest = 0;
    int backwards = 0;
    for (std::int64_t i = 1; i <= kCount; ++i) {
      const double jitter_us = 1e-3 * static_cast<double>(packets.stamp(i) - i * 480'000);
      square += jitter_us * jitter_us;
      earliest = std::min(earliest, jitter_us);
      latest = std::max(latest, jitter_us);
      // The last point of a packet lies 475 us after its first.
      backwards += packets.stamp(i + 1) < packets.stamp(i) + 475'000 ? 1 : 0;
    }
    EXPECT_NEAR(std::sqrt(square / kCount), 259, 3);
    EXPECT_NEAR(earliest, -410, 10);
    EXPECT_NEAR(latest, 667, 30);
    EXPECT_GT(backwards, kCount / 3);
    EXPECT_NEAR(1e-3 * static_cast<double>(packets.stamp(kCount)) / kCount, 480, 0.1);
  }
  const LidarPackets exact(0, 1), same(259e-6, 7), again(259e-6, 7), other(259e-6, 8);
  for (std::int64_t i = 0; i < 100; ++i) {
    ASSERT_EQ(exact.stamp(i), i * 480'000);
    ASSERT_EQ(same.stamp(i), again.stamp(i));
    ASSERT_GE(same.stamp(i), 0);
  }
  EXPECT_NE(same.stamp(50), other.stamp(50));
}

// Every firing is in one frame and one only, in messages of whole packets, whatever the frame rate.
TEST(LidarPackets, FramesHoldEveryFiringOnceInWholePackets) {
  const worlds::World world = WorldMaker().object(0.6F).box(Pose{}, {5, 5, 5}).world();
  const Scene scene(world);
  for (const int rate_hz : {5, 10, 20, 50}) {
    Mid360Config config;
    config.rate_hz = rate_hz;
    config.noise_free = true;
    const Mid360 lidar(config, scene, Pose{}, {}, 1);
    const Mid360Pattern pattern(PatternMode::kDevice);
    std::int64_t next = 0;
    for (std::int64_t i = 0; i < 7; ++i) {
      const LidarScan scan = frame_of(lidar, Pose{}, i, config.period());
      ASSERT_EQ(scan.end, (i + 1) * config.period());
      ASSERT_EQ(scan.firings() % 96, 0);
      ASSERT_EQ(scan.misses(), 0);
      if (rate_hz == 10) {
        EXPECT_TRUE(scan.firings() == 19'968 || scan.firings() == 20'064) << scan.firings();
      }
      for (const LidarPoint& point : scan.points) {
        // Without noise the stamps are the firings' own times.
        ASSERT_EQ(scan.stamp + point.offset_ns, next * 5'000);
        ASSERT_EQ(point.line, next % 4);
        const Vec3 d = point.p_L.cast<double>().normalized();
        ASSERT_LT((d - pattern.direction(next)).norm(), 3e-7);
        ++next;
      }
      ASSERT_LE(next * 5'000, scan.end);
      ASSERT_GT((next + 96) * 5'000, scan.end);
    }
  }
}

TEST(LidarPackets, PointsOfAPacketShareItsStampAndTimesRunBackwards) {
  const worlds::World world = WorldMaker().object(0.6F).box(Pose{}, {5, 5, 5}).world();
  const Scene scene(world);
  const Mid360 lidar({}, scene, Pose{}, {}, 3);
  const LidarPackets packets(259e-6, 3);
  int backwards = 0;
  for (std::int64_t i = 1; i < 4; ++i) {
    const LidarScan scan = frame_of(lidar, Pose{}, i, 100'000'000);
    const std::int64_t first = i * 100'000'000 / 480'000;
    Stamp earliest = scan.end;
    std::uint32_t previous = 0;
    for (const LidarPoint& point : scan.points) {
      const Stamp expected = packets.stamp(first + point.firing / 96) + point.firing % 96 * 5'000;
      ASSERT_EQ(scan.stamp + point.offset_ns, expected);
      ASSERT_LT(expected, scan.end + 1'000'000);
      ASSERT_EQ(point.line, point.firing % 4);
      earliest = std::min(earliest, expected);
      backwards += point.offset_ns < previous ? 1 : 0;
      previous = point.offset_ns;
    }
    EXPECT_GE(earliest, scan.stamp);
    EXPECT_LT(earliest, scan.stamp + 480'000);
    // Half a percent is lost for no visible reason.
    EXPECT_EQ(scan.misses(), scan.firings() - static_cast<std::int64_t>(scan.points.size()));
    EXPECT_NEAR(static_cast<double>(scan.misses()), 100, 45);
  }
  EXPECT_GT(backwards, 100);
}

TEST(LidarPackets, OpenSkyIsAFrameOfMisses) {
  const worlds::World nothing;
  const Scene scene(nothing);
  Mid360Config config;
  config.echo.false_alarm_probability = 0;
  const LidarScan scan = frame_of(Mid360(config, scene, Pose{}, {}, 3), Pose{}, 0, 100'000'000);
  EXPECT_TRUE(scan.points.empty());
  EXPECT_EQ(scan.misses(), 19'968);
}

/// The intensity of a wall of this reflectivity, seen head on within 20 degrees.
double intensity_of(float reflectivity) {
  const worlds::World world =
      WorldMaker().object(reflectivity).quad({6, -40, -40}, {0, 80, 0}, {0, 0, 80}).world();
  const Scene scene(world);
  const Mid360 lidar({}, scene, Pose{}, {}, 1);
  double sum = 0;
  int count = 0;
  for (const LidarPoint& point : lidar.scan(rest(Pose{})).points) {
    if (point.p_L.x() / point.p_L.norm() < 0.94F) continue;
    sum += static_cast<double>(point.intensity);
    ++count;
  }
  EXPECT_GT(count, 500);
  return sum / count;
}

TEST(Mid360Reflectivity, DiffuseUpTo150AndRetroReflectorsAbove) {
  EXPECT_NEAR(intensity_of(0.2F), 150 * 0.2 * 0.97, 0.7);
  EXPECT_LT(intensity_of(1), 150.01);
  // Number plate, sign, warning strip: 151 + 104 log10(r) / 3.
  EXPECT_NEAR(intensity_of(157), 227, 1.5);
  EXPECT_NEAR(intensity_of(220), 232, 1.5);
  EXPECT_NEAR(intensity_of(785), 251, 1.5);
  for (const float cosine : {0.01F, 0.3F, 1.0F}) {
    EXPECT_GE(EchoModel::intensity(1.01F, cosine), 151);
    EXPECT_LE(EchoModel::intensity(1000, cosine), 255);
  }
}

TEST(Mid360Tag, MarksWhatIsWeakAndWhatIsMerged) {
  // A wall of 10 % reaches 40 m: near that its returns are weak, at half of it they are not.
  for (const double distance : {10.0, 38.0}) {
    const worlds::World world =
        WorldMaker().object(0.1F).quad({distance, -60, -60}, {0, 120, 0}, {0, 0, 120}).world();
    const Scene scene(world);
    Mid360Config config;
    config.echo.false_alarm_probability = 0;
    const Mid360 lidar(config, scene, Pose{}, {}, 1);
    int points = 0, weak = 0;
    for (const LidarPoint& point : lidar.scan(rest(Pose{})).points) {
      if (point.p_L.x() / point.p_L.norm() < 0.95F) continue;
      ++points;
      weak += point.tag >> LidarTag::kWeakShift != 0 ? 1 : 0;
      ASSERT_EQ(point.tag & 3, 0);
    }
    ASSERT_GT(points, 300);
    EXPECT_EQ(weak, distance > 20 ? points : 0);
  }
  // Poles before a wall: only points between them are merged, and all of those.
  WorldMaker maker;
  maker.object(0.5F).quad({3.4, -9, -9}, {0, 18, 0}, {0, 0, 18});
  for (const double y : {-1.25, -0.75, -0.25, 0.25, 0.75, 1.25}) {
    maker.quad({3, y - 0.05, -5}, {0, 0.1, 0}, {0, 0, 10});
  }
  const worlds::World world = maker.world();
  const Scene scene(world);
  const Mid360 lidar({}, scene, Pose{}, {}, 2);
  int merged = 0, low = 0;
  for (const LidarPoint& point : lidar.scan(rest(Pose{}, 4000)).points) {
    const float x = point.p_L.x(), side = std::abs(point.p_L.y());
    if (point.tag >> LidarTag::kWeakShift != 0) continue;  // false alarms lie anywhere
    if (side < 2 && x > 3.06F && x < 3.33F) {              // 7 sigma from either
      ++merged;
      low += (point.tag & 3) == LidarTag::kLow ? 1 : 0;
      ASSERT_NE(point.tag & 3, 0) << x;
    } else if (side > 2) {
      ASSERT_EQ(point.tag & 3, 0) << x;
    }
  }
  EXPECT_GT(merged, 60);
  EXPECT_GT(low, merged / 3);
}

}  // namespace
}  // namespace arex::sim
