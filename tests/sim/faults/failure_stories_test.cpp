#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "support/flown.h"

namespace arex::sim {
namespace {

struct Flown : test::Flown {
  [[nodiscard]] bool told_a_fault() const {
    return told("sensor_fault,") || told("vehicle_fault,") || told("vibration,");
  }
};

Flown fly(const Scenario& scenario) {
  return {test::fly(scenario, 2, [](const Simulation&) {})};
}

Flown fly(const std::string& text, const std::vector<std::string>& overrides,
          std::uint64_t seed = 1) {
  const test::TemporaryFolder folder;
  test::write_text(folder / "story.yaml", text);
  return fly(load_scenario(folder / "story.yaml", overrides, seed));
}

Flown fly_file(const std::string& name, const std::vector<std::string>& overrides,
               std::uint64_t seed = 1) {
  return fly(load_scenario(AREX_SOURCE_DIR "/scenarios/" + name + ".yaml", overrides, seed));
}

// Legs on the true pose, no LiDAR: the autopilot alone decides what becomes of a vehicle's fault.
constexpr const char* kBare = R"(
world: {kind: empty}
lidar: {enabled: false}
mapping: {enabled: false, use_depth: false}
odometry: {source: mocap}
mission: {kind: waypoints, waypoints_m: [[6, 0, 1.5], [6, 4, 1.5], [0, 0, 1.5]], max_time_s: 60}
)";

// A cleared way through a small forest, straight legs, on LiDAR-inertial odometry.
constexpr const char* kWood = R"(
world:
  kind: forest
  forest:
    size_m: [30, 26]
    corridors: [{points_m: [[0, 0], [9, 0]], width_m: 3}]
mapping: {enabled: false, use_depth: false}
mission: {kind: waypoints, waypoints_m: [[9, 0, 1.5], [0, 0, 1.5]], max_time_s: 60}
)";

TEST(FailureStories, ASoundVehicleTellsOfNoFault) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Flown flown = fly(kBare, {}, seed);
    EXPECT_EQ(flown.result.outcome, Outcome::kSucceeded);
    EXPECT_FALSE(flown.told_a_fault()) << flown.events;
  }
}

TEST(FailureStories, AWeakMotorIsNamedAndFlownWith) {
  for (const char* loss : {"0.1", "0.3"}) {
    for (int number = 1; number <= 4; ++number) {
      const Flown flown =
          fly(kBare, {"faults=[{device: motor, kind: weak, number: " + std::to_string(number) +
                      ", loss_fraction: " + loss + ", from_s: 8}]"});
      EXPECT_EQ(flown.result.outcome, Outcome::kSucceeded) << loss;
      EXPECT_TRUE(flown.told("vehicle_fault,motor " + std::to_string(number) + " weak"))
          << loss << ": " << flown.events;
      for (int other = 1; other <= 4; ++other) {
        EXPECT_EQ(flown.told("motor " + std::to_string(other) + " weak"), other == number);
      }
    }
  }
}

TEST(FailureStories, AStoppedMotorFallsButIsTold) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Flown flown =
        fly(kBare, {"faults=[{device: esc, kind: stop, number: 3, from_s: 9}]"}, seed);
    EXPECT_EQ(flown.result.outcome, Outcome::kCollided) << "four rotors, and none to spare";
    EXPECT_LT(flown.events.find("vehicle_fault,"), flown.events.find("collision,")) << flown.events;
    EXPECT_TRUE(flown.result.reason.starts_with("hit ground")) << flown.result.reason;
    EXPECT_TRUE(flown.result.reason.ends_with(" after motor 3 stopped")) << flown.result.reason;
    EXPECT_TRUE(flown.told("finished,collided: " + flown.result.reason)) << flown.events;
  }
}

TEST(FailureStories, AWornCellIsTold) {
  const Flown flown = fly(kBare, {"faults=[{device: battery, kind: weak, from_s: 8}]"});
  EXPECT_EQ(flown.result.outcome, Outcome::kSucceeded);
  EXPECT_TRUE(flown.told("vehicle_fault,battery cell weak")) << flown.events;
}

