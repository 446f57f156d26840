// Flights recorded and replayed: the estimates and maps of the flight come back.

#include "run/replay.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "evaluation/trajectory_file.h"
#include "run/simulation.h"
#include "support/process.h"
#include "support/temporary_folder.h"

namespace arex::sim {
namespace {

using arex::test::ProcessResult;
using arex::test::read_text;
using arex::test::run_process;
using arex::test::TemporaryFolder;
using arex::test::write_text;

constexpr const char* kHop = R"(
world: {kind: forest, forest: {size_m: [20, 20], tree_density_per_m2: 0.03}}
mapping: {use_depth: false}
mission: {kind: waypoints, waypoints_m: [[2, 0, 1.2], [2, 1.5, 1.2]], takeoff_height_m: 1.0, max_time_s: 60}
odometries: {coarse: {type: lidar_inertial, registration: {max_points: 1000}}}
)";

Scenario hop(const std::filesystem::path& folder) {
  write_text(folder / "hop.yaml", kHop);
  return load_scenario(folder / "hop.yaml", {}, std::nullopt);
}

void fly(const Scenario& scenario, const std::filesystem::path& folder, const BagOptions& options) {
  BagWriter bag(folder / "flight.bag", scenario.config.stack.vehicle, options);
  Recorder recorder(folder / "flown", scenario.resolved_yaml());
  Simulation simulation(scenario, 2);
  simulation.record_to(recorder);
  simulation.record_to(bag);
  while (simulation.tick()) {
  }
  const FlightResult result = simulation.finish();
  ASSERT_EQ(result.outcome, Outcome::kSucceeded) << result.reason;
  bag.close();
  recorder.flush();
}

/// Every figure of the texts, without the rows that only one of them may have.
void expect_same_trajectory(const std::filesystem::path& flown,
                            const std::filesystem::path& replayed, const std::string& what) {
  const Trajectory a = read_trajectory(flown), b = read_trajectory(replayed);
  ASSERT_GT(a.poses.size(), 1000U) << what;
  ASSERT_EQ(a.poses.size(), b.poses.size()) << what;
  for (std::size_t i = 0; i < a.poses.size(); ++i) {
    ASSERT_NEAR(a.poses[i].time_s, b.poses[i].time_s, 1e-9) << what << " " << i;
    ASSERT_LT((a.poses[i].X.p - b.poses[i].X.p).norm(), 1e-6) << what << " " << i;
    ASSERT_LT((a.poses[i].X.R - b.poses[i].X.R).norm(), 1e-6) << what << " " << i;
  }
}

class RecordedFlight : public testing::TestWithParam<BagLayout> {};

TEST_P(RecordedFlight, GivesItsEstimatesAndItsMapWhenReplayed) {
  const TemporaryFolder folder;
  const Scenario flown = hop(folder.path());
  BagOptions options;
  options.layout = GetParam();
  options.compression = BagCompression::kLz4;
  fly(flown, folder.path(), options);
  if (HasFatalFailure()) return;

  Scenario scenario = hop(folder.path());
  ReplayInput input(folder / "flight.bag", {});
  prepare_for_replay(scenario, input);
  EXPECT_EQ(scenario.resolved_yaml(), flown.resolved_yaml());  // our mount, from /tf_static
  Recorder recorder(folder / "replayed", scenario.resolved_yaml());
  Replay replay(scenario, input, 1);
  replay.record_to(recorder);
  while (replay.tick()) {
  }
  const ReplayResult result = replay.finish(input.read_truth());
  recorder.flush();
  EXPECT_EQ(result.outcome(), "succeeded");
  EXPECT_LT(result.odometry.ate_rmse_m, 0.05);
  EXPECT_GT(result.odometry.ate_rmse_m, 1e-4);  // it is compared with the truth, not with itself
  EXPECT_EQ(input.imu_counts().missing + input.imu_counts().unordered, 0U);
  EXPECT_EQ(input.lidar_counts().missing + input.lidar_counts().damaged, 0U);
  for (const char* name : {"estimate.tum", "coarse.tum"}) {
    expect_same_trajectory(folder / "flown" / name, folder / "replayed" / name, name);
  }
  // The flight was scored in O from its first pose on: so is the recording, but for the rounding.
  expect_same_trajectory(folder / "flown/truth.tum", folder / "replayed/truth.tum", "truth");
  EXPECT_TRUE(read_text(folder / "flown/cloud.pcd") == read_text(folder / "replayed/cloud.pcd"));
}

INSTANTIATE_TEST_SUITE_P(Layouts, RecordedFlight,
                         testing::Values(BagLayout::kGeneric, BagLayout::kLivoxDriver2,
                                         BagLayout::kLivoxCustom),
                         [](const auto& layout) {
                           return std::string(
                               kBagLayoutNames[static_cast<std::size_t>(layout.param)]);
                         });

TEST(ReplayCommand, WritesAScoredRunFolderAndRefusesWithOneLine) {
  const TemporaryFolder folder;
  fly(hop(folder.path()), folder.path(), {});
  if (HasFatalFailure()) return;
  const std::string bag = (folder / "flight.bag").string(), out = (folder / "out").string();
  const ProcessResult done = run_process(AREX_BINARY, {"replay", bag, "--out", out, "--quiet"});
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_EQ(done.err, "");
  const auto summary = nlohmann::json::parse(read_text(folder / "out/summary.json"));
  EXPECT_EQ(summary["outcome"], "succeeded");
  EXPECT_LT(summary["odometry"]["ate_rmse_m"].get<double>(), 0.05);
  EXPECT_EQ(summary["replay"]["imu"]["topic"], "/imu/data");
  EXPECT_EQ(summary["replay"]["truth_topic"], "/truth");
  EXPECT_TRUE(std::filesystem::exists(folder / "out/report.html"));
  EXPECT_TRUE(std::filesystem::exists(folder / "out/map.bt"));

  const auto refused = [&](std::vector<std::string> arguments, const std::string& why) {
    arguments.insert(arguments.begin(), "replay");
    const ProcessResult result = run_process(AREX_BINARY, arguments);
    EXPECT_EQ(result.exit_code, 2) << result.err;
    EXPECT_NE(result.err.find(why), std::string::npos) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  };
  const std::string other = (folder / "other").string();
  refused({(folder / "none.bag").string(), "--out", other}, "No such file");
  refused({(folder / "hop.yaml").string(), "--out", other}, "is no recording");
  refused({bag, "--out", other, "--lidar-topic", "/livox/lidr"}, "did you mean '/livox/lidar'?");
  refused({bag, "--out", other, "--imu-topic", "/truth"}, "expected sensor_msgs/Imu");
  refused({bag, "--out", other, "--set", "odometry.source=mocap"}, "mocap");
  EXPECT_FALSE(std::filesystem::exists(other));
}

}  // namespace
}  // namespace arex::sim
