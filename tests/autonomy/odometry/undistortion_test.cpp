#include "odometry/undistortion.h"

#include <gtest/gtest.h>

#include <limits>

#include "math/random.h"
#include "math/so3.h"
#include "support/analytic_motion.h"

namespace arex {
namespace {

const Pose kXBL{so3::Exp({0, 0.7854, 0}), {0.15, 0, 0.01}};

/// Yaw of 3 rad/s on a circle flown at 2 m/s: in closed form.
struct Circle {
  double rate = 3, speed = 2;
  [[nodiscard]] Pose at(double t) const {
    const double radius = speed / rate;
    return {so3::from_yaw(rate * t),
            Vec3(radius * std::sin(rate * t), radius * (1 - std::cos(rate * t)), 1)};
  }
  [[nodiscard]] ImuSample imu(Stamp stamp) const {
    return {stamp, Vec3(0, 0, rate), Vec3(0, speed * rate, kGravity)};
  }
};

TEST(Undistortion, PutsEveryPointWhereItIsAtOneInstant) {
  const Circle motion;
  std::vector<ImuSample> samples;
  for (Stamp t = 0; t <= 110'000'000; t += 5'000'000) samples.push_back(motion.imu(t));
  NavigationState x;
  x.R_OB = motion.at(0).R;
  x.p_OB = motion.at(0).p;
  x.v_OB = Vec3(motion.speed, 0, 0);
  std::vector<MotionSegment> segments;
  for (const ImuInterval& imu : imu_intervals(samples, 0, 100'000'000, 1.0)) {
    segments.push_back(motion_segment(x, imu));
    x = propagate(x, imu);
  }

  for (const double instant : {0.1, 0.05, 0.02}) {
    RandomStream random(1, "points");
    LidarScan scan;
    scan.end = 100'000'000;
    std::vector<Vec3> expected;
    const Pose X_LO = (motion.at(instant) * kXBL).inverse();
    for (std::uint32_t i = 0; i < 20000; ++i) {
      const double t = 5e-6 * i;
      LidarPoint point;
      point.offset_ns = i * 5000;
      point.p_L = (10 * random.normal3().normalized()).cast<float>();
      scan.points.push_back(point);
      expected.push_back(X_LO * (motion.at(t) * (kXBL * point.p_L.cast<double>())));
    }
    const auto points =
        undistort(scan, segments, motion.at(instant), kXBL, LidarNoiseConfig{}, 0.3);
    ASSERT_EQ(points.size(), scan.points.size());
    double worst = 0, distortion = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      worst = std::max(worst, (points[i].p_L.cast<double>() - expected[i]).norm());
      distortion = std::max(distortion, (scan.points[i].p_L.cast<double>() - expected[i]).norm());
    }
    EXPECT_GT(distortion, 20 * std::max(instant, 0.1 - instant));  // what there was to undo
    EXPECT_LT(worst, 0.001);
  }
}

// Packets are stamped with jitter: times run backwards, and end past the last segment.
TEST(Undistortion, GoesByThePointsOwnTimesInAnyOrder) {
  std::vector<MotionSegment> segments;
  const Circle motion;
  NavigationState x;
  x.R_OB = motion.at(0).R;
  x.p_OB = motion.at(0).p;
  x.v_OB = Vec3(motion.speed, 0, 0);
  std::vector<ImuSample> samples;
  for (Stamp t = 0; t <= 110'000'000; t += 5'000'000) samples.push_back(motion.imu(t));
  for (const ImuInterval& imu : imu_intervals(samples, 0, 100'000'000, 1.0)) {
    segments.push_back(motion_segment(x, imu));
    x = propagate(x, imu);
  }
  RandomStream random(2, "points");
  LidarScan in_order;
  in_order.end = 100'000'000;
  for (std::uint32_t i = 0; i < 2000; ++i) {
    LidarPoint point;
    point.offset_ns = i * 50'330;  // the last at 100.6 ms
    point.p_L = (10 * random.normal3().normalized()).cast<float>();
    in_order.points.push_back(point);
  }
  LidarScan shuffled = in_order;
  for (std::size_t i = 0; i < shuffled.points.size(); ++i) {
    std::swap(shuffled.points[i],
              shuffled.points[static_cast<std::size_t>(random.uniform_int(0, 1999))]);
  }
  const auto expected = undistort(in_order, segments, x.X_OB(), kXBL, LidarNoiseConfig{}, 0.3);
  const auto points = undistort(shuffled, segments, x.X_OB(), kXBL, LidarNoiseConfig{}, 0.3);
  ASSERT_EQ(points.size(), 2000U);
  for (const ScanPoint& point : points) {
    const std::uint32_t i = shuffled.points[point.index].offset_ns / 50'330;
    ASSERT_EQ(point.p_L, expected[i].p_L);
    const double t = 1e-9 * in_order.points[i].offset_ns;
    const Vec3 truth = (motion.at(0.1) * kXBL).inverse() *
                       (motion.at(t) * (kXBL * in_order.points[i].p_L.cast<double>()));
    ASSERT_LT((point.p_L.cast<double>() - truth).norm(), 0.001);
  }
}

TEST(Undistortion, LeavesAStandingScanAsItIs) {
  MotionSegment still;
  still.end = 100'000'000;
  LidarScan scan;
  scan.end = still.end;
  for (std::uint32_t i = 0; i < 100; ++i) {
    LidarPoint point;
    point.p_L = Vec3f(3, 0.1F * static_cast<float>(i), 1);
    point.offset_ns = i * 1'000'000;
    scan.points.push_back(point);
  }
  const auto points = undistort(scan, {still}, {}, kXBL, LidarNoiseConfig{}, 0.3);
  ASSERT_EQ(points.size(), 100U);
  for (const ScanPoint& point : points) {
    EXPECT_LT((point.p_L - scan.points[point.index].p_L).norm(), 1e-5F);
  }
}

TEST(Undistortion, DropsWhatIsNotTheWorld) {
  MotionSegment still;
  still.end = 100'000'000;
  LidarScan scan;
  scan.end = still.end;
  const auto add = [&scan](const Vec3f& p) {
    LidarPoint point;
    point.p_L = p;
    scan.points.push_back(point);
  };
  add({5, 0, 0});
  add({0.2F, 0.2F, 0});                                      // blind zone
  add((kXBL.inverse() * Vec3(-0.2, 0.1, 0)).cast<float>());  // a rear arm
  add((kXBL.inverse() * Vec3(-0.6, 0, 0)).cast<float>());    // behind the airframe: the world
  add({std::numeric_limits<float>::quiet_NaN(), 0, 0});
  add({100, 0, 0});
  LidarNoiseConfig config;
  config.blind_m = 0.3;
  const auto points = undistort(scan, {still}, {}, kXBL, config, 0.3);
  ASSERT_EQ(points.size(), 2U);
  EXPECT_EQ(points[0].index, 0U);
  EXPECT_EQ(points[1].index, 3U);
}

}  // namespace
}  // namespace arex
