#include "stack/lidar_watch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include "math/random.h"

namespace arex {
namespace {

constexpr Stamp kFrame = 100'000'000;
constexpr int kFirings = 20000;

struct Flaws {
  double missing = 0.005;  ///< share of the returns lost
  double spikes = 0;       ///< share at any range
  double noise_m = 0;      ///< RMS of the ranges
  double leaves = 0;       ///< not the device's: share of the view that a crown fills
};

/// A scan in a room with a clutter of poles, `clutter` of the firings on one.
LidarScan make_scan(Stamp end, const Flaws& flaws, double clutter, RandomStream& random) {
  LidarScan scan;
  scan.stamp = end - kFrame;
  scan.end = end;
  for (int i = 0; i < kFirings; ++i) {
    const double angle = 2e-3 * i;
    double range = 5 / std::max(std::abs(std::cos(angle)), std::abs(std::sin(angle)));
    if (random.uniform() < clutter) range *= 0.6;
    if (flaws.leaves > 0 && std::remainder(angle, 2 * std::numbers::pi) + std::numbers::pi <
                                2 * std::numbers::pi * flaws.leaves) {
      range = random.uniform(2, 2.9);
    }
    if (random.uniform() < flaws.missing) continue;
    if (random.uniform() < flaws.spikes) range = random.uniform(0.5, 40);
    if (flaws.noise_m > 0) range += flaws.noise_m * random.normal();
    LidarPoint point;
    point.p_L = Vec3(range * std::cos(angle), range * std::sin(angle), 0).cast<float>();
    point.offset_ns = static_cast<std::uint32_t>(5000 * i);
    point.line = static_cast<std::uint8_t>(i % 4);
    scan.points.push_back(point);
  }
  return scan;
}

double matched(int matched, int points) { return static_cast<double>(matched) / points; }

/// Flies a watch: what it tells, with the frame at which it does.
class Watching {
 public:
  explicit Watching(std::uint64_t seed) : random_(seed, "watch") {
    for (int i = 0; i < 25; ++i) frame({}, matched(1400, 1500));
    EXPECT_EQ(told_, "");
  }
  void frame(const Flaws& flaws, std::optional<double> matched_share) {
    now_ += kFrame;
    const double clutter = 0.04 + 0.02 * std::sin(0.3 * static_cast<double>(frame_));
    watch_.add_scan(now_, make_scan(now_, flaws, clutter, random_));
    watch_.add_matched_share(matched_share);
    update();
  }
  void empty_frame() {  // the device still sends frames, with nothing in them
    now_ += kFrame;
    LidarScan scan;
    scan.stamp = now_ - kFrame;
    scan.end = now_;
    watch_.add_scan(now_, scan);
    update();
  }
  /// "frame:what;" for all that was told since the last call.
  std::string told() { return std::exchange(told_, ""); }
  void count_from_here() { frame_ = 0; }

 private:
  void update() {
    if (const auto fault = watch_.update(now_)) {
      told_ += std::to_string(frame_) + ":" + std::string(*fault) + ";";
    }
    ++frame_;
  }

  RandomStream random_;
  LidarWatch watch_{LidarWatchConfig{}};
  Stamp now_ = 0;
  int frame_ = 0;
  std::string told_;
};

TEST(LidarWatch, SaysOnceThatItIsSilentAndOnceThatItIsBack) {
  Watching w(1);
  w.count_from_here();
  for (int i = 0; i < 10; ++i) w.empty_frame();
  for (int i = 0; i < 10; ++i) w.frame({}, matched(1400, 1500));
  EXPECT_EQ(w.told(), "2:lidar silent;12:lidar sound again;");
}

// Half of the frames lost for a minute and more: a handful of events, not one for each gap.
TEST(LidarWatch, TellsWhatComesAndGoesAFewTimesNotEachTime) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    RandomStream lost(seed, "lost");
    Watching w(seed);
    for (int i = 0; i < 800; ++i) {
      if (lost.uniform() < 0.5) {
        w.empty_frame();
      } else {
        w.frame({}, matched(1400, 1500));
      }
    }
    const std::string told = w.told();
    const auto changes = std::count(told.begin(), told.end(), ';');
    EXPECT_GE(changes, 1) << seed;
    EXPECT_LE(changes, 16) << told;
    for (int i = 0; i < 250; ++i) w.frame({}, matched(1400, 1500));
    EXPECT_NE(w.told().find("lidar sound again"), std::string::npos) << seed;
    // Long after, a fault is one by itself again.
    w.count_from_here();
    for (int i = 0; i < 5; ++i) w.empty_frame();
    for (int i = 0; i < 5; ++i) w.frame({}, matched(1400, 1500));
    EXPECT_EQ(w.told(), "2:lidar silent;7:lidar sound again;") << seed;
  }
}

