#include <gtest/gtest.h>

#include "run/simulation.h"
#include "support/temporary_folder.h"

namespace arex::sim {
namespace {

// A clearing and a cleared way through a small forest, straight legs, on LiDAR-inertial odometry.
constexpr const char* kLegs = R"(
world:
  kind: forest
  forest:
    size_m: [30, 26]
    clearings: [{centre_m: [6, 0], radius_m: 1.5}]
    corridors: [{points_m: [[0, 0], [8, 0], [8, 5]], width_m: 3}]
mapping: {enabled: false, use_depth: false}
mission: {kind: waypoints, waypoints_m: [[4, 0, 1.5]], max_time_s: 60}
)";

// The planner on the oracle's pose, before a wall of pillars.
const std::vector<std::string> kFast{"mapping.use_depth=false", "odometry.source=mocap"};

FlightResult fly(Scenario scenario) {
  Simulation simulation(scenario, 2);
  while (simulation.tick()) {
  }
  return simulation.finish();
}

FlightResult fly_legs(const std::vector<std::string>& overrides) {
  const test::TemporaryFolder folder;
  test::write_text(folder / "legs.yaml", kLegs);
  return fly(load_scenario(folder / "legs.yaml", overrides, 3));
}

FlightResult fly_gaps(std::vector<std::string> overrides) {
  overrides.insert(overrides.end(), kFast.begin(), kFast.end());
  return fly(load_scenario(AREX_SOURCE_DIR "/scenarios/gaps.yaml", overrides, 1));
}

// Carried off by the wind, it has nothing to come back to: the flight ends there, not when its time
// is over, far out or far below.
TEST(Lost, WhereNothingIsTheFlightEnds) {
  for (const char* wind : {"[16, 0, 0]", "[18, 0, 0]"}) {
    const FlightResult result = fly(
        load_scenario(AREX_SOURCE_DIR "/scenarios/blind_legs.yaml",
                      {std::string("physics.wind.mean_mps=") + wind,
                       "control.position_gain=[0.5, 0.5, 12]", "control.velocity_gain=[1, 1, 7.8]",
                       "control.observe_disturbance=false", "mission.max_time_s=300"},
                      1));
    EXPECT_EQ(result.outcome, Outcome::kLost) << result.reason;
    EXPECT_EQ(result.reason, "left the world after out of control");
    EXPECT_LT(to_seconds(result.duration), 120);
  }
}

TEST(Ready, ALidarThatComesLateIsWaitedFor) {
  for (const char* silence : {"0.7", "1.1", "2.6", "9"}) {
    const FlightResult result = fly_legs({std::string("lidar.fault_silent_for_s=") + silence});
    EXPECT_EQ(result.outcome, Outcome::kSucceeded) << silence << ": " << result.reason;
    EXPECT_LT(result.flight.odometry.ate_rmse_m, 0.05) << silence;
  }
}

TEST(Ready, WhatNeverComesIsNamed) {
  const auto expect = [](const std::vector<std::string>& overrides, const std::string& reason) {
    const FlightResult result = fly_legs(overrides);
    EXPECT_EQ(result.outcome, Outcome::kStuck);
    EXPECT_EQ(result.reason, reason) << overrides.front();
    EXPECT_LT(to_seconds(result.duration), 30);
    EXPECT_LT(result.flight.distance_m, 0.1);
  };
  expect({"lidar.fault_silent_for_s=1000"}, "not_ready: no_scan");
  // Scans come, with a false alarm or two in them.
  expect({"lidar.fault_dropout_fraction=1"}, "not_ready: nothing_to_register");
  expect({"imu.gyro_bias_sigma_radps=0.15"}, "not_ready: gyro_bias");
  expect({"world.kind=empty"}, "not_ready: nothing_to_register");
}

TEST(Stuck, AWallWithoutAWayThroughIsNotFlownOver) {
  const FlightResult result = fly_gaps({"world.gaps.gap_m=0.5", "world.gaps.width_m=10"});
  EXPECT_EQ(result.outcome, Outcome::kStuck);
  EXPECT_EQ(result.reason, "no_path");
  EXPECT_EQ(result.collisions, 0);
}

TEST(Stuck, AGoalInAWallIsGivenUpAndTheRestFlown) {
  const FlightResult result = fly_gaps({"mission.waypoints_m=[[10, -3, 1.5], [0, 0, 1.5]]"});
  EXPECT_EQ(result.outcome, Outcome::kStuck);
  EXPECT_FALSE(result.reason.empty());
  EXPECT_EQ(result.targets.size(), 1U);  // home
  EXPECT_LT(to_seconds(result.duration), 75);
}

/// Flies to a goal on an oracle whose origin jumps aside on the way. @return the fastest true speed
/// within two seconds after it.
double speed_after_jump(const std::vector<std::string>& more, FlightResult& result) {
  const test::TemporaryFolder folder;
  test::write_text(folder / "jump.yaml", R"(
world:
  kind: forest
  forest:
    size_m: [40, 26]
    corridors: [{points_m: [[0, 0], [14, 0]], width_m: 5}]
mission: {kind: goals, waypoints_m: [[14, 0, 1.5]], max_time_s: 60}
mocap: {fault_jump_from_s: 9, fault_jump_m: [-1.0, 1.5, 0]}
)");
  std::vector<std::string> overrides = kFast;
  overrides.insert(overrides.end(), more.begin(), more.end());
  Simulation simulation(load_scenario(folder / "jump.yaml", overrides, 1), 2);
  double fastest = 0;
  while (simulation.tick()) {
    const double t = to_seconds(simulation.now());
    if (t > 9 && t < 11) fastest = std::max(fastest, simulation.truth().v_WB.norm());
  }
  result = simulation.finish();
  return fastest;
}

TEST(Jump, TheMapAroundAndTheWayThroughItBeginAnew) {
  FlightResult result;
  const double heeded = speed_after_jump({}, result);
  EXPECT_EQ(result.outcome, Outcome::kSucceeded) << result.reason;
  EXPECT_EQ(result.collisions, 0);
  EXPECT_LT(heeded, 2.2);  // planning.max_speed_mps is 2
  // What the same jump does to a stack that takes no notice: it lurches to where the plan now lies.
  EXPECT_GT(speed_after_jump({"odometry.jump_m=100"}, result), heeded + 0.5);
}

}  // namespace
}  // namespace arex::sim