TEST(FailureStories, AVehicleWithANoisyBarometerNoticesThatItHasLanded) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Flown flown = fly(kBare, {"faults=[{device: barometer, kind: noisy, from_s: 8}]"}, seed);
    EXPECT_EQ(flown.result.outcome, Outcome::kSucceeded) << flown.result.reason;
    EXPECT_TRUE(flown.told("sensor_fault,barometer noisy")) << flown.events;
  }
}

// One that is silent leaves its last reading in the nine axes.
TEST(FailureStories, AMagnetometersFaultsAreToldByAutopilotAndStack) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    for (const auto& [kind, in_nine_axes] :
         {std::pair("stuck", "stuck"), {"silent", "stuck"}, {"noisy", "noisy"}}) {
      const Flown flown = fly(
          kBare, {std::string("faults=[{device: magnetometer, from_s: 8, kind: ") + kind + "}]"},
          seed);
      EXPECT_EQ(flown.result.outcome, Outcome::kSucceeded) << flown.result.reason;
      EXPECT_TRUE(flown.told(std::string("sensor_fault,magnetometer ") + kind)) << flown.events;
      EXPECT_TRUE(flown.told(std::string("sensor_fault,imu's magnetometer ") + in_nine_axes))
          << kind << ": " << flown.events;
    }
  }
}

TEST(FailureStories, ACameraThatIsBlindedByAFifthIsTold) {
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    const auto told = [&](const std::vector<std::string>& more) {
      std::vector<std::string> overrides{"mapping.enabled=true", "mapping.use_depth=true"};
      overrides.insert(overrides.end(), more.begin(), more.end());
      return fly(kWood, overrides, seed).told("sensor_fault,depth blinded in part");
    };
    EXPECT_FALSE(told({})) << seed;
    EXPECT_TRUE(told({"faults=[{device: depth, kind: blinded, share: 0.2, from_s: 8.5}]"})) << seed;
  }
}

TEST(FailureStories, ASilentLidarLands) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Flown flown = fly(kWood, {"faults=[{device: lidar, kind: silent, from_s: 8.5}]"}, seed);
    EXPECT_EQ(flown.result.outcome, Outcome::kStuck) << flown.result.reason;
    EXPECT_EQ(flown.result.reason, "lidar silent");
    EXPECT_EQ(flown.result.collisions, 0);
    EXPECT_TRUE(flown.told("sensor_fault,lidar silent"));
    EXPECT_TRUE(flown.told("disarmed"));
  }
}

TEST(FailureStories, ALidarThatComesBackIsWaitedFor) {
  const Flown flown =
      fly(kWood, {"faults=[{device: lidar, kind: silent, from_s: 8.5, to_s: 10.3}]"});
  EXPECT_EQ(flown.result.outcome, Outcome::kSucceeded) << flown.result.reason;
  EXPECT_TRUE(flown.told("recovery,lidar silent: comes to rest"));
  EXPECT_TRUE(flown.told("recovery,lidar is back: goes on"));
  EXPECT_EQ(flown.result.targets.size(), 2U);
}

TEST(FailureStories, ALidarThatHangsIsNoOneToBelieve) {
  const Flown flown = fly(kWood, {"faults=[{device: lidar, kind: stuck, from_s: 8.5}]"});
  EXPECT_EQ(flown.result.outcome, Outcome::kStuck) << flown.result.reason;
  EXPECT_EQ(flown.result.collisions, 0);
  EXPECT_TRUE(flown.told("sensor_fault,lidar stuck"));
}