TEST(LidarWatch, NoticesAFifthOfTheReturnsMissing) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Watching w(seed);
    w.count_from_here();
    for (int i = 0; i < 10; ++i) w.frame({.missing = 0.2}, matched(1400, 1500));
    for (int i = 0; i < 10; ++i) w.frame({}, matched(1400, 1500));
    EXPECT_EQ(w.told(), "2:lidar returns missing;12:lidar sound again;");
  }
}

TEST(LidarWatch, NoticesATenthOfTheReturnsFalse) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Watching w(seed);
    w.count_from_here();
    for (int i = 0; i < 50; ++i) w.frame({.spikes = 0.1}, matched(1300, 1500));  // not got used to
    for (int i = 0; i < 10; ++i) w.frame({}, matched(1400, 1500));
    EXPECT_EQ(w.told(), "2:lidar returns false;52:lidar sound again;");
  }
}

TEST(LidarWatch, NoticesRangesNoisierThanUsual) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Watching w(seed);
    for (int i = 0; i < 30; ++i) w.frame({.noise_m = 0.012}, matched(1400, 1500));
    w.count_from_here();
    for (int i = 0; i < 50; ++i) w.frame({.noise_m = 0.1}, matched(1300, 1500));  // not got used to
    for (int i = 0; i < 10; ++i) w.frame({.noise_m = 0.012}, matched(1400, 1500));
    EXPECT_EQ(w.told(), "2:lidar noisy;52:lidar sound again;");
  }
}

// The neighbours of a firing are the device's, not the clock's: packets that were stamped so that
// they overlap tell the same.
TEST(LidarWatch, CountsFiringsWhereTimesRunBackwards) {
  const LidarWatch watch{LidarWatchConfig{}};
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    RandomStream random(seed, "watch");
    LidarScan scan = make_scan(kFrame, {.missing = 0.1, .spikes = 0.05}, 0.04, random);
    std::erase_if(scan.points, [](const LidarPoint& p) { return p.offset_ns >= 19'968 * 5'000; });
    const LidarWatch::Survey exact = watch.survey(scan);
    for (std::uint32_t i = 0; i < 208; ++i) {
      scan.packets_ns.push_back(i * 480'000 +
                                static_cast<std::uint32_t>(random.uniform_int(0, 1'000'000)));
    }
    for (LidarPoint& point : scan.points) {
      point.firing = static_cast<std::uint16_t>(point.offset_ns / 5'000);
      point.offset_ns = scan.firing_ns(point.firing);
    }
    const LidarWatch::Survey jittered = watch.survey(scan);
    EXPECT_EQ(jittered.between, exact.between);
    EXPECT_EQ(jittered.missing, exact.missing);
    EXPECT_EQ(jittered.spikes, exact.spikes);
    EXPECT_GT(exact.missing, 1000);
  }
}

TEST(LidarWatch, NoticesReturnsThatFitNothing) {
  Watching w(1);
  w.count_from_here();
  for (int i = 0; i < 50; ++i) w.frame({}, matched(1400, 3500));
  w.frame({}, matched(1300, 1500));
  for (int i = 0; i < 10; ++i) w.frame({}, matched(1300, 1500));
  EXPECT_EQ(w.told(), "2:lidar returns false;53:lidar sound again;");
}

// An IMU that fails makes scans fit nothing; that is no news of the LiDAR.
TEST(LidarWatch, SaysNothingOfMatchesThatTellOfSomethingElse) {
  Watching w(1);
  for (int i = 0; i < 2; ++i) w.frame({}, matched(1400, 3500));  // until the IMU's fault is seen
  for (int i = 0; i < 50; ++i) w.frame({}, std::nullopt);
  for (int i = 0; i < 2; ++i) w.frame({}, matched(1400, 3500));
  EXPECT_EQ(w.told(), "");
  w.count_from_here();
  for (int i = 0; i < 10; ++i) w.frame({.spikes = 0.1}, std::nullopt);
  EXPECT_EQ(w.told(), "2:lidar returns false;");
}

