#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "support/flown.h"

namespace arex::sim {
namespace {

/// The flight on its own odometry.
struct Flown : test::Flown {
  double degenerate_s = 0;  ///< in the air
};

Flown fly(const std::string& scenario, std::vector<std::string> overrides) {
  overrides.emplace_back("mapping.use_depth=false");
  double degenerate_s = 0;
  const auto look = [&](const Simulation& simulation) {
    const bool degenerate = simulation.view().odometry.status == OdometryStatus::kDegenerate;
    if (degenerate) degenerate_s += to_seconds(kNanosecondsPerTick);
  };
  const test::Flown flown = test::fly(
      load_scenario(AREX_SOURCE_DIR "/scenarios/" + scenario + ".yaml", overrides, 1), 1, look);
  return {flown, degenerate_s};
}

void expect_arrival(const FlightResult& result) {
  EXPECT_EQ(result.outcome, Outcome::kSucceeded) << result.reason;
  EXPECT_EQ(result.collisions, 0);
  EXPECT_EQ(result.flight.odometry_lost_s, 0);
}

TEST(OdometryFlight, GoesDownTheRampAndAlongTheGarage) {
  const Flown flown = fly("garage_waypoints", {});
  expect_arrival(flown.result);
  EXPECT_GT(flown.result.flight.distance_m, 150);
  const OdometryScore& score = flown.result.flight.odometry;
  // Aligned at the start: what a scan from the ground leaves of the map's tilt, below a
  // milliradian, 90 m away. The shape of the flight knows nothing of it.
  EXPECT_LT(score.ate_rmse_m, 0.08);
  EXPECT_LT(score.ate_se3_rmse_m, 0.012);
  EXPECT_LT(score.yaw_error_max_deg, 0.4);
  EXPECT_FALSE(flown.told("sensor_fault"));
}

// 0.1 of the returns false for half a second, none at all for one second, a fifth gone throughout.
TEST(OdometryFlight, OutlivesFaultsOfTheLidarAndTellsThem) {
  const Flown flown =
      fly("waypoints",
          {"mission.waypoints_m=[[15, -2, 1.5], [0, 0, 1.5]]", "lidar.fault_dropout_fraction=0.2",
           "lidar.fault_false_burst_from_s=11", "lidar.fault_false_burst_for_s=0.5",
           "lidar.fault_silent_from_s=16", "lidar.fault_silent_for_s=1"});
  expect_arrival(flown.result);
  EXPECT_LT(flown.result.flight.odometry.ate_max_m, 0.15);
  EXPECT_TRUE(flown.told("sensor_fault,lidar silent"));
  EXPECT_TRUE(flown.told("sensor_fault,lidar returns missing"));
  EXPECT_TRUE(flown.told("sensor_fault,lidar returns false"));
  EXPECT_TRUE(flown.told("odometry_status,degenerate"));
  EXPECT_GT(flown.degenerate_s, 0.5);
}

TEST(OdometryFlight, SpinsFasterThanItsGyroReads) {
  const Flown flown = fly("yaw_burst", {"imu.gyro_range_radps=2.5"});
  expect_arrival(flown.result);
  EXPECT_LT(flown.result.flight.odometry.ate_max_m, 0.1);
  EXPECT_GT(flown.degenerate_s, 5);  // two bursts of four seconds are beyond it
}

}  // namespace
}  // namespace arex::sim
