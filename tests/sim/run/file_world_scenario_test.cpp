#include <gtest/gtest.h>

#include <filesystem>

#include "room.h"
#include "run/scenario.h"
#include "support/temporary_folder.h"

// Scenarios whose world is somebody's file.
namespace arex::sim {
namespace {

using test::TemporaryFolder;
using test::write_text;

const std::string kWorld = "world:\n  kind: file\n  file:\n    path: meshes/room.stl\n";

class FileWorldScenario : public testing::Test {
 protected:
  void SetUp() override {
    worlds::test::write_file(folder_ / "meshes/room.stl",
                             worlds::test::stl_binary(worlds::test::room()));
  }
  std::filesystem::path write(const std::string& text) {
    write_text(folder_ / "s.yaml", text);
    return folder_ / "s.yaml";
  }
  static std::string refusal(const std::filesystem::path& file,
                             const std::vector<std::string>& overrides) {
    try {
      static_cast<void>(load_scenario(file, overrides, {}).build_world());
    } catch (const ConfigError& error) {
      return error.what();
    }
    return {};
  }
  TemporaryFolder folder_;
};

TEST_F(FileWorldScenario, PathsAreRelativeToWhoeverNamesThem) {
  const auto file = write(kWorld + "mission: {kind: waypoints, waypoints_m: [[1, 0, 1]]}\n");
  const Scenario scenario = load_scenario(file, {}, {});
  EXPECT_EQ(scenario.config.world.file.path, (folder_ / "meshes/room.stl").string());
  EXPECT_EQ(scenario.build_world().mesh.triangles.size(), 18U);
  // From a run's folder, the resolved form finds it again.
  std::filesystem::create_directories(folder_ / "runs/1");
  write_text(folder_ / "runs/1/resolved.yaml", scenario.resolved_yaml());
  const Scenario again = load_scenario(folder_ / "runs/1/resolved.yaml", {}, {});
  EXPECT_EQ(again.resolved_yaml(), scenario.resolved_yaml());
  EXPECT_EQ(again.build_world().mesh.triangles.size(), 18U);
  // On the command line: from where one stands.
  const std::string here = "world.file.path=meshes/room.stl";
  EXPECT_EQ(load_scenario(file, {here}, {}).config.world.file.path,
            (std::filesystem::current_path() / "meshes/room.stl").string());
}

TEST_F(FileWorldScenario, ExploresWhatCanBeReachedUnlessToldOtherwise) {
  const std::string below_the_top = "    high_m: [4, 3, 2.9]\n";
  const auto file = write(kWorld + below_the_top + "mission: {kind: explore}\n");
  const Scenario scenario = load_scenario(file, {}, {});
  ASSERT_NE(scenario.file_world, nullptr);
  const ExplorationBounds& bounds = scenario.config.stack.exploration.explorer.bounds;
  const worlds::World world = scenario.build_world();
  // The room reaches from (-2, -2) to (4, 3); bounds are in O, which stands at the start.
  const Vec2 low = bounds.low_m + world.X_WS.p.head<2>();
  const Vec2 high = bounds.high_m + world.X_WS.p.head<2>();
  EXPECT_GE(low.minCoeff(), -2);
  EXPECT_LE(low.maxCoeff(), -1.2);
  EXPECT_NEAR(high.x(), 3.6, 0.4);
  EXPECT_NEAR(high.y(), 2.6, 0.4);
  const Scenario told = load_scenario(
      file, {"exploration.bounds.low_m=[-1, -1]", "exploration.bounds.high_m=[1, 1]"}, {});
  EXPECT_EQ(told.file_world, nullptr) << "nothing had to be known";
  EXPECT_EQ(told.config.stack.exploration.explorer.bounds.low_m, Vec2(-1, -1));
}

TEST_F(FileWorldScenario, WhatIsWrongIsSaidWhereItWasGiven) {
  const auto file = write(kWorld + "mission: {kind: waypoints, waypoints_m: [[1, 0, 1]]}\n");
  EXPECT_EQ(refusal(file, {}), "");
  EXPECT_EQ(refusal(file, {"world.file.start.position_m=[1, 1, 2]"})
                .find("--set world.file.start.position_m"),
            0U);
  EXPECT_NE(refusal(file, {"mission.waypoints_m=[[30, 0, 1]]"}).find("outside the world"),
            std::string::npos);
  std::filesystem::remove(folder_ / "meshes/room.stl");
  const std::string missing = refusal(file, {});
  EXPECT_EQ(missing.find((folder_ / "s.yaml").string() + ":"), 0U) << missing;
  EXPECT_NE(missing.find("no such file"), std::string::npos) << missing;
  const auto pathless = write("world: {kind: file}\nmission: {kind: waypoints}\n");
  EXPECT_NE(refusal(pathless, {}).find("file.path"), std::string::npos);
}

TEST(FileWorldScenarios, ThoseShippedAreValid) {
  std::size_t count = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(AREX_SOURCE_DIR "/scenarios/files")) {
    // Where the worlds lie beside the clone, or where everything that follows from them is said.
    try {
      const Scenario scenario = load_scenario(entry.path(), {}, 1);
      EXPECT_EQ(scenario.config.world.kind, worlds::WorldKind::kFile);
    } catch (const ConfigError& error) {
      EXPECT_NE(std::string(error.what()).find("no such file"), std::string::npos) << error.what();
    }
    ++count;
  }
  EXPECT_GE(count, 5U);
}

}  // namespace
}  // namespace arex::sim
