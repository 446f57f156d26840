#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "math/so3.h"
#include "recorded_flight.h"
#include "support/analytic_world.h"

// What the odometry does before take-off, while its sensors come late, stop or see nothing.
namespace arex {
namespace {

using namespace test;

LidarScanPtr without_returns(const LidarScanPtr& scan) {
  auto none = std::make_shared<LidarScan>(*scan);
  none->points.clear();
  return none;
}

/// Whether the estimate is ok at the end and has held the place where it stands.
void expect_a_sound_start(const Recording& r, const Flown& run, const std::string& what) {
  EXPECT_EQ(run.fast.back().status, OdometryStatus::kOk) << what;
  EXPECT_EQ(run.need, OdometryNeed::kNothing) << what;
  EXPECT_LT(position_error(r, run.fast.back().stamp, run.fast.back().X_OB.p), 0.01) << what;
}

Recording first_seconds_of_standing(double seconds) {
  Recording r = standing();
  std::erase_if(r.imu, [&](const ImuSample& s) { return s.stamp > from_seconds(seconds); });
  std::erase_if(r.scans, [&](const LidarScanPtr& s) { return s->end > from_seconds(seconds); });
  return r;
}

TEST(LidarInertialOdometry, StartsOnlyWithAMapToRegisterAgainst) {
  const Recording r = first_seconds_of_standing(8);
  for (const double silent_s : {0.5, 1.0, 1.1, 1.5, 3.3, 6.0}) {
    for (const bool empty : {false, true}) {  // scans without returns, or none at all
      const Flown run =
          fly(r, defaults(), 20'000'000, [&](const LidarScanPtr& scan) -> LidarScanPtr {
            if (scan->stamp >= from_seconds(silent_s)) return scan;
            return empty ? without_returns(scan) : nullptr;
          });
      for (const Odometry& odometry : run.fast) {
        if (odometry.stamp > from_seconds(std::max(silent_s, 1.0))) break;
        EXPECT_EQ(odometry.status, OdometryStatus::kInitialising);
      }
      EXPECT_EQ(count(run, OdometryStatus::kLost), 0);
      expect_a_sound_start(r, run, std::to_string(silent_s));
    }
  }
}

TEST(LidarInertialOdometry, StartsWhateverComesLateOrStopsBeforeTakeOff) {
  const std::vector<std::pair<double, double>> outages{{0, 2}, {0.4, 1.3}, {1.5, 1.8}, {2, 4}};
  for (const auto& [from_s, to_s] : outages) {
    Recording r = first_seconds_of_standing(8);
    std::erase_if(r.imu, [&, from = from_s, to = to_s](const ImuSample& s) {
      return s.stamp > from_seconds(from) && s.stamp < from_seconds(to);
    });
    expect_a_sound_start(r, fly(r), "no IMU from " + std::to_string(from_s));
    expect_a_sound_start(r,
                         fly(r, defaults(), 20'000'000,
                             [&, from = from_s, to = to_s](const LidarScanPtr& scan) {
                               const bool out =
                                   scan->end > from_seconds(from) && scan->stamp < from_seconds(to);
                               return out ? without_returns(scan) : scan;
                             }),
                         "neither from " + std::to_string(from_s));
  }
}

TEST(LidarInertialOdometry, TakesBackAStartOnFalseReturns) {
  // The map of the start is noise; the true scans contradict it.
  const Recording r = first_seconds_of_standing(8);
  const Flown run = fly(r, defaults(), 20'000'000, [](const LidarScanPtr& scan) -> LidarScanPtr {
    if (scan->stamp >= from_seconds(2)) return scan;
    auto wrong = std::make_shared<LidarScan>(*scan);
    for (LidarPoint& point : wrong->points) {
      // A shell about the device: surfaces that the world does not have.
      point.p_L = 2.5F * point.p_L.normalized();
    }
    return wrong;
  });
  expect_a_sound_start(r, run, "a shell of false returns");
}

TEST(LidarInertialOdometry, NamesWhatItWaitsFor) {
  const Recording r = first_seconds_of_standing(3);
  const auto need_at_end = [&](const std::function<void(Recording&)>& spoil) {
    Recording spoilt = r;
    spoil(spoilt);
    const Flown run = fly(spoilt);
    EXPECT_EQ(run.fast.back().status, OdometryStatus::kInitialising);
    return run.need;
  };
  EXPECT_EQ(need_at_end([](Recording& s) { s.scans.clear(); }), OdometryNeed::kScan);
  EXPECT_EQ(need_at_end([](Recording& s) {
              for (LidarScanPtr& scan : s.scans) scan = without_returns(scan);
            }),
            OdometryNeed::kScan);
  EXPECT_EQ(need_at_end([](Recording& s) {
              for (LidarScanPtr& scan : s.scans) {
                auto few = std::make_shared<LidarScan>(*scan);
                few->points.resize(100);
                scan = few;
              }
            }),
            OdometryNeed::kReference);
  EXPECT_EQ(need_at_end([](Recording& s) {
              for (ImuSample& imu : s.imu) imu.gyro_radps.x() += 0.15;
            }),
            OdometryNeed::kGyroBias);
  EXPECT_EQ(need_at_end([](Recording& s) {
              for (std::size_t i = 0; i < s.imu.size(); ++i) {
                s.imu[i].gyro_radps.y() += i % 2 == 0 ? 0.1 : -0.1;
              }
            }),
            OdometryNeed::kGyroNoise);
  EXPECT_EQ(need_at_end([](Recording& s) {
              for (std::size_t i = 0; i < s.imu.size(); ++i) {
                s.imu[i].accel_mps2.y() += i % 2 == 0 ? 1 : -1;
              }
            }),
            OdometryNeed::kAccelNoise);
  EXPECT_EQ(need_at_end([](Recording& s) {
              for (ImuSample& imu : s.imu) imu.accel_mps2 *= 0.3;
            }),
            OdometryNeed::kAccelMagnitude);
}

// A vehicle that has left the ground keeps its map: it finds itself on it again.
TEST(LidarInertialOdometry, DoesNotStartAgainInTheAir) {
  const Flown run =
      fly(forest(), defaults(), 20'000'000, [](const LidarScanPtr& scan) -> LidarScanPtr {
        return scan->stamp < from_seconds(8) || scan->stamp >= from_seconds(12)
                   ? scan
                   : without_returns(scan);
      });
  bool started = false;
  for (const Odometry& odometry : run.fast) {
    started |= odometry.status == OdometryStatus::kOk;
    if (!started) continue;
    EXPECT_NE(odometry.status, OdometryStatus::kInitialising);
  }
}

}  // namespace
}  // namespace arex
