#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "support/process.h"

// Modules by name and from plug-ins, as a user chooses them.
namespace arex {
namespace {

using test::ProcessResult;
using test::read_text;
using test::TemporaryFolder;

const std::string kSmallForest = AREX_SOURCE_DIR "/scenarios/forest_small.yaml";

ProcessResult fly(const TemporaryFolder& folder, const std::string& scenario,
                  const std::vector<std::string>& settings) {
  std::vector<std::string> arguments{"run",         scenario, "--quiet",
                                     "--no-report", "--out",  (folder / "run").string()};
  for (const std::string& setting : settings) {
    arguments.insert(arguments.end(), {"--set", setting});
  }
  return test::run_process(AREX_BINARY, arguments);
}

nlohmann::json summary_of(const TemporaryFolder& folder) {
  return nlohmann::json::parse(read_text(folder / "run/summary.json"));
}

TEST(Modules, TheNearestFrontierExploresTheSmallForest) {
  const TemporaryFolder folder;
  const auto result = fly(folder, kSmallForest, {"exploration.strategy=nearest"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_GE(summary_of(folder)["coverage"]["area_fraction"].get<double>(), 0.95);
  const std::string decisions = read_text(folder / "run/decisions.csv");
  EXPECT_NE(decisions.find("new_target,frontiers,"), std::string::npos);
  EXPECT_EQ(decisions.find(",trees,"), std::string::npos);
}

TEST(Modules, UnknownNamesAreAnsweredWithTheNearest) {
  const TemporaryFolder folder;
  const auto expect = [&](const std::string& setting, const std::string& said) {
    const auto result = fly(folder, kSmallForest, {setting});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_NE(result.err.find(said), std::string::npos) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  };
  expect("exploration.strategy=neerest",
         "--set exploration.strategy: unknown exploration strategy 'neerest'; did you mean "
         "'nearest'?");
  expect("odometry.source=lidar", "unknown odometry source 'lidar'; did you mean");
  expect("planning.strategy=bsplin", "unknown local planner 'bsplin'; did you mean 'bspline'?");
  expect("odometries.other={type: mocup}",
         "unknown odometry source 'mocup'; did you mean 'mocap'?");
  expect("odometries.other={type: lidar_inertial, scal_accel: true}",
         "unknown key 'scal_accel'; did you mean 'scale_accel'?");
  expect("odometries.other={latency_s: 1}", "odometry 'other' has no type");
  expect("odometries.truth={type: mocap}", "other names than truth and estimate");
  expect("odometries={a/b: {type: mocap}}", "the name 'a/b', expected");
  expect("modules.fastest={speed: 1}", "unknown module 'fastest'; did you mean");
}

TEST(Modules, FurtherSourcesRunBesideAndAreScored) {
  const TemporaryFolder folder;
  const auto result =
      fly(folder, AREX_SOURCE_DIR "/scenarios/waypoints.yaml",
          {"mission.max_time_s=14", "depth.rate_hz=1", "plugins=[" ODOMETRY_PLUGIN "]",
           "odometries={twin: {type: lidar_inertial}, oracle: {type: mocap}, "
           "reckoning: {type: imu_only, standstill_s: 2}}"});
  ASSERT_EQ(result.exit_code, 1) << result.err;  // it is not meant to arrive
  const nlohmann::json summary = summary_of(folder);
  const nlohmann::json& others = summary["odometries"];
  ASSERT_EQ(others.size(), 3U);
  // The same filter on the same samples says the same, bit for bit.
  const auto poses_of = [&](const std::string& file) {
    const std::string text = read_text(folder / ("run/" + file));
    return text.substr(text.find('\n'));  // after the header
  };
  EXPECT_EQ(poses_of("twin.tum"), poses_of("estimate.tum"));
  EXPECT_EQ(others["twin"]["ate_rmse_m"], summary["odometry"]["ate_rmse_m"]);
  EXPECT_LT(others["oracle"]["ate_rmse_m"].get<double>(), 1e-6);
  // Nothing corrects it.
  EXPECT_GT(others["reckoning"]["ate_rmse_m"].get<double>(),
            3 * summary["odometry"]["ate_rmse_m"].get<double>());
  EXPECT_GT(others["reckoning"]["end_error_m"].get<double>(),
            others["reckoning"]["ate_rmse_m"].get<double>());
}

TEST(Modules, WhatRunsBesideDoesNotChangeTheFlight) {
  std::string hash;
  for (const bool beside : {false, true}) {
    const TemporaryFolder folder;
    std::vector<std::string> settings{"mission.max_time_s=8", "depth.rate_hz=1"};
    if (beside) settings.emplace_back("odometries={twin: {type: lidar_inertial}}");
    ASSERT_EQ(fly(folder, AREX_SOURCE_DIR "/scenarios/waypoints.yaml", settings).exit_code, 1);
    const std::string now = summary_of(folder)["trajectory_hash"];
    if (!beside) hash = now;
    EXPECT_EQ(now, hash);
    if (!beside) continue;
    // What was flown can be flown again from its own folder.
    const TemporaryFolder again;
    ASSERT_EQ(fly(again, (folder / "run/resolved.yaml").string(), {}).exit_code, 1);
    EXPECT_EQ(summary_of(again)["trajectory_hash"], hash);
    EXPECT_EQ(summary_of(again)["odometries"], summary_of(folder)["odometries"]);
  }
}

// Standing on its pad, the vehicle sees the ground ahead of it and nothing behind: unless a second
// LiDAR looks there.
TEST(Devices, ASecondLidarAndASecondCameraFillTheMapsAndTheBag) {
  std::size_t points = 0;
  for (const bool second : {false, true}) {
    const TemporaryFolder folder;
    std::vector<std::string> settings{"mission.max_time_s=4"};
    if (second) {
      settings.emplace_back(
          "devices={rear: {type: mid360, position_m: [-0.15, 0, 0.01], rotation_rad: [0, 0, "
          "3.14]}, "
          "back_eye: {type: d430, rotation_rad: [0, 0, 3.14], latency_s: 0.04}}");
    }
    std::vector<std::string> arguments{"run",     kSmallForest,
                                       "--quiet", "--no-report",
                                       "--out",   (folder / "run").string(),
                                       "--bag",   (folder / "flight.bag").string()};
    for (const std::string& setting : settings) {
      arguments.insert(arguments.end(), {"--set", setting});
    }
    ASSERT_EQ(test::run_process(AREX_BINARY, arguments).exit_code, 1);
    const nlohmann::json summary = summary_of(folder);
    const std::string bag = read_text(folder / "flight.bag");
    for (const char* topic : {"/rear/points", "/back_eye/depth", "/back_eye/camera_info"}) {
      EXPECT_EQ(bag.find(topic) != std::string::npos, second) << topic;
    }
    for (const char* device : {"rear", "back_eye"}) {
      EXPECT_EQ(summary["device_hashes"].contains(device), second) << device;
    }
    const auto now = summary["map"]["points"].get<std::size_t>();
    if (second) {
      EXPECT_GT(static_cast<double>(now), 1.5 * static_cast<double>(points));
    }
    points = now;
    if (!second) continue;
    const TemporaryFolder again;
    ASSERT_EQ(fly(again, (folder / "run/resolved.yaml").string(), {}).exit_code, 1);
    EXPECT_EQ(summary_of(again)["device_hashes"], summary["device_hashes"]);
  }
}

TEST(Devices, WhatIsNoneIsRefusedInOneLine) {
  const TemporaryFolder folder;
  const auto expect = [&](const std::string& setting, const std::string& said) {
    const auto result = fly(folder, kSmallForest, {setting});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_NE(result.err.find(said), std::string::npos) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  };
  expect("devices.rear={type: sonar}", "device 'rear': unknown type 'sonar'; did you mean");
  expect("devices.rear={type: mid360, rate: 5}", "unknown key 'rate'; did you mean");
  expect("devices.imu={type: mid360}", "devices with other names than imu");
  expect("devices.lidar=false", "'devices.lidar' is not set here any more; set lidar.enabled");
  expect("devices.a={type: mid360, rate_hz: 40}", "further devices counted");
}

TEST(Plugins, AnExplorerOfOnesOwnExplores) {
  const TemporaryFolder folder;
  const auto result = fly(folder, kSmallForest,
                          {"plugins=[" EXPLORER_PLUGIN "]", "exploration.strategy=largest",
                           "modules.largest.least_gain_m2=0.4"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_GE(summary_of(folder)["coverage"]["area_fraction"].get<double>(), 0.9);
  EXPECT_NE(read_text(folder / "run/decisions.csv").find("new_target,largest,"), std::string::npos);
  EXPECT_NE(read_text(folder / "run/resolved.yaml").find("least_gain_m2: 0.4"), std::string::npos);
}

TEST(Plugins, APlannerOfOnesOwnFlies) {
  const TemporaryFolder folder;
  const auto result =
      fly(folder, AREX_SOURCE_DIR "/scenarios/gaps.yaml",
          {"plugins=[" PLANNER_PLUGIN "]", "planning.strategy=straight", "odometry.source=mocap",
           "mapping.use_depth=false", "world.gaps.gap_m=3", "world.gaps.gap_offset_m=0"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const nlohmann::json stages = summary_of(folder)["planner"]["stages"];
  EXPECT_GT(stages["path_following"], 0);
  EXPECT_EQ(stages["polynomial"], 0);
}

TEST(Plugins, ParametersAreStrictAndListed) {
  const TemporaryFolder folder;
  const auto result = fly(folder, kSmallForest,
                          {"plugins=[" EXPLORER_PLUGIN "]", "modules.largest.least_gain=0.4"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("unknown key 'least_gain'; did you mean 'least_gain_m2'?"),
            std::string::npos)
      << result.err;
}

TEST(Plugins, WhatIsNoneIsRefusedInOneLine) {
  const TemporaryFolder folder;
  const auto expect = [&](const std::string& file, const std::string& said) {
    const auto result = fly(folder, kSmallForest, {"plugins=[" + file + "]"});
    EXPECT_EQ(result.exit_code, 2) << file;
    EXPECT_NE(result.err.find(said), std::string::npos) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_FALSE(std::filesystem::exists(folder / "run"));
  };
  expect("/does/not/exist.so", "is no file, expected a shared library");
  expect(kSmallForest, "cannot be loaded");
  expect(NO_PLUGIN, "has no AREX_PLUGIN(...), expected one");
  expect(ANOTHER_MAKE, "was built with 'arex 0, some other compiler', expected 'arex 1");
  expect(NAME_TAKEN, "local planner 'bspline' exists already");
  // The wall holds for plug-ins: the simulator's functions are not to be had.
  expect(BEYOND_THE_WALL, "undefined symbol");
}

}  // namespace
}  // namespace arex
