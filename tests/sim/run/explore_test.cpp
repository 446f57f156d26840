#include <gtest/gtest.h>

#include "run/simulation.h"

namespace arex::sim {
namespace {

FlightResult explore(const std::vector<std::string>& overrides, std::uint64_t seed, int threads) {
  Simulation simulation(
      load_scenario(AREX_SOURCE_DIR "/scenarios/forest_small.yaml", overrides, seed), threads);
  while (simulation.tick()) {
  }
  return simulation.finish();
}

// The whole main job on its own odometry: explore, come home, land.
TEST(Explore, ASmallForestIsExploredAndTheVehicleComesHome) {
  const FlightResult result = explore({}, 1, 2);
  EXPECT_EQ(result.outcome, Outcome::kSucceeded) << result.reason;
  EXPECT_EQ(result.collisions, 0);
  ASSERT_TRUE(result.coverage.has_value());
  EXPECT_GE(result.coverage->area_fraction, 0.97);
  EXPECT_GE(result.coverage->surface_fraction, 0.85);
  ASSERT_FALSE(result.targets.empty());
  EXPECT_LT(result.targets.back().p_O.head<2>().norm(), 0.1);  // home
  EXPECT_LT(result.flight.landing_error_m, 0.5);
  EXPECT_GT(result.battery.state_of_charge, 0.2);  // the reserve is kept
}

// Every module runs, and what they do depends on their jobs' results: the hash must not depend on
// the threads that ran them.
TEST(Explore, IsTheSameForAnyNumberOfThreads) {
  const std::vector<std::string> short_flight{"mission.max_time_s=20"};
  const FlightResult reference = explore(short_flight, 2, 1);
  EXPECT_GT(reference.plans, 0);
  for (const int threads : {2, 4}) {
    const FlightResult again = explore(short_flight, 2, threads);
    EXPECT_EQ(again.trajectory_hash, reference.trajectory_hash) << threads << " threads";
    EXPECT_EQ(again.sensor_hash, reference.sensor_hash) << threads << " threads";
  }
}

}  // namespace
}  // namespace arex::sim
