// Flights recorded and replayed: the estimates and maps of the flight come back.

#include "run/replay.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <deque>
#include <nlohmann/json.hpp>

#include "evaluation/trajectory_file.h"
#include "run/simulation.h"
#include "run/snapshot.h"
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

Scenario hop(const std::filesystem::path& folder, const std::vector<std::string>& overrides = {}) {
  write_text(folder / "hop.yaml", kHop);
  return load_scenario(folder / "hop.yaml", overrides, std::nullopt);
}

struct RecordedBag {
  std::string file;
  BagOptions options;
};

/// Flies it once, into the folder `flown` and as many bags.
/// @param snapshots in the flight's time
FlightResult fly(const Scenario& scenario, const std::filesystem::path& folder,
                 const std::vector<RecordedBag>& recorded,
                 const std::vector<Stamp>& snapshots = {}) {
  std::deque<BagWriter> bags;
  Recorder recorder(folder / "flown", scenario.resolved_yaml());
  SnapshotTaker taker(folder / "flown", snapshots, scenario.config.stack);
  Simulation simulation(scenario, 2);
  simulation.record_to(recorder);
  for (const RecordedBag& bag : recorded) {
    bags.emplace_back(folder / bag.file, scenario.config.stack.vehicle, bag.options);
    simulation.record_to(bags.back());
  }
  while (simulation.tick()) taker.update(simulation.now(), simulation.software());
  const FlightResult result = simulation.finish();
  EXPECT_EQ(result.outcome, Outcome::kSucceeded) << result.reason;
  for (BagWriter& bag : bags) bag.close();
  recorder.flush();
  return result;
}

/// Replays it into the folder `replayed`.
ReplayResult replay(Scenario& scenario, ReplayInput& input, const std::filesystem::path& folder,
                    const std::vector<Stamp>& snapshots = {}) {
  prepare_for_replay(scenario, input);
  Recorder recorder(folder / "replayed", scenario.resolved_yaml());
  SnapshotTaker taker(folder / "replayed", snapshots, scenario.config.stack);
  Replay replay(scenario, input, 1);
  replay.record_to(recorder);
  while (replay.tick()) taker.update(replay.now(), replay.software());
  ReplayResult result = replay.finish(input.read_truth());
  recorder.flush();
  return result;
}

/// Every figure of the texts, without the rows that only one of them may have.
void expect_same_trajectory(const std::filesystem::path& folder, const std::string& name) {
  const Trajectory a = read_trajectory(folder / "flown" / name);
  const Trajectory b = read_trajectory(folder / "replayed" / name);
  ASSERT_GT(a.poses.size(), 1000U) << name;
  ASSERT_EQ(a.poses.size(), b.poses.size()) << name;
  for (std::size_t i = 0; i < a.poses.size(); ++i) {
    ASSERT_NEAR(a.poses[i].time_s, b.poses[i].time_s, 1e-9) << name << " " << i;
    ASSERT_LT((a.poses[i].X.p - b.poses[i].X.p).norm(), 1e-6) << name << " " << i;
    ASSERT_LT((a.poses[i].X.R - b.poses[i].X.R).norm(), 1e-6) << name << " " << i;
  }
}