// All returns false: the odometry is lost, and the matches tell no more. That is not the end of it.
TEST(LidarWatch, StaysFalseWhereNothingTellsThatItIsSoundAgain) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    Watching w(seed);
    w.count_from_here();
    for (int i = 0; i < 4; ++i) w.frame({.spikes = 1}, matched(100, 1500));
    for (int i = 0; i < 20; ++i) w.frame({.spikes = 1}, std::nullopt);
    EXPECT_EQ(w.told(), "2:lidar returns false;") << seed;
    for (int i = 0; i < 10; ++i) w.frame({}, std::nullopt);
    EXPECT_EQ(w.told(), "26:lidar sound again;") << seed;
  }
}

// One scan across the gaps of a crown is no fault.
TEST(LidarWatch, TwoScansWithGapsAreNotMissingThreeAre) {
  Watching w(2);
  for (int i = 0; i < 12; ++i) w.frame({.missing = i % 3 < 2 ? 0.2 : 0.01}, matched(1400, 1500));
  EXPECT_EQ(w.told(), "");
}

// Shrubs make a sound scan look false now and then; half a second of false returns is five scans.
TEST(LidarWatch, TwoOddScansAreNotFalseThreeAre) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    Watching w(seed);
    w.count_from_here();
    for (int i = 0; i < 10; ++i) {
      w.frame({.spikes = i % 3 < 2 ? 0.1 : 0.0}, matched(1400, 1500));
    }
    for (int i = 0; i < 10; ++i) w.frame({}, matched(i % 3 > 0 ? 1400 : 3500, 3500));
    EXPECT_EQ(w.told(), "");
    w.count_from_here();
    for (int i = 0; i < 4; ++i) w.frame({}, matched(1400, 1500));
    for (int i = 0; i < 5; ++i) w.frame({.spikes = 0.1}, matched(1400, 1500));
    for (int i = 0; i < 4; ++i) w.frame({}, matched(1400, 1500));
    EXPECT_EQ(w.told(), "6:lidar returns false;11:lidar sound again;");
  }
}

// Before a crown few firings lie between returns of one surface, and leaves stand before and
// behind.
TEST(LidarWatch, ACrownThatFillsTheViewIsNoFalseReturns) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    Watching w(seed);
    for (int i = 0; i < 10; ++i) w.frame({.leaves = 0.75}, matched(1400, 1500));
    // That leaves lie loosely is noise to who has seen but walls without any.
    EXPECT_EQ(w.told().find("false"), std::string::npos) << seed;
    w.count_from_here();
    for (int i = 0; i < 5; ++i) w.frame({.spikes = 0.2, .leaves = 0.75}, matched(1400, 1500));
    EXPECT_EQ(w.told(), "2:lidar returns false;") << seed;
  }
}

// The survey's counts are binomial: shares of the flaws, of firings whose neighbours are sound.
TEST(LidarWatch, SurveyCountsWhatIsMissingAndWhatIsElsewhere) {
  RandomStream random(3, "survey");
  const LidarWatch watch{LidarWatchConfig{}};
  const auto clean = watch.survey(make_scan(kFrame, {.missing = 0}, 0, random));
  EXPECT_GT(clean.between, kFirings - 1000);  // but for the corners
  EXPECT_EQ(clean.missing + clean.spikes, 0);
  const auto flawed = watch.survey(make_scan(kFrame, {.missing = 0.2, .spikes = 0.1}, 0, random));
  const double n = flawed.between;
  EXPECT_NEAR(flawed.missing / n, 0.2, 4 * std::sqrt(0.16 / n));
  EXPECT_NEAR(flawed.spikes / n, 0.08, 0.01 + 4 * std::sqrt(0.08 / n));  // some hit the wall
}

TEST(LidarWatch, WaitsForTheFirstScan) {
  LidarWatch watch{LidarWatchConfig{}};
  EXPECT_FALSE(watch.update(10 * kNanosecondsPerSecond));
  EXPECT_EQ(watch.silent_s(10 * kNanosecondsPerSecond), 0);
}

TEST(LidarWatch, TellsOneThatHasBeenDeadFromTheStart) {
  LidarWatch watch{LidarWatchConfig{}};
  watch.expect(3 * kNanosecondsPerSecond);
  EXPECT_FALSE(watch.update(3 * kNanosecondsPerSecond));
  EXPECT_EQ(watch.update(4 * kNanosecondsPerSecond), "lidar silent");
  EXPECT_EQ(watch.silent_s(4 * kNanosecondsPerSecond), 1);
}

}  // namespace
}  // namespace arex
