#include "blame/experiments.h"

#include <gtest/gtest.h>

#include <set>

#include "run/scenario.h"

namespace arex::sim {
namespace {

/// A scenario in which everything is as bad as it gets, as a run leaves it.
std::string spoiled(const std::string& more = "") {
  return make_scenario("spoiled", parse_yaml(R"(
seed: 5
world: {kind: gaps}
imu: {gyro_range_radps: 2.5, clock_offset_s: 0.02, output_rate_hz: 100, vibration: {level: rough}}
lidar: {rate_hz: 20, fault_silent_from_s: 5, fault_silent_for_s: 100, latency_s: 0.04,
        extrinsic_rotation_error_rad: [0, 0.1, 0], echo: {false_alarm_probability: 0.01}}
depth: {disparity_sigma_px: 0.5, width_px: 424, height_px: 240}
devices:
  side: {type: spinning, rings: 8, range_sigma_m: 0.3, position_m: [0, 0, 0.1]}
physics: {lidar_mount: {rotation_rad: [0.1, 0, 0]}, wind: {mean_mps: [5, 0, 0]}}
mapping: {lidar_frames: 1, remember: false, lone_range_m: 4, sensor: {hit_probability: 0.51},
          size_m: [20, 20, 3]}
planning: {inflation_m: 0.2}
control: {position_gain: [1, 1, 1]}
mission: {kind: goals, waypoints_m: [[16, 0, 1.5]], max_time_s: 30}
)" + more,
                                             "spoiled.yaml"))
      .resolved_yaml();
}

ScenarioConfig replaced(BlamedModule module, const std::string& yaml, bool expected = true) {
  ConfigNode source = parse_yaml(yaml, "run");
  EXPECT_EQ(replace_by_truth(module, source), expected);
  return make_scenario("again", std::move(source)).config;
}

// What the scenario chose, whatever truth stands where.
void expect_choices(const ScenarioConfig& config) {
  EXPECT_EQ(config.seed, 5U);
  EXPECT_EQ(config.imu.output_rate_hz, 100);
  EXPECT_EQ(config.lidar.model.rate_hz, 20);
  EXPECT_EQ(config.depth.model.width_px, 424);
  EXPECT_EQ(config.stack.planning.inflation_m, 0.2);
  EXPECT_EQ(config.stack.mapping.local.size_m.x(), 20);
  EXPECT_EQ(config.stack.mission.max_time_s, 30);
  EXPECT_EQ(config.devices.at("side").type, "spinning");
}

TEST(Experiments, SensorsAreAsSoldUntilOneIsWorse) {
  const auto as_sold = [](const std::string& yaml) {
    const std::string run = make_scenario("run", parse_yaml(yaml, "run")).resolved_yaml();
    return sensors_are_as_sold(parse_yaml(run, "run"));
  };
  const std::string start = "world: {kind: gaps}\n";
  EXPECT_TRUE(as_sold(start));
  // What a scenario chooses, and what is no sensor.
  EXPECT_TRUE(as_sold(start +
                      "lidar: {rate_hz: 20}\ndepth: {width_px: 424}\nphysics: {wind: {mean_mps: "
                      "[5, 0, 0]}}\nfaults: [{device: motor, kind: weak, from_s: 5}]\n"));
  for (const char* worse :
       {"imu: {clock_offset_s: 0.02}", "lidar: {echo: {false_alarm_probability: 0.01}}",
        "depth: {disparity_sigma_px: 0.5}", "physics: {lidar_mount: {rotation_rad: [0.1, 0, 0]}}",
        "faults: [{device: lidar, kind: silent, from_s: 5}]",
        "devices: {side: {type: spinning, range_sigma_m: 0.3}}"}) {
    EXPECT_FALSE(as_sold(start + worse + "\n")) << worse;
  }
  EXPECT_FALSE(as_sold(spoiled()));
}

TEST(Experiments, SensorsWithoutNoiseHaveNoFaultAndSitWhereTheyShould) {
  const ScenarioConfig config = replaced(BlamedModule::kSensors, spoiled());
  expect_choices(config);
  EXPECT_TRUE(config.imu.noise_free);
  EXPECT_TRUE(config.lidar.model.noise_free);
  EXPECT_TRUE(config.depth.model.noise_free);
  EXPECT_EQ(config.imu.clock_offset_s, 0);
  EXPECT_EQ(config.lidar.model.fault_silent_for_s, 0);
  EXPECT_EQ(config.lidar.model.extrinsic_rotation_error_rad, Vec3::Zero());
  EXPECT_EQ(config.lidar.latency_s, LidarConfig().latency_s);
  EXPECT_EQ(config.physics.body.lidar_mount.rotation_rad, Vec3::Zero());
  const ConfigNode* own = &config.devices.at("side").own;
  EXPECT_TRUE(own->find("noise_free"));
  EXPECT_FALSE(own->find("range_sigma_m"));
  // Nobody else has changed.
  EXPECT_EQ(config.stack.odometry.source, "lidar_inertial");
  EXPECT_EQ(config.stack.mapping.local.lidar_frames, 1);
  EXPECT_EQ(config.physics.wind.mean_mps.x(), 5);
}

TEST(Experiments, SensorsWithoutFaultsLeaveTheMotorsTheirs) {
  const ScenarioConfig config = replaced(
      BlamedModule::kSensors,
      spoiled("faults: [{device: lidar, kind: silent}, {device: motor, kind: weak}, {device: side, "
              "kind: noisy}, {device: infrared, kind: blinded}]\n"));
  ASSERT_EQ(config.faults.size(), 1U);
  EXPECT_EQ(config.faults[0].device, "motor");
}

TEST(Experiments, TrueOdometryIsAMotionCaptureWithoutFault) {
  const ScenarioConfig config = replaced(BlamedModule::kOdometry, spoiled());
  expect_choices(config);
  EXPECT_EQ(config.stack.odometry.source, "mocap");
  EXPECT_FALSE(config.imu.noise_free);
  const std::string jumps =
      spoiled("mocap: {fault_jump_m: [0, 2, 0]}\nodometry: {source: mocap}\n");
  EXPECT_EQ(replaced(BlamedModule::kOdometry, jumps).mocap.fault_jump_m, Vec3::Zero());
  replaced(BlamedModule::kOdometry, spoiled("odometry: {source: mocap}\n"), false);
}

TEST(Experiments, TrueMapsAreMadeFromASurveyAlone) {
  const ScenarioConfig config = replaced(BlamedModule::kMaps, spoiled());
  expect_choices(config);
  const MappingConfig& mapping = config.stack.mapping;
  ASSERT_TRUE(config.devices.contains(mapping.lidar));
  EXPECT_EQ(config.devices.at(mapping.lidar).type, "survey");
  EXPECT_FALSE(mapping.takes(""));
  EXPECT_FALSE(mapping.takes("side"));
  EXPECT_TRUE(mapping.takes(mapping.lidar));
  EXPECT_FALSE(mapping.local.use_depth);
  EXPECT_EQ(mapping.local.lone_range_m, 0);
  EXPECT_EQ(mapping.local.sensor.hit_probability, SensorModelConfig().hit_probability);
  EXPECT_EQ(config.lidar.model.fault_silent_for_s, 100);
  ConfigNode without = parse_yaml(
      "mapping: {enabled: false}\nmission: {kind: waypoints, waypoints_m: [[3, 0, 1]]}\n", "legs");
  EXPECT_FALSE(replace_by_truth(BlamedModule::kMaps, without));
}

TEST(Experiments, PerfectTrackingLeavesTheWindWhereItIs) {
  const ScenarioConfig config = replaced(BlamedModule::kTracking, spoiled());
  expect_choices(config);
  EXPECT_TRUE(config.physics.perfect_tracking);
  EXPECT_EQ(config.physics.wind.mean_mps.x(), 5);
  ConfigNode carried = parse_yaml("physics: {perfect_tracking: true}\n", "carried");
  EXPECT_FALSE(replace_by_truth(BlamedModule::kTracking, carried));
}

TEST(Experiments, ArePlannedForEachModuleAndAllTogether) {
  const auto names = [](const std::string& yaml, bool timed_out, bool again) {
    std::vector<std::string> found;
    for (const Experiment& one : plan_experiments("x", parse_yaml(yaml, "run"), timed_out, again)) {
      found.push_back(one.name);
      EXPECT_NE(one.resolved_yaml, "");
    }
    return found;
  };
  using Names = std::vector<std::string>;
  EXPECT_EQ(names(spoiled(), false, false),
            (Names{"sensors", "odometry", "maps", "tracking", "all"}));
  EXPECT_EQ(names(spoiled(), true, true),
            (Names{"as_flown", "sensors", "odometry", "maps", "tracking", "all", "time"}));
  const std::vector<Experiment> plan =
      plan_experiments("x", parse_yaml(spoiled(), "run"), true, true);
  // As flown is as flown; twice the time is that and nothing else.
  EXPECT_EQ(plan.front().resolved_yaml, spoiled());
  const auto config_of = [](const Experiment& one) {
    return make_scenario("x", parse_yaml(one.resolved_yaml, "x")).config;
  };
  EXPECT_EQ(config_of(plan.back()).stack.mission.max_time_s, 60);
  const ScenarioConfig all = config_of(plan[5]);
  EXPECT_TRUE(all.imu.noise_free && all.physics.perfect_tracking);
  EXPECT_EQ(all.stack.odometry.source, "mocap");
  EXPECT_FALSE(all.stack.mapping.lidar.empty());
}

// Whatever ships can be blamed: by sensors and tracking, by odometry and maps where they are none
// of the truth's already, by all together and by the time.
TEST(Experiments, CanBePlannedForEveryScenario) {
  std::size_t seen = 0;
  for (const auto& entry : std::filesystem::directory_iterator(AREX_SOURCE_DIR "/scenarios")) {
    if (entry.path().extension() != ".yaml") continue;
    const Scenario scenario = load_scenario(entry.path(), {}, {});
    const auto plan =
        plan_experiments(scenario.name, parse_yaml(scenario.resolved_yaml(), "run"), true, false);
    const StackConfig& stack = scenario.config.stack;
    const std::size_t modules =
        2U + (stack.odometry.source != "mocap" ? 1 : 0) + (stack.mapping.enabled ? 1 : 0);
    EXPECT_EQ(plan.size(), modules + 2) << entry.path();
    ++seen;
  }
  EXPECT_GE(seen, 10U);
}

}  // namespace
}  // namespace arex::sim
