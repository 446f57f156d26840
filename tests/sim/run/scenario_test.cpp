#include "run/scenario.h"

#include <gtest/gtest.h>

#include <array>
#include <regex>

#include "physics/physics.h"
#include "support/temporary_folder.h"
#include "worlds/mesh_builder.h"

namespace arex::sim {
namespace {

using test::TemporaryFolder;
using test::write_text;

std::vector<std::filesystem::path> shipped_scenarios() {
  std::vector<std::filesystem::path> files;
  for (const char* folder : {"/scenarios", "/scenarios/paper"}) {
    for (const auto& entry :
         std::filesystem::directory_iterator(std::string(AREX_SOURCE_DIR) + folder)) {
      if (entry.path().extension() == ".yaml") files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

TEST(Scenario, EveryShippedFileIsValidAndSurvivesItsResolvedForm) {
  ASSERT_FALSE(shipped_scenarios().empty());
  const TemporaryFolder folder;
  for (const auto& file : shipped_scenarios()) {
    const Scenario scenario = load_scenario(file, {}, 7);
    write_text(folder / "resolved.yaml", scenario.resolved_yaml());
    const Scenario again = load_scenario(folder / "resolved.yaml", {}, {});
    EXPECT_EQ(again.resolved_yaml(), scenario.resolved_yaml()) << file;
    EXPECT_EQ(again.config.seed, 7u);
  }
}

TEST(Scenario, ASweepIsToldFromOne) {
  const std::string file = AREX_SOURCE_DIR "/scenarios/sweeps/lambda.yaml";
  try {
    static_cast<void>(load_scenario(file, {}, {}));
    ADD_FAILURE() << "accepted";
  } catch (const ConfigError& error) {
    EXPECT_EQ(std::string(error.what()).find(file + ":3: 'base' makes this a sweep"), 0U)
        << error.what();
  }
}

TEST(Scenario, TheStackIsToldItsBatteryUnlessTheScenarioSaysOtherwise) {
  const auto believed = [](const std::vector<std::string>& overrides) {
    return load_scenario(AREX_SOURCE_DIR "/scenarios/forest.yaml", overrides, 1)
        .config.stack.exploration.explorer.consumption;
  };
  EXPECT_NEAR(believed({}).capacity_wh, ConsumptionConfig{}.capacity_wh, 1e-9);
  EXPECT_NEAR(believed({"physics.battery.capacity_ah=2"}).capacity_wh, 29.6, 1e-9);
  EXPECT_NEAR(believed({"physics.battery.cells=6"}).full_v, 25.2, 1e-9);
  EXPECT_EQ(believed({"physics.battery.capacity_ah=2", "exploration.consumption.capacity_wh=50"})
                .capacity_wh,
            50);
}

TEST(Scenario, RefusesPointsThatLieOffTheWorld) {
  const TemporaryFolder folder;
  const auto refusal = [&](const std::string& text, const std::vector<std::string>& overrides) {
    write_text(folder / "s.yaml", text);
    try {
      (void)load_scenario(folder / "s.yaml", overrides, {}).build_world();
    } catch (const ConfigError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const std::string forest =
      "world: {kind: forest, forest: {size_m: [20, 20], tree_density_per_m2: 0.02}}\n";
  const std::string way = forest + "mission:\n  waypoints_m:\n    - [1, 0, 1]\n    - ";
  const std::string file = (folder / "s.yaml").string();
  EXPECT_EQ(refusal(way + "[9, 0, 1]\n", {}), "");
  EXPECT_EQ(refusal(way + "[15, 0, 1]\n", {}).find(file + ":5: point 2"), 0U);
  EXPECT_NE(refusal(way + "[0, -80, 1]\n", {}).find("outside the world"), std::string::npos);
  EXPECT_NE(refusal(way + "[3, 0, -2]\n", {}).find("below the ground"), std::string::npos);
  EXPECT_EQ(refusal(way + "[3, 0, 1]\n", {"mission.waypoints_m=[[30, 0, 1]]"}).find("--set"), 0U);
  const std::string entry = forest +
                            "mission: {kind: explore, entry_m: [[0, 30, 1], [0, 0, 1]]}\n" +
                            "mapping: {global: {low_m: [-10, -10, -3], high_m: [10, 10, 6]}}\n";
  EXPECT_NE(
      refusal(entry, {"exploration.bounds.low_m=[-8, -8]", "exploration.bounds.high_m=[8, 8]"})
          .find("point 1 of mission.entry_m"),
      std::string::npos);
  EXPECT_NE(
      refusal("world: {kind: gaps}\nmission: {kind: goals, waypoints_m: [[99, 0, 1.5]]}\n", {})
          .find("outside the world"),
      std::string::npos);
  EXPECT_NE(refusal("world: {kind: garage}\nmission: {waypoints_m: [[30, 0, -15]]}\n", {})
                .find("below the ground"),
            std::string::npos);
}

TEST(Scenario, RefusesHeightsBeyondCeilingAndFloor) {
  const auto refusal = [](const std::string& scenario, const std::string& override) {
    try {
      (void)load_scenario(AREX_SOURCE_DIR "/scenarios/" + scenario, {override}, {});
    } catch (const ConfigError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(refusal("gaps.yaml", "planning.ceiling_m=2"), "");
  for (const char* scenario : {"gaps.yaml", "forest_small.yaml"}) {
    for (const char* override : {"planning.floor_m=1.6", "planning.ceiling_m=1.0",
                                 "planning.floor_m=12", "mission.takeoff_height_m=11"}) {
      EXPECT_NE(refusal(scenario, override).find("floor_m"), std::string::npos)
          << scenario << " " << override << ": " << refusal(scenario, override);
    }
  }
  EXPECT_NE(refusal("forest_small.yaml", "exploration.flight_height_m=11").find("ceiling_m"),
            std::string::npos);
}

TEST(Scenario, EveryParameterSaysWhatItMeans) {
  for (const ParameterInfo& p : list_parameters(ScenarioConfig{})) {
    EXPECT_FALSE(p.meaning.empty()) << p.key;
  }
}

TEST(Scenario, EveryParameterHasTheUnitThatItsNameEndsIn) {
  // The most particular ending first.
  const std::pair<const char*, const char*> endings[] = {
      {"gyro_scale_noise_density", "1/sqrt(Hz)"},
      {"gyro_noise_density", "rad/s/sqrt(Hz)"},
      {"gyro_walk_density", "rad/s^2/sqrt(Hz)"},
      {"accel_noise_density", "m/s^2/sqrt(Hz)"},
      {"accel_walk_density", "m/s^3/sqrt(Hz)"},
      {"magnetometer_noise_density", "G/sqrt(Hz)"},
      {"_density_per_m2", "1/m^2"},
      {"range_(noise|std)_per_m", "m/m"},
      {"_s_per_m", "s/m"},
      {"_nm_per_a", "N m/A"},
      {"_per_s", "1/s"},
      {"_kgpm3", "kg/m^3"},
      {"_kgm2", "kg m^2"},
      {"_mps3", "m/s^3"},
      {"_mps2", "m/s^2"},
      {"_mps", "m/s"},
      {"_radps3", "rad/s^3"},
      {"_radps2", "rad/s^2"},
      {"_radps", "rad/s"},
      {"_d(eg)?ps", "deg/s"},
      {"_rad", "rad"},
      {"_deg", "deg"},
      {"_m2", "m^2"},
      {"_m", "m"},
      {"_ms", "ms"},
      {"_s", "s"},
      {"_hz", "Hz"},
      {"_px", "px"},
      {"_kg", "kg"},
      {"_nm", "N m"},
      {"_n", "N"},
      {"_wh", "Wh"},
      {"_ah", "Ah"},
      {"_w", "W"},
      {"_v", "V"},
      {"_a", "A"},
      {"_ohm", "ohm"},
      {"_pa", "Pa"},
      {"_gauss", "G"},
      {"_(fraction|ratio|share|probability|charge|reflectivity)", "1"},
  };
  std::size_t with_unit = 0;
  for (const ParameterInfo& p : list_parameters(ScenarioConfig{})) {
    const auto promised = std::find_if(std::begin(endings), std::end(endings), [&](const auto& e) {
      return std::regex_search(p.key, std::regex(std::string(e.first) + "$"));
    });
    EXPECT_EQ(p.unit, promised == std::end(endings) ? "" : promised->second) << p.key;
    with_unit += p.unit.empty() ? 0 : 1;
  }
  EXPECT_GT(with_unit, 200U);
}

TEST(Scenario, HasTheKeysThatOthersRelyOn) {
  const auto parameters = list_parameters(ScenarioConfig{});
  for (const char* key : {"seed", "odometry.source", "mission.max_time_s", "mapping.use_depth"}) {
    EXPECT_TRUE(std::any_of(parameters.begin(), parameters.end(), [&](const auto& p) {
      return p.key == key;
    })) << key;
  }
}

TEST(Scenario, SoftwareThatCannotKeepUpIsRefused) {
  const auto message = [](const std::vector<std::string>& settings) -> std::string {
    try {
      load_scenario(AREX_SOURCE_DIR "/scenarios/forest.yaml", settings, std::nullopt);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(message({"lidar.rate_hz=20"}), "");
  EXPECT_NE(
      message({"lidar.rate_hz=50", "odometry.latency_s=0.03"}).find("odometry.latency_s <= 1 / l"),
      std::string::npos);
  EXPECT_EQ(message({"lidar.rate_hz=50", "odometry.latency_s=0.01", "mapping.latency_s=0.01"}), "");
  EXPECT_NE(message({"mapping.latency_s=0.06"}).find("mapping.latency_s <= 1 / ("),
            std::string::npos);
  EXPECT_NE(message({"lidar.rate_hz=30"}).find("whole number of milliseconds"), std::string::npos);
}

std::string refusal(const std::string& scenario, const std::vector<std::string>& settings) {
  try {
    load_scenario(AREX_SOURCE_DIR "/scenarios/" + scenario + ".yaml", settings, std::nullopt);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

TEST(Scenario, AKeyThatHasMovedIsRefusedWithTheOneToSetInstead) {
  const std::vector<std::array<std::string, 2>> moved{
      {"exploration.stop.return_home=false", "mission.land_at_start"},
      {"exploration.space.travel_radius_m=0.4", "planning.inflation_m"},
      {"exploration.viewpoint.clearance_m=0.4", "planning.inflation_m"},
      {"planning.guide.obstacle_distance_m=0.4", "planning.inflation_m"},
      {"planning.local.true_radius_m=0.4", "vehicle.radius_m"},
      {"planning.replan.degenerate_speed_mps=1", "caution.degenerate_speed_fraction"},
      {"mapping.global.sensor.hit_probability=0.8", "mapping.sensor"},
      {"imu.vibration.once_per_rev_mps2=4", "imu.vibration.level"},
      {"depth.noise_kernel_px=5", "depth.noise_grid_px"},
      {"vehicle.own_returns_m=0.5", "vehicle.own_returns_margin_m"},
      {"world.vehicle_radius_m=0.4", "models/arex/arex.xml"}};
  for (const auto& [setting, instead] : moved) {
    EXPECT_NE(refusal("forest", {setting}).find(instead), std::string::npos) << setting;
  }
}

// Explorer, map and score answer alike where the mission explores.
TEST(Scenario, TheMapAndTheScoreFollowTheExploredRegion) {
  const std::vector<std::string> settings{"exploration.bounds.low_m=[-9, -7]",
                                          "exploration.bounds.high_m=[11, 8]",
                                          "exploration.bounds.polygon_m=[[-9,-7],[5,-7],[5,8]]"};
  const Scenario scenario =
      load_scenario(AREX_SOURCE_DIR "/scenarios/forest.yaml", settings, std::nullopt);
  const GlobalMapConfig& box = scenario.config.stack.mapping.global;
  EXPECT_EQ(box.low_m, Vec3(-14, -12, GlobalMapConfig{}.low_m.z()));
  EXPECT_EQ(box.high_m, Vec3(10, 13, GlobalMapConfig{}.high_m.z()));
  const ScoredRegion scored = scenario.scored_region();
  EXPECT_TRUE(scored.bounds.contains({4, -6}));
  EXPECT_FALSE(scored.bounds.contains({-4, 6}));
  const CoverageConfig& coverage =
      load_scenario(AREX_SOURCE_DIR "/scenarios/forest.yaml",
                    {"mapping.global.band_low_m=1", "mapping.global.band_high_m=3",
                     "mapping.cloud_range_m=8", "mapping.global.high_m=[30, 25, 2.5]"},
                    1)
          .config.scoring.coverage;
  EXPECT_EQ(coverage.band_low_m, 1);
  EXPECT_EQ(coverage.band_high_m, 3);
  EXPECT_EQ(coverage.visibility.range_m, 8);
}

TEST(Scenario, ARegionThatNobodyCanExploreIsRefused) {
  for (const std::vector<std::string>& settings : std::vector<std::vector<std::string>>{
           {"mapping.global.low_m=[-8, -8, -3]"},  // a map smaller than what is to be explored
           {"mapping.global.high_m=[12, 14, 6]"},  // and one without the obstacles at its rim
           {"exploration.bounds.low_m=[2, -10]"},  // without the start
           {"exploration.bounds.high_m=[12, -1]"},
           {"exploration.bounds.polygon_m=[[3, 3], [9, 3], [9, 9]]"},
           {"exploration.bounds.polygon_m=[[-9, -9], [9, 9], [9, -9], [-9, 9]]"},
           {"exploration.bounds.polygon_m=[[50, 50], [60, 50], [60, 60]]"},
           {"exploration.bounds.low_m=[12, 10]", "exploration.bounds.high_m=[-12, -10]"},
           {"exploration.bounds.high_m=[40, 10]"},  // beyond the forest
           {"exploration.bounds.low_m=[-200, -200]", "exploration.bounds.high_m=[200, 200]"},
           {"mission.entry_m=[[30, 0, 1.5]]"},  // enters outside
           {"scoring.high_m=20"}}) {
    const std::string message = refusal("forest_small", settings);
    EXPECT_NE(message.find("out of range: expected"), std::string::npos) << settings.front();
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  }
  // Bounds that only the end of the entry lies in are as good as any.
  EXPECT_EQ(refusal("garage", {"exploration.bounds.low_m=[10, -25]",
                               "mission.entry_m=[[2, 0, 1.3], [16.7, 0, -7.2], [19, 0, -7.2]]"}),
            "");
  EXPECT_EQ(refusal("forest_small", {"mapping.global.low_m=[-13, -11, -3]"}), "");
  // Other missions explore nothing.
  EXPECT_EQ(refusal("goals", {"exploration.bounds.low_m=[2, 2]"}), "");
}

TEST(Scenario, AnEntryThatEndsWhereNothingCanBeExploredIsRefused) {
  const auto build = [](const char* entry) {
    return load_scenario(AREX_SOURCE_DIR "/scenarios/garage_small.yaml", {entry}, 1).build_world();
  };
  EXPECT_NO_THROW(build("mission.entry_m=[[2, 0, 1.3], [16.7, 0, -7.2], [19, 0, -7.2]]"));
  EXPECT_THROW(build("mission.entry_m=[[19, 0, -12]]"), ConfigError);  // under the floor
  EXPECT_THROW(build("mission.entry_m=[[19, 0, 30]]"), ConfigError);   // above what is scored
}

// What a scenario does not say of its bounds ends where its world does.
TEST(Scenario, BoundsThatNobodyAskedForEndWithTheWorld) {
  const TemporaryFolder folder;
  write_text(folder / "gaps.yaml", "world: {kind: gaps}\nmission: {kind: explore}\n");
  const Scenario scenario = load_scenario(folder / "gaps.yaml", {}, {});
  const ExplorationBounds& bounds = scenario.config.stack.exploration.explorer.bounds;
  EXPECT_EQ(bounds.low_m.x(), -scenario.config.world.gaps.start_radius_m);
  EXPECT_EQ(bounds.high_m.y(), 0.5 * scenario.config.world.gaps.width_m);
}

// `vehicle` is what the stack believes: it moves nothing that is true.
TEST(Scenario, TheBeliefAloneChangesNothingTrue) {
  const Scenario nominal = load_scenario(AREX_SOURCE_DIR "/scenarios/waypoints.yaml", {}, 1);
  const Scenario mistaken =
      load_scenario(AREX_SOURCE_DIR "/scenarios/waypoints.yaml",
                    {"vehicle.mass_kg=2.5", "vehicle.radius_m=0.5", "vehicle.ground_offset_m=0.3",
                     "vehicle.lidar_position_m=[0, 0, 0.2]"},
                    1);
  const worlds::World world = nominal.build_world();
  EXPECT_EQ(world_hash(mistaken.build_world()), world_hash(world));
  Physics a(nominal.config.physics, world, start_pose(world), 1);
  Physics b(mistaken.config.physics, world, start_pose(world), 1);
  EXPECT_EQ(a.airframe().mass_kg, b.airframe().mass_kg);
  EXPECT_EQ(a.airframe().X_BL.p, b.airframe().X_BL.p);
  for (int tick = 0; tick < 500; ++tick) {
    for (Physics* physics : {&a, &b}) physics->step({});
  }
  EXPECT_EQ(a.truth().X_WB.p, b.truth().X_WB.p);
  EXPECT_EQ(a.truth().X_WB.R, b.truth().X_WB.R);
}

// A forest so dense that the vehicle cannot leave its start for the clearing.
constexpr const char* kWalledIn =
    "seed: 3\nworld:\n  kind: forest\n  forest:\n    size_m: [30, 30]\n"
    "    start_radius_m: 0.8\n    tree_density_per_m2: 2\n    min_spacing_m: 0.5\n"
    "    tree: {leaves: 0}\n    clearings: [{centre_m: [8, 8], radius_m: 4}]\n";

std::string refusal_of(const std::vector<std::string>& overrides) {
  try {
    load_scenario({}, overrides, {});
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "no error";
}

// Each of these once ended in bad_alloc, in SIGFPE, in a loop or in a mission of a millisecond.
TEST(Scenario, SizesThatNoHostHasRoomForAreRefusedByTheirRule) {
  const std::vector<std::pair<std::string, std::string>> absurd{
      {"mapping.resolution_m=0.001", "0.02 <= resolution_m"},
      {"mapping.resolution_m=0.021", "size_m / resolution_m"},
      {"mapping.size_m=[1e5, 30, 3]", "1 <= size_m <= 40"},
      {"mapping.global.high_m=[1e5, 25, 9]", "high_m - low_m <= 400"},
      {"mapping.global={low_m: [-200, -200, -200], high_m: [200, 200, 200]}", "global.high_m"},
      {"mapping.global={low_m: [5000, 0, 0], high_m: [5100, 9, 9]}", "OctoMap"},
      {"mapping.depth_hit_stride_px=0", "1 <= depth_hit_stride_px"},
      {"mapping.cloud.voxel_m=1e-9", "0.005 <= voxel_m"},
      {"mapping.decay_per_s=1e300", "decay_per_s <= 1000"},
      {"mapping.map_2d_rate_hz=1e8", "map_2d_rate_hz <= 1000"},
      {"world.forest.size_m=[1e5, 1e5]", "10 <= size_m <= 500"},
      {"world.forest={size_m: [500, 500], ground_spacing_m: 0.05}", "ground_spacing_m"},
      {"world.forest={size_m: [400, 400], tree: {leaves: 20000}}", "1e7 triangles"},
      {"world.forest.min_spacing_m=1e-9", "0.2 <= min_spacing_m"},
      {"world.gaps={field_radius_min_m: 1e-9, field_radius_max_m: 1e-9, field_spacing_m: 1e-8}",
       "0.2 <= field_spacing_m"},
      {"depth.width_px=1000000", "width_px <= 4096"},
      {"depth={width_px: 4096, height_px: 4096}", "width_px height_px <= 4e6"},
      {"lidar.rate_hz=1e-9", "5 <= rate_hz"},
      {"lidar.rate_hz=0", "5 <= rate_hz"},
      {"lidar.rate_hz=100", "rate_hz <= 50"},
      {"scoring.coverage.space.resolution_m=1e-4", "0.05 <= resolution_m"},
      {"scoring.coverage.surface.sample_area_m2=1e-12", "0.002 <= sample_area_m2"},
      {"scoring.coverage.visibility.viewpoint_spacing_m=1e-5", "0.2 <= viewpoint_spacing_m"},
      {"odometry.lidar_inertial.registration.max_points=2000000000", "max_points <= 1000000"},
      {"odometry.lidar_inertial.health.recovery_step_m=1e-6", "30 recovery_step_m"},
      {"odometry.watch.firing_period_s=1e-9", "1e-7 <= firing_period_s"},
      {"exploration.detector.local_iterations=2000000000", "local_iterations <= 1000000"},
      {"exploration.detector.cluster_bandwidth_m=1e-9", "0.02 <= cluster_bandwidth_m"},
      {"exploration.space.information_radius_m=1e5", "information_radius_m <= 50"},
      {"planning.local.control_point_distance_m=1e-9", "0.05 <= control_point_distance_m"},
      {"planning.local.timing_knot_span_s=1e-8", "0.002 <= timing_knot_span_s"},
      {"planning.replan.horizon_m=1e5", "horizon_m <= 60"},
      {"physics.contact.slots=2000000000", "slots <= 2000"},
      {"mission.yaw_burst_s=1e-10", "1e-09 s"},
      {"mission.yaw_burst_s=1e-8", "yaw_burst_s >= 0.001"},
      {"mission.max_time_s=1e10", "at most 1e+09 s"},
      {"lidar.fault_silent_for_s=1e10", "at most 1e+09 s"},
      {"odometry.latency_s=1e9", "latency_s <= 60"},
  };
  for (const auto& [assignment, rule] : absurd) {
    const std::string message = refusal_of({assignment});
    const std::string key = assignment.substr(0, assignment.find('='));
    EXPECT_EQ(message.find("--set " + key + ": "), 0u) << assignment << ": " << message;
    EXPECT_NE(message.find(rule), std::string::npos) << assignment << ": " << message;
  }
}

TEST(Scenario, ALongFaultOrMissionIsLongNotOver) {
  const Scenario scenario = load_scenario(
      {}, {"mission.max_time_s=1e9", "lidar.fault_silent_from_s=1", "lidar.fault_silent_for_s=1e9"},
      {});
  EXPECT_EQ(from_seconds(scenario.config.stack.mission.max_time_s), 1'000'000'000 * 1'000'000'000L);
  EXPECT_EQ(refusal_of({"mission.yaw_burst_s=0.001"}), "no error");
}

TEST(Scenario, TheExpectedSizeOfAForestIsThatOfTheForest) {
  for (const char* name : {"forest", "forest_small"}) {
    const Scenario scenario =
        load_scenario(std::string(AREX_SOURCE_DIR "/scenarios/") + name + ".yaml", {}, {});
    const auto triangles = static_cast<double>(scenario.build_world().mesh.triangles.size());
    const double expected = scenario.config.world.forest.expected_triangles();
    EXPECT_GT(expected, 0.7 * triangles) << name;
    EXPECT_LT(expected, 2 * triangles) << name;
  }
}

TEST(Scenario, TheFlownAreaIsWhereMissionAndOperatorLead) {
  const auto area_of = [](const std::vector<std::string>& settings) {
    return load_scenario({}, settings, {}).config.flown_area();
  };
  const auto explored = area_of({"mission.kind=explore", "exploration.bounds.low_m=[-9, -3]",
                                 "exploration.bounds.high_m=[8, 12]"});
  EXPECT_EQ(explored.min(), Vec2(-9, -3));
  EXPECT_EQ(explored.max(), Vec2(8, 12));
  const auto flown =
      area_of({"mission.kind=goals", "mission.waypoints_m=[[5, 1, 1], [7, -2, 1]]",
               "commands=[{at_s: 9, do: go_to, goal_m: [0, 20, 1]}, {at_s: 30, do: land}]"});
  EXPECT_EQ(flown.min(), Vec2(0, -2));
  EXPECT_EQ(flown.max(), Vec2(7, 20));
}

TEST(Scenario, ARecipeWithoutAFreeStartIsAnErrorAtItsLine) {
  const TemporaryFolder folder;
  write_text(folder / "bad.yaml", kWalledIn);
  const Scenario scenario = load_scenario(folder / "bad.yaml", {}, {});
  try {
    static_cast<void>(scenario.build_world());
    FAIL() << "no error";
  } catch (const ConfigError& error) {
    const std::string what = error.what();
    EXPECT_EQ(what.find((folder / "bad.yaml").string() + ":"), 0u) << what;
    EXPECT_NE(what.find("free start"), std::string::npos) << what;
    EXPECT_EQ(what.find('\n'), std::string::npos);
  }
}

}  // namespace
}  // namespace arex::sim
