#include "run/perfect_tracking.h"

#include <gtest/gtest.h>

#include "math/random.h"
#include "physics/physics.h"
#include "run/simulation.h"
#include "sim/physics/fixtures.h"

namespace arex::sim {
namespace {

// Gains that do not hold the vehicle, in a wind that would carry it off; sensors do not matter.
const std::vector<std::string> kHopeless{"odometry.source=mocap",
                                         "lidar.enabled=false",
                                         "mapping.use_depth=false",
                                         "control.position_gain=[0.5, 0.5, 12]",
                                         "control.velocity_gain=[1, 1, 7.8]",
                                         "control.observe_disturbance=false",
                                         "physics.wind.mean_mps=[6, 3, 0]",
                                         "mission.max_time_s=200"};

FlightResult fly(std::vector<std::string> overrides, std::uint64_t seed) {
  Simulation simulation(load_scenario(AREX_SOURCE_DIR "/scenarios/waypoints.yaml", overrides, seed),
                        1);
  while (simulation.tick()) {
  }
  return simulation.finish();
}

TEST(PerfectTracking, FliesTheSetpointWhateverBlowsAndWhoeverControls) {
  EXPECT_NE(fly(kHopeless, 1).outcome, Outcome::kSucceeded);
  std::vector<std::string> carried = kHopeless;
  carried.emplace_back("physics.perfect_tracking=true");
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const FlightResult result = fly(carried, seed);
    EXPECT_EQ(result.outcome, Outcome::kSucceeded) << result.reason;
    EXPECT_EQ(result.targets.size(), 6U);
    EXPECT_LT(result.flight.tracking_rmse_m, 0.01);
  }
}

// The rigid body does what is asked of it, in free air, about B's origin and not the centre of
// mass.
TEST(PerfectTracking, TheWrenchGivesTheMotionAskedFor) {
  const worlds::World world = fixtures::floor_world();
  RandomStream random(3, "motions");
  for (int trial = 0; trial < 20; ++trial) {
    Physics physics(PhysicsConfig(), world, Pose{}, 1);
    const Pose X{so3::Exp(random.normal3()), {0, 0, 50}};
    physics.set_state(X, random.normal3(), 0.5 * random.normal3(), {});
    const CarriedMotion asked{3 * random.normal3(), 5 * random.normal3()};
    physics.step({}, asked);
    EXPECT_LT((physics.truth().a_WB - asked.a_WB).norm(), 0.05) << trial;
    EXPECT_LT((physics.truth().alpha_WB_B - asked.alpha_WB_B).norm(), 0.05) << trial;
  }
}

}  // namespace
}  // namespace arex::sim
