#include <gtest/gtest.h>

#include "run/simulation.h"

namespace arex::sim {
namespace {

FlightResult fly(std::uint64_t seed, int threads, std::vector<std::string> settings = {}) {
  settings.emplace_back("mission.max_time_s=8");
  const Scenario scenario =
      load_scenario(AREX_SOURCE_DIR "/scenarios/waypoints.yaml", settings, seed);
  Simulation simulation(scenario, threads);
  while (simulation.tick()) {
  }
  return simulation.finish();
}

TEST(Determinism, ARunIsTheSameForAnyNumberOfThreadsAndOtherForAnotherSeed) {
  const FlightResult reference = fly(1, 1);
  EXPECT_GT(reference.flight.distance_m, 1.5);  // it flies, LiDAR and depth running
  for (const int threads : {1, 2, 4}) {
    const FlightResult again = fly(1, threads);
    EXPECT_EQ(again.trajectory_hash, reference.trajectory_hash) << threads << " threads";
    EXPECT_EQ(again.sensor_hash, reference.sensor_hash) << threads << " threads";
  }
  const FlightResult other = fly(2, 2);
  EXPECT_NE(other.trajectory_hash, reference.trajectory_hash);
  EXPECT_NE(other.sensor_hash, reference.sensor_hash);
}

// Of frames that are no multiple of the parts they are cast in, and of a slower device.
TEST(Determinism, FramesOfAnyLengthArrive) {
  for (const std::string rate : {"8", "20", "40"}) {
    const FlightResult alone = fly(1, 1, {"lidar.rate_hz=" + rate});
    EXPECT_GT(alone.flight.distance_m, 1.5) << rate;
    EXPECT_EQ(fly(1, 2, {"lidar.rate_hz=" + rate}).sensor_hash, alone.sensor_hash) << rate;
  }
}

}  // namespace
}  // namespace arex::sim
