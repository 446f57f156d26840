#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "math/so3.h"
#include "support/flown.h"

namespace arex::sim {
namespace {

struct Flown : test::Flown {
  // The largest of what the controller sees, beyond its velocity, where the source changes.
  double step_m = 0, turn_rad = 0;
  int changes = 0;
};

/// What the controller saw from one estimate to the next, beyond how the vehicle moved.
struct Step {
  double time_s, step_m, turn_rad;
};

/// The true poses of a flight, at any stamp of it.
class TruePoses {
 public:
  void add(const Truth& truth) { truths_.push_back(truth); }
  [[nodiscard]] Pose at(Stamp stamp) const {
    const auto next = std::lower_bound(truths_.begin(), truths_.end(), stamp,
                                       [](const Truth& truth, Stamp t) { return truth.stamp < t; });
    const Truth& near = next == truths_.end() ? truths_.back() : *next;
    const double dt = to_seconds(stamp - near.stamp);
    return {near.X_WB.R * so3::Exp(dt * near.w_WB_B), near.X_WB.p + dt * near.v_WB};
  }

 private:
  std::vector<Truth> truths_;
};

Flown fly(const std::string& scenario, const std::vector<std::string>& overrides,
          std::uint64_t seed = 1) {
  std::vector<Step> steps;
  TruePoses truth;
  Odometry before;
  const auto look = [&](const Simulation& simulation) {
    truth.add(simulation.truth());
    const Odometry now = simulation.view().odometry;
    if (now.stamp <= before.stamp) return;
    if (before.stamp > 0) {
      const Pose expected = before.X_OB * (truth.at(before.stamp).inverse() * truth.at(now.stamp));
      steps.push_back({to_seconds(now.stamp), (now.X_OB.p - expected.p).norm(),
                       so3::angle(expected.R.transpose() * now.X_OB.R)});
    }
    before = now;
  };
  Flown flown{test::fly(
      load_scenario(AREX_SOURCE_DIR "/scenarios/" + scenario + ".yaml", overrides, seed), 2, look)};
  // A change is told with the stamp of the first estimate of the new source, or a little later.
  constexpr double kTold_s = 0.05;
  std::istringstream events(flown.events);
  for (std::string line; std::getline(events, line);) {
    if (line.find("takes over from") == std::string::npos) continue;
    ++flown.changes;
    const double told_s = std::stod(line);
    for (const Step& step : steps) {
      if (std::abs(step.time_s - told_s) > kTold_s) continue;
      flown.step_m = std::max(flown.step_m, step.step_m);
      flown.turn_rad = std::max(flown.turn_rad, step.turn_rad);
    }
  }
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
  EXPECT_TRUE(flown.told("odometry visual_inertial takes over from lidar_inertial"));
  EXPECT_TRUE(flown.told("odometry lidar_inertial takes over from visual_inertial"));
  EXPECT_EQ(flown.changes, 2);
  EXPECT_GT(flown.step_m, 0);
  EXPECT_LT(flown.step_m, 0.03);
  EXPECT_LT(flown.turn_rad, 0.3 * std::numbers::pi / 180);
  EXPECT_FALSE(flown.told("mission_state,lost"));
  EXPECT_LT(flown.result.flight.odometry.ate_max_m, 0.5);
}

// At the bottom of the ramp there is no light at all.
TEST(VisualFlight, SaysThatItSeesNothingInTheDark) {
  const Flown flown =
      fly("garage_waypoints", {"odometries={vio: {type: visual_inertial}}",
                               "infrared.light.lamps=false", "mission.max_time_s=55"});
  EXPECT_TRUE(flown.told("sensor_fault,visual odometry degenerate: few tracks"));
  EXPECT_TRUE(flown.told("sensor_fault,visual odometry lost"));
  EXPECT_GT(flown.result.flight.others.at("vio").lost_s, 1);
}

// Close above the ground, at take-off, odd tracks made a sound camera's clock seem 30 ms off for a
// while.
TEST(VisualFlight, TellsNothingOfASoundCamera) {
  const Flown flown =
      fly("forest_small", {"odometry.source=visual_inertial", "mission.max_time_s=12"}, 12);
  EXPECT_EQ(flown.result.outcome, Outcome::kTimedOut) << flown.result.reason;
  EXPECT_FALSE(flown.told("camera clock"));
  EXPECT_FALSE(flown.told("camera mount"));
}

}  // namespace
}  // namespace arex::sim
