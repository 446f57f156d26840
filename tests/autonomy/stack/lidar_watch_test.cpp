#include "stack/lidar_watch.h"

#include <gtest/gtest.h>

namespace arex {
namespace {

constexpr Stamp kFrame = 100'000'000;

RegistrationReport matched(int matched, int points) {
  RegistrationReport report;
  report.points = points;
  report.matched = matched;
  return report;
}

/// A watch that has seen two sound seconds, up to `now`.
LidarWatch after_sound_scans(Stamp& now) {
  LidarWatch watch{LidarWatchConfig{}};
  for (int i = 0; i < 20; ++i) {
    now += kFrame;
    watch.add_scan(now, 15000);
    watch.add_registration(matched(1400, 1500));
    EXPECT_FALSE(watch.update(now));
  }
  return watch;
}

TEST(LidarWatch, SaysOnceThatItIsSilentAndOnceThatItIsBack) {
  Stamp now = 0;
  LidarWatch watch = after_sound_scans(now);
  int told = 0;
  for (int i = 0; i < 10; ++i) {
    now += kFrame;
    watch.add_scan(now, 3);  // the device still sends frames, with nothing in them
    if (const auto fault = watch.update(now)) {
      EXPECT_EQ(*fault, "lidar silent");
      EXPECT_EQ(i, 2);
      ++told;
    }
  }
  EXPECT_EQ(told, 1);
  now += kFrame;
  watch.add_scan(now, 15000);
  EXPECT_EQ(watch.update(now), "lidar sound again");
  EXPECT_FALSE(watch.update(now));
}

TEST(LidarWatch, NoticesReturnsThatFitNothing) {
  Stamp now = 0;
  LidarWatch watch = after_sound_scans(now);
  for (int i = 0; i < 50; ++i) {  // and does not get used to them
    now += kFrame;
    watch.add_scan(now, 15000);
    watch.add_registration(matched(1400, 3500));
    const auto fault = watch.update(now);
    if (i == 0) {
      EXPECT_EQ(fault, "lidar returns refused");
    } else {
      EXPECT_FALSE(fault);
    }
  }
  watch.add_scan(now, 15000);
  watch.add_registration(matched(1300, 1500));
  EXPECT_EQ(watch.update(now), "lidar sound again");
}

TEST(LidarWatch, WaitsForTheFirstScan) {
  LidarWatch watch{LidarWatchConfig{}};
  EXPECT_FALSE(watch.update(10 * kNanosecondsPerSecond));
}

}  // namespace
}  // namespace arex
