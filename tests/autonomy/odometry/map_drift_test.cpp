#include "odometry/map_drift.h"

#include <gtest/gtest.h>

#include "math/random.h"

namespace arex {
namespace {

const PoseCovariance kScan = 1e-6 * PoseCovariance::Identity();

TEST(MapDrift, GrowsByEveryRegistrationOnTheOneBefore) {
  MapDrift drift;
  drift.add_first();
  for (int scan = 1; scan <= 50; ++scan) {
    const std::vector<int> born(20, drift.next() - 1);
    drift.add(drift.met(born), kScan);
  }
  EXPECT_NEAR(drift.met(std::vector<int>{50}).covariance(0, 0), 50 * kScan(0, 0), 1e-12);
}

TEST(MapDrift, IsGoneWhereTheVehicleReturns) {
  MapDrift drift;
  drift.add_first();
  for (int scan = 1; scan <= 50; ++scan) drift.add(drift.met(std::vector<int>{scan - 1}), kScan);
  EXPECT_TRUE(drift.met(std::vector<int>{0, 0, 0}).covariance.isZero());
  EXPECT_NEAR(drift.met(std::vector<int>{0, 50}).covariance(3, 3), 25 * kScan(3, 3), 1e-12);
  EXPECT_TRUE(drift.met({}).covariance.isZero());
  EXPECT_EQ(drift.met({}).age, 1);
}

// Errors drawn for a vehicle that always sees the last few insertions: the map is off by the mean
// of theirs, and grows by the scan's own.
TEST(MapDrift, IsThatOfAChainOfScans) {
  constexpr int kScans = 300, kRuns = 1000;
  for (const int seen : {1, 4, 15}) {
    const auto born_of = [&](int scan) {
      std::vector<int> born;
      for (int back = 1; back <= seen; ++back) born.push_back(std::max(0, scan - back));
      return born;
    };
    MapDrift drift;
    drift.add_first();
    for (int scan = 1; scan <= kScans; ++scan) {
      drift.add(drift.met(born_of(scan)), PoseCovariance::Identity());
    }
    double variance = 0;
    for (int run = 0; run < kRuns; ++run) {
      RandomStream random(static_cast<std::uint64_t>(run), "drift");
      std::vector<double> error{0};
      for (int scan = 1; scan <= kScans; ++scan) {
        double met = random.normal();
        for (const int i : born_of(scan)) met += error[static_cast<std::size_t>(i)] / seen;
        error.push_back(met);
      }
      double met = 0;
      for (const int i : born_of(kScans + 1)) met += error[static_cast<std::size_t>(i)] / seen;
      variance += met * met / kRuns;
    }
    const double predicted = drift.met(born_of(kScans + 1)).covariance(0, 0);
    EXPECT_NEAR(predicted / variance, 1, 0.25) << seen;
  }
}

}  // namespace
}  // namespace arex
