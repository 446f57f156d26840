#include "run/scenario.h"

#include <gtest/gtest.h>

#include "support/temporary_folder.h"

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

TEST(Scenario, ARecipeWithoutAFreeStartIsAnErrorAtItsLine) {
  const TemporaryFolder folder;
  write_text(folder / "bad.yaml",
             "seed: 3\nworld:\n  kind: forest\n  vehicle_radius_m: 2\n  forest:\n"
             "    start_radius_m: 0.5\n    tree_density_per_m2: 0.19\n");
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