// One flight in every layout and container, every other one packed, and every other one of these
// with the firings that returned nothing.
TEST(RecordedFlight, GivesItsEstimatesAndItsMapWhenReplayed) {
  const TemporaryFolder folder;
  const Scenario flown = hop(folder.path());
  std::vector<RecordedBag> bags;
  for (const char* ending : {".bag", ".mcap"}) {
    for (std::size_t i = 0; i < kBagLayoutNames.size(); ++i) {
      BagOptions options;
      options.layout = static_cast<BagLayout>(i);
      if (bags.size() % 2 == 0) options.compression = BagCompression::kLz4;
      options.lidar_misses = bags.size() % 4 < 2;
      bags.push_back({std::string(kBagLayoutNames[i]) + ending, options});
    }
  }
  const FlightResult flight = fly(flown, folder.path(), bags);
  ASSERT_FALSE(testing::Test::HasFailure());
  ASSERT_GT(flight.lidar_misses, 10'000);

  for (const RecordedBag& bag : bags) {
    SCOPED_TRACE(bag.file);
    Scenario scenario = hop(folder.path());
    ReplayInput input(folder / bag.file, {});
    const ReplayResult result = replay(scenario, input, folder.path());
    EXPECT_EQ(scenario.resolved_yaml(), flown.resolved_yaml());  // our mount, from /tf_static
    EXPECT_EQ(result.outcome(), "succeeded");
    EXPECT_LT(result.odometry.ate_rmse_m, 0.05);
    EXPECT_GT(result.odometry.ate_rmse_m, 1e-4);  // it is compared with the truth, not with itself
    EXPECT_NEAR(result.odometry.nees_position / flight.flight.odometry.nees_position, 1, 0.01);
    EXPECT_NEAR(result.odometry.nees_rotation / flight.flight.odometry.nees_rotation, 1, 0.01);
    EXPECT_EQ(input.imu_counts().missing + input.imu_counts().unordered, 0U);
    EXPECT_EQ(input.lidar_counts().missing + input.lidar_counts().damaged, 0U);
    EXPECT_EQ(input.lidar_misses(),
              bag.options.lidar_misses ? static_cast<std::uint64_t>(flight.lidar_misses) : 0U);
    // The flight was scored in O from its first pose on: so is the recording, but for the rounding.
    for (const char* name : {"estimate.tum", "coarse.tum", "truth.tum"}) {
      expect_same_trajectory(folder.path(), name);
    }
    EXPECT_TRUE(read_text(folder / "flown/cloud.pcd") == read_text(folder / "replayed/cloud.pcd"));
    EXPECT_TRUE(read_text(folder / "flown/map.bt") == read_text(folder / "replayed/map.bt"));
    std::filesystem::remove(folder / bag.file);
  }
}

// What its cameras saw, too: the depth images in the local grid, the infrared pair in an odometry.
TEST(RecordedFlight, GivesWhatItsCamerasSawWhenReplayed) {
  const TemporaryFolder folder;
  const std::vector<std::string> cameras{"mapping.use_depth=true",
                                         "odometries.vio.type=visual_inertial",
                                         "odometries.vio.report_features=true"};
  const std::vector<Stamp> times{8 * kNanosecondsPerSecond};
  const Scenario flown = hop(folder.path(), cameras);
  BagOptions options;
  options.infrared = true;
  options.infrared_baseline_m = flown.config.depth.model.baseline_m;
  const FlightResult flight = fly(flown, folder.path(), {{"flight.mcap", options}}, times);
  ASSERT_FALSE(testing::Test::HasFailure());
  const auto snapshot_of = [&](const char* run, const char* file) {
    return read_text(folder / run / "snapshots/8" / file);
  };

  Scenario scenario = hop(folder.path(), cameras);
  ReplayInput input(folder / "flight.mcap", {});
  const ReplayResult result = replay(scenario, input, folder.path(), times);
  EXPECT_EQ(scenario.resolved_yaml(), flown.resolved_yaml());
  EXPECT_EQ(result.outcome(), "succeeded");
  EXPECT_EQ(input.depth_topic(), "/camera/depth");
  EXPECT_EQ(input.infrared_topic(), "/camera/infra1/image_rect_raw");
  for (const MessageCounts& counts : {input.depth_counts(), input.infrared_counts()}) {
    EXPECT_GT(counts.used, 20U);
    EXPECT_EQ(counts.damaged + counts.unordered + counts.doubled, 0U);
  }
  for (const char* name : {"estimate.tum", "vio.tum"}) expect_same_trajectory(folder.path(), name);
  EXPECT_GT(read_text(folder / "flown/vio_features.csv").size(), 10'000U);
  EXPECT_TRUE(read_text(folder / "flown/vio_features.csv") ==
              read_text(folder / "replayed/vio_features.csv"));
  const auto& tally = flight.flight.others.at("vio").tally;
  const auto& again = result.others.at("vio").tally;
  ASSERT_TRUE(tally && again);
  EXPECT_GT(again->keyframes, 5);
  EXPECT_EQ(again->keyframes, tally->keyframes);
  EXPECT_EQ(again->tracked, tally->tracked);
  EXPECT_TRUE(snapshot_of("flown", "cloud.pcd") == snapshot_of("replayed", "cloud.pcd"));
  EXPECT_TRUE(snapshot_of("flown", "grid.bt") == snapshot_of("replayed", "grid.bt"));

  Scenario blind = hop(folder.path());
  ReplayInput without(folder / "flight.mcap", {});
  replay(blind, without, folder.path(), times);
  EXPECT_EQ(without.depth_topic() + without.infrared_topic(), "");
  EXPECT_FALSE(snapshot_of("flown", "grid.bt") == snapshot_of("replayed", "grid.bt"));
}

TEST(ReplayCommand, WritesAScoredRunFolderAndRefusesWithOneLine) {
  const TemporaryFolder folder;
  fly(hop(folder.path()), folder.path(), {{"flight.bag", {}}});
  ASSERT_FALSE(testing::Test::HasFailure());
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

  const auto line = [](const std::vector<std::string>& arguments, const std::string& why) {
    const ProcessResult result = run_process(AREX_BINARY, arguments);
    EXPECT_EQ(result.exit_code, 2) << result.err;
    EXPECT_NE(result.err.find(why), std::string::npos) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  };
  // Nobody said in which world it was recorded.
  const std::string picture = (folder / "picture.png").string();
  line({"render", out, "--out", picture}, "knows no world");
  line({"render", out, "--what", "infrared", "--out", picture}, "knows no world");
  const auto refused = [&](std::vector<std::string> arguments, const std::string& why) {
    arguments.insert(arguments.begin(), "replay");
    line(arguments, why);
  };
  const std::string other = (folder / "other").string();
  refused({(folder / "none.bag").string(), "--out", other}, "No such file");
  refused({(folder / "hop.yaml").string(), "--out", other}, "is no recording");
  refused({bag, "--out", other, "--lidar-topic", "/livox/lidr"}, "did you mean '/livox/lidar'?");
  refused({bag, "--out", other, "--imu-topic", "/truth"}, "expected sensor_msgs/Imu");
  refused({bag, "--out", other, "--set", "odometry.source=mocap"}, "mocap");
  refused({bag, "--out", other, "--set", "odometry.source=visual_inertial"},
          "expected a recording with a rectified infrared pair");
  refused({bag, "--out", other, "--depth-topic", "/camera/depth"}, "no images can be read");
  refused({bag, "--out", other, "--snapshot", "0"}, "expected seconds above 0");
  EXPECT_FALSE(std::filesystem::exists(other));
}

}  // namespace
}  // namespace arex::sim
