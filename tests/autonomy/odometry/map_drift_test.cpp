#include "odometry/map_drift.h"

#include <gtest/gtest.h>

#include "math/random.h"

namespace arex {
namespace {

const PoseCovariance kScan = 1e-6 * PoseCovariance::Identity();
const Vec3 kHere = Vec3::Zero();

TEST(MapDrift, GrowsByEveryRegistrationOnTheOneBefore) {
  MapDrift drift;
  drift.add_first();
  for (int scan = 1; scan <= 50; ++scan) {
    const std::vector<int> born(20, drift.next() - 1);
    drift.add(drift.met(born, kHere), kScan, kHere);
  }
  EXPECT_NEAR(drift.met(std::vector<int>{50}, kHere).covariance(0, 0), 50 * kScan(0, 0), 1e-12);
}

TEST(MapDrift, IsGoneWhereTheVehicleReturns) {
  MapDrift drift;
  drift.add_first();
  for (int scan = 1; scan <= 50; ++scan)
    drift.add(drift.met(std::vector<int>{scan - 1}, kHere), kScan, kHere);
  EXPECT_TRUE(drift.met(std::vector<int>{0, 0, 0}, kHere).covariance.isZero());
  EXPECT_NEAR(drift.met(std::vector<int>{0, 50}, kHere).covariance(3, 3), 25 * kScan(3, 3), 1e-12);
  EXPECT_TRUE(drift.met({}, kHere).covariance.isZero());
  EXPECT_EQ(drift.met({}, kHere).age, 1);
}

// A vehicle that flies straight on and errs by its heading alone: each error swings what comes
// after.
TEST(MapDrift, SwingsWhatLiesAhead) {
  constexpr double kStep = 0.2, kHeadingVariance = 1e-8;
  constexpr int kScans = 100;
  PoseCovariance heading = PoseCovariance::Zero();
  heading(2, 2) = kHeadingVariance;
  MapDrift drift;
  drift.add_first();
  double expected = 0;
  for (int scan = 1; scan <= kScans; ++scan) {
    const Vec3 p_OB(kStep * scan, 0, 0);
    drift.add(drift.met(std::vector<int>{scan - 1}, p_OB), heading, p_OB);
    expected += std::pow(kStep * (kScans - scan), 2) * kHeadingVariance;
  }
  const MapDrift::Met met = drift.met(std::vector<int>{kScans}, {kStep * kScans, 0, 0});
  EXPECT_NEAR(met.covariance(4, 4), expected, 1e-9 * expected);
  EXPECT_NEAR(met.covariance(2, 2), kScans * kHeadingVariance, 1e-12);
  EXPECT_EQ(met.covariance(3, 3), 0);
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
      drift.add(drift.met(born_of(scan), kHere), PoseCovariance::Identity(), kHere);
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
    const double predicted = drift.met(born_of(kScans + 1), kHere).covariance(0, 0);
    EXPECT_NEAR(predicted / variance, 1, 0.25) << seen;
  }
}

}  // namespace
}  // namespace arex
