#include <gtest/gtest.h>

#include "run/simulation.h"

namespace arex::sim {
namespace {

// Odometry, local grid, guide, planner and tracker in one loop: to a goal in the forest that cannot
// be reached in a straight line.
TEST(Goals, ReachesAGoalInTheForestAndKeepsItsDistance) {
  Simulation simulation(
      load_scenario(AREX_SOURCE_DIR "/scenarios/goals.yaml",
                    {"mission.waypoints_m=[[12, 4, 1.5]]", "mapping.use_depth=false"}, 11),
      2);
  while (simulation.tick()) {
  }
  const FlightResult result = simulation.finish();
  EXPECT_EQ(result.outcome, Outcome::kSucceeded) << result.reason;
  EXPECT_EQ(result.collisions, 0);
  ASSERT_EQ(result.targets.size(), 1U);
  for (const double miss : result.flight.target_miss_m) EXPECT_LT(miss, 0.3);
  EXPECT_GT(result.plans.plans, 5);
  EXPECT_GT(result.flight.clearance.min_m, 0.2);
  EXPECT_LT(to_seconds(result.duration), 40.0);  // 13 m at 2 m/s, take-off, landing
}

}  // namespace
}  // namespace arex::sim
