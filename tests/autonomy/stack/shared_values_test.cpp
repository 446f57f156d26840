#include <gtest/gtest.h>

#include "stack/stack_config.h"

namespace arex {
namespace {

// Modules that stand alone in tests and benchmarks fly with the numbers that the stack hands them.
TEST(SharedValues, TheModulesOwnDefaultsAreThoseHandedDown) {
  const StackConfig own;
  const StackConfig shared = with_shared_values(own);
  EXPECT_EQ(shared.planning.local.vehicle_radius_m, own.planning.local.vehicle_radius_m);
  EXPECT_EQ(shared.planning.replan.degenerate_speed_mps, own.planning.replan.degenerate_speed_mps);
  EXPECT_EQ(shared.planning.guide.obstacle_distance_m, own.planning.guide.obstacle_distance_m);
  EXPECT_EQ(shared.planning.guide.comfort_distance_m, own.planning.guide.comfort_distance_m);
  const ExplorerConfig &given = shared.exploration.explorer, &alone = own.exploration.explorer;
  EXPECT_EQ(given.space.travel_radius_m, alone.space.travel_radius_m);
  EXPECT_EQ(given.viewpoint.clearance_m, alone.viewpoint.clearance_m);
  EXPECT_EQ(given.viewpoint.standoff_m, alone.viewpoint.standoff_m);
  EXPECT_EQ(given.stop.return_home, alone.stop.return_home);
  EXPECT_EQ(given.stop.return_speed_mps, alone.stop.return_speed_mps);
}

TEST(SharedValues, TheInflationMovesWhatAllOfThemTakeForPassable) {
  for (const double inflation : {0.1, 0.3, 0.75, 2.0}) {
    StackConfig config;
    config.planning.inflation_m = inflation;
    const StackConfig shared = with_shared_values(config);
    const ExplorerConfig& explorer = shared.exploration.explorer;
    EXPECT_EQ(explorer.space.travel_radius_m, inflation);
    EXPECT_NEAR(explorer.viewpoint.clearance_m, inflation + 0.15, 1e-12);
    EXPECT_NEAR(explorer.viewpoint.standoff_m, inflation + 0.1, 1e-12);
    EXPECT_NEAR(shared.planning.guide.obstacle_distance_m, inflation + 0.1, 1e-12);
    EXPECT_GE(shared.planning.guide.comfort_distance_m, shared.planning.guide.obstacle_distance_m);
  }
}

TEST(SharedValues, OneRadiusOneSensorModelOneWayHomeOneCaution) {
  StackConfig config;
  config.vehicle.radius_m = 0.4;
  config.mapping.local.sensor.hit_probability = 0.8;
  config.mission.land_at_start = MissionConfig::LandAtStart::kFalse;
  config.caution.degenerate_speed_fraction = 0.25;
  config.planning.local.max_speed_mps = 1.6;
  const StackConfig shared = with_shared_values(config);
  EXPECT_EQ(shared.planning.local.vehicle_radius_m, 0.4);
  EXPECT_NEAR(shared.vehicle.own_returns_m(), 0.505, 1e-12);
  EXPECT_EQ(shared.mapping.global.sensor.hit_probability, 0.8);
  EXPECT_FALSE(shared.exploration.explorer.stop.return_home);
  EXPECT_NEAR(shared.planning.replan.degenerate_speed_mps, 0.4, 1e-12);
  EXPECT_NEAR(shared.exploration.explorer.stop.return_speed_mps, 0.8, 1e-12);
}

}  // namespace
}  // namespace arex
