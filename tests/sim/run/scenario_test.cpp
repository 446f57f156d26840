#include "run/scenario.h"

#include <gtest/gtest.h>

#include <array>

#include "physics/physics.h"
#include "support/temporary_folder.h"
#include "worlds/mesh_builder.h"

namespace arex::sim {
namespace {

using test::TemporaryFolder;
using test::write_text;

std::vector<std::filesystem::path> shipped_scenarios() {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(AREX_SOURCE_DIR "/scenarios")) {
    if (entry.path().extension() == ".yaml") files.push_back(entry.path());
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

TEST(Scenario, EveryParameterSaysWhatItMeans) {
  for (const ParameterInfo& p : list_parameters(ScenarioConfig{})) {
    EXPECT_FALSE(p.meaning.empty()) << p.key;
  }
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
  EXPECT_NE(message({"lidar.rate_hz=100"}).find("odometry.latency_s <= 1 / l"), std::string::npos);
  EXPECT_EQ(message({"lidar.rate_hz=100", "odometry.latency_s=0.01", "mapping.latency_s=0.005"}),
            "");
  EXPECT_NE(message({"mapping.latency_s=0.06"}).find("mapping.latency_s <= 1 / ("),
            std::string::npos);
  EXPECT_NE(message({"lidar.rate_hz=7"}).find("whole number of milliseconds"), std::string::npos);
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
  EXPECT_EQ(refusal("garage", {"exploration.bounds.low_m=[10, -25]"}), "");
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
    "    start_radius_m: 0.8\n    tree_density_per_m2: 0.8\n    min_spacing_m: 0.8\n"
    "    clearings: [{centre_m: [8, 8], radius_m: 4}]\n";

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