// The rate loop hears the mode and drives it: the softer and the less damped, the more.
TEST(FailureStories, AWeakFrameThatResonatesIsNoticedAndAStiffOneIsNot) {
  const auto on_frame = [](const char* ratio, const char* hz, const char* damping) {
    return fly(kBare, {std::string("physics.frame.load_ratio=") + ratio,
                       std::string("physics.frame.mode_hz=") + hz,
                       std::string("physics.frame.mode_damping=") + damping});
  };
  const Flown stiff = on_frame("0", "60", "0.01");
  EXPECT_EQ(stiff.result.outcome, Outcome::kSucceeded);
  EXPECT_FALSE(stiff.told("vibration,")) << stiff.events;

  const Flown at_rotors = on_frame("1.5", "115", "0.01");  // which turn at 110 to 120 Hz
  EXPECT_EQ(at_rotors.result.outcome, Outcome::kSucceeded) << "shaken, but not driven";
  EXPECT_TRUE(at_rotors.told("vibration,\"autopilot: gyro")) << at_rotors.events;

  const Flown driven = on_frame("1.5", "60", "0.01");
  EXPECT_NE(driven.result.outcome, Outcome::kSucceeded);
  EXPECT_TRUE(driven.result.targets.empty()) << "it does not get off the ground in order";
  ASSERT_TRUE(driven.told("vibration,\"")) << driven.events;
  EXPECT_LT(driven.events.find("vibration,\""), driven.events.find("finished,"));
  EXPECT_TRUE(driven.told(" Hz, accelerometer"));

  // The battery's readings swing first, 20 ms before what swings them is told.
  const Flown slow =
      fly_file("weak_frame", {"physics.frame.mode_hz=45", "physics.frame.mode_damping=0.03"});
  EXPECT_TRUE(slow.told("power noisy")) << slow.events;
  EXPECT_EQ(slow.result.reason, "takeoff: height not reached: vibration");
}

// The paper's three inflations: 0.1 touches, 0.5 passes, and in 0.75 it takes itself for trapped.
TEST(FailureStories, TooLittleInflationTouches) {
  const Flown flown = fly_file(
      "inflation", {"planning.inflation_m=0.1", "odometry.source=mocap", "mapping.use_depth=false"},
      101);
  EXPECT_EQ(flown.result.outcome, Outcome::kCollided) << flown.result.reason;
}

TEST(FailureStories, InflationThatClosesAroundTheVehicleTrapsThePapersProgram) {
  const auto hover = [](const char* inflation, const char* recovers) {
    return fly_file("trapped", {std::string("planning.inflation_m=") + inflation,
                                std::string("planning.replan.recovers=") + recovers,
                                "odometry.source=mocap", "mapping.use_depth=false"});
  };
  const Flown half = hover("0.5", "true");
  EXPECT_EQ(half.result.outcome, Outcome::kSucceeded) << half.result.reason;
  const Flown trapped = hover("0.75", "false");
  EXPECT_EQ(trapped.result.outcome, Outcome::kStuck);
  EXPECT_EQ(trapped.result.reason, "start_in_inflation");
  EXPECT_EQ(trapped.result.collisions, 0);
}

// A gyro that reads less than the vehicle turns leaves the turn to the LiDAR alone.
TEST(FailureStories, ASpinCostsTheOdometryItsCertainty) {
  const auto degenerate = [](const char* rate) {
    const Flown flown =
        fly_file("yaw_burst",
                 {std::string("mission.yaw_rates_radps=[") + rate + "]", "mission.yaw_burst_s=3",
                  "mapping.use_depth=false", "imu.gyro_range_radps=2"});
    EXPECT_EQ(flown.result.outcome, Outcome::kSucceeded) << rate << ": " << flown.result.reason;
    const std::string word = "odometry_status,degenerate";
    int count = 0;
    for (std::size_t at = flown.events.find(word); at != std::string::npos;
         at = flown.events.find(word, at + 1)) {
      ++count;
    }
    return std::pair(count, flown.result.flight.odometry.yaw_error_max_deg);
  };
  const auto [slow_count, slow_yaw] = degenerate("1");
  const auto [fast_count, fast_yaw] = degenerate("3.4");
  EXPECT_GT(fast_count, slow_count);
  EXPECT_GT(fast_yaw, 2 * slow_yaw);
}

}  // namespace
}  // namespace arex::sim
