#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "run/simulation.h"

namespace arex::sim {
namespace {

struct Flown {
  FlightResult result;
  std::string events;         ///< events.csv
  double largest_step_m = 0;  ///< of what the controller sees, beyond its velocity, from take-off
  double largest_turn_rad = 0;
};

Flown fly(const std::string& scenario, const std::vector<std::string>& overrides) {
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) /
      testing::UnitTest::GetInstance()->current_test_info()->name();
  Flown flown;
  Recorder recorder(folder, "");
  Simulation simulation(
      load_scenario(AREX_SOURCE_DIR "/scenarios/" + scenario + ".yaml", overrides, 1), 2);
  simulation.record_to(recorder);
  Odometry before;
  while (simulation.tick()) {
    const FlightView view = simulation.view();
    const Odometry& now = view.odometry;
    if (now.stamp > before.stamp && before.status != OdometryStatus::kInitialising) {
      const double dt = to_seconds(now.stamp - before.stamp);
      flown.largest_step_m =
          std::max(flown.largest_step_m, (now.X_OB.p - before.X_OB.p - dt * before.v_OB).norm());
      const Mat3 turned = before.X_OB.R * so3::Exp(dt * before.w_OB_B);
      flown.largest_turn_rad =
          std::max(flown.largest_turn_rad, so3::angle(turned.transpose() * now.X_OB.R));
    }
    before = now;
  }
  flown.result = simulation.finish();
  recorder.flush();
  std::ostringstream text;
  text << std::ifstream(folder / "events.csv").rdbuf();
  flown.events = text.str();
  return flown;
}

// The paper's story, its first two waypoints: both begin together, the LiDAR stays, the eyes drift.
TEST(VisualFlight, DriftsBesideALidarThatDoesNot) {
  const Flown flown =
      fly("odometry_comparison",
          {"mission.waypoints_m=[[15, -2, 1.5], [22, 13, 1.6]]", "mapping.use_depth=false"});
  ASSERT_EQ(flown.result.outcome, Outcome::kSucceeded) << flown.result.reason;
  const OdometryScore& lidar = flown.result.flight.odometry;
  const SourceScore& vio = flown.result.flight.others.at("vio");
  // Half a percent is asked of 130 m; a third of that way has the whole of its start's errors.
  EXPECT_LT(vio.score.ate_rmse_m, 0.01 * flown.result.flight.distance_m);
  EXPECT_LT(vio.score.yaw_error_max_deg, 3);
  EXPECT_GT(vio.score.ate_rmse_m, 1.5 * lidar.ate_rmse_m);
  EXPECT_EQ(vio.lost_s, 0);
  ASSERT_TRUE(vio.tally);
  EXPECT_GT(vio.tally->tracked, 40 * vio.tally->exposures);
  EXPECT_GT(vio.tally->keyframes, 20);
}

// The LiDAR is silent for 20 s in the middle of an exploration, which waits for it on its eyes.
TEST(VisualFlight, TakesOverFromASilentLidarWithoutAStep) {
  const Flown flown = fly("forest_small", {"odometry.failover=[lidar_inertial, visual_inertial]",
                                           "lidar.fault_silent_from_s=20",
                                           "lidar.fault_silent_for_s=20", "mission.max_time_s=60"});
  EXPECT_EQ(flown.result.outcome, Outcome::kTimedOut) << flown.result.reason;
  EXPECT_EQ(flown.result.flight.odometry_lost_s, 0);
  EXPECT_NE(flown.events.find("odometry visual_inertial takes over from lidar_inertial"),
            std::string::npos);
  EXPECT_NE(flown.events.find("odometry lidar_inertial takes over from visual_inertial"),
            std::string::npos);
  EXPECT_EQ(flown.events.find("mission_state,lost"), std::string::npos);
  EXPECT_LT(flown.result.flight.odometry.ate_max_m, 0.5);
}

// At the bottom of the ramp there is no light at all.
TEST(VisualFlight, SaysThatItSeesNothingInTheDark) {
  const Flown flown =
      fly("garage_waypoints", {"odometries={vio: {type: visual_inertial}}",
                               "infrared.light.lamps=false", "mission.max_time_s=55"});
  EXPECT_NE(flown.events.find("sensor_fault,visual odometry degenerate: few tracks"),
            std::string::npos);
  EXPECT_NE(flown.events.find("sensor_fault,visual odometry lost"), std::string::npos);
  EXPECT_GT(flown.result.flight.others.at("vio").lost_s, 1);
}

}  // namespace
}  // namespace arex::sim
