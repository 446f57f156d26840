#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numbers>

#include "run/simulation.h"

namespace arex::sim {
namespace {

FlightResult fly(const std::string& scenario, std::uint64_t seed, int threads,
                 const std::vector<std::string>& overrides = {}) {
  Simulation simulation(
      load_scenario(AREX_SOURCE_DIR "/scenarios/" + scenario + ".yaml", overrides, seed), threads);
  while (simulation.tick()) {
  }
  return simulation.finish();
}

// A whole mission on one thread; both tests of a scenario look at the same flight.
const FlightResult& reference(const std::string& scenario) {
  static std::map<std::string, FlightResult> flights;
  auto flight = flights.find(scenario);
  if (flight == flights.end()) flight = flights.emplace(scenario, fly(scenario, 1, 1)).first;
  return flight->second;
}

void expect_explored(const FlightResult& result, double area_fraction, double surface_fraction) {
  EXPECT_EQ(result.outcome, Outcome::kSucceeded) << result.reason;
  EXPECT_EQ(result.collisions, 0);
  ASSERT_TRUE(result.coverage.has_value());
  EXPECT_GE(result.coverage->area_fraction, area_fraction);
  EXPECT_GE(result.coverage->surface_fraction, surface_fraction);
  EXPECT_GT(result.battery.state_of_charge, 0.2);  // the reserve is kept
  EXPECT_GT(result.exploration.issued, 3);
  // It stopped because nothing was left to see that fills the disc of f_I.
  EXPECT_NE(result.exploration.stop_reason, StopReason::kBattery);
  const double radius = SpaceConfig{}.information_radius_m;
  EXPECT_LT(result.exploration.open_frontier_m2.value(), std::numbers::pi * radius * radius);
  ASSERT_TRUE(result.flight.landing.has_value());
  EXPECT_TRUE(result.flight.landing->on_floor);
  EXPECT_GT(result.flight.landing->clearance_m, LandingConfig{}.margin_m);
}

TEST(Explore, ASmallForestIsExploredAndTheVehicleComesHome) {
  const FlightResult& result = reference("forest_small");
  expect_explored(result, 0.97, 0.85);
  ASSERT_FALSE(result.targets.empty());
  EXPECT_LT(result.targets.back().p_O.head<2>().norm(), 0.1);  // home
  EXPECT_LT(result.flight.landing_error_m, 0.5);
}

TEST(Explore, ASmallGarageIsExploredDownItsRamp) {
  const FlightResult& result = reference("garage_small");
  expect_explored(result, 0.90, 0.7);
  // Down below most of the time; it may look into the yard again before it lands.
  const auto below = std::count_if(result.flight.poses.begin(), result.flight.poses.end(),
                                   [](const auto& pose) { return pose.X_OB.p.z() < -6; });
  EXPECT_GT(below, static_cast<long>(result.flight.poses.size() / 2));
}

// A triangle of the small forest: what is scored is what is explored, not the box around it, which
// is twice as large.
TEST(Explore, APolygonIsExploredWhole) {
  const FlightResult result =
      fly("forest_small", 1, 2, {"exploration.bounds.polygon_m=[[-11, -9], [11, -9], [0, 9]]"});
  EXPECT_EQ(result.outcome, Outcome::kSucceeded) << result.reason;
  EXPECT_EQ(result.collisions, 0);
  ASSERT_TRUE(result.coverage.has_value());
  EXPECT_GE(result.coverage->area_fraction, 0.97);
  EXPECT_LT(result.coverage->area_m2, 0.5 * 22 * 18);
  EXPECT_GT(result.coverage->area_m2, 0.8 * 0.5 * 22 * 18);  // trees stand on the rest
}

// The explorer reads off the voltage that the battery is not full, and turns back for it.
TEST(Explore, ComesHomeForTheBatteryWithTheReserve) {
  const FlightResult result =
      fly("forest_small", 1, 2, {"physics.battery.initial_state_of_charge=0.28"});
  EXPECT_EQ(result.outcome, Outcome::kSucceeded) << result.reason;
  EXPECT_EQ(result.exploration.stop_reason, StopReason::kBattery);
  EXPECT_LT(result.targets.back().p_O.head<2>().norm(), 0.1);
  EXPECT_GT(result.battery.state_of_charge, 0.2);
}

// Every module runs, and what they do depends on their jobs' results: the hash must not depend on
// the threads that ran them.
TEST(Explore, IsTheSameForAnyNumberOfThreads) {
  for (const char* scenario : {"forest_small", "garage_small"}) {
    for (const int threads : {2, 4}) {
      const FlightResult again = fly(scenario, 1, threads);
      EXPECT_EQ(again.trajectory_hash, reference(scenario).trajectory_hash)
          << scenario << ", " << threads << " threads";
      EXPECT_EQ(again.sensor_hash, reference(scenario).sensor_hash)
          << scenario << ", " << threads << " threads";
    }
  }
}

}  // namespace
}  // namespace arex::sim
