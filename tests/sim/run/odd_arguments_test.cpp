#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "arex_binary.h"
#include "support/process.h"

// What a command line gives that cannot be meant, or has no effect.
namespace arex {
namespace {

using Result = test::ProcessResult;
using test::TemporaryFolder;
using test::write_text;

constexpr const char* kWaypointsFile = AREX_SOURCE_DIR "/scenarios/waypoints.yaml";

void expect_one_line(const std::vector<std::string>& arguments, const std::string& line) {
  const Result result = run_arex(arguments);
  EXPECT_EQ(result.exit_code, 2) << line;
  EXPECT_TRUE(result.err.starts_with(line)) << result.err;
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
}

// As a shell leaves them where a variable is not set: no command takes its default for what was
// asked, or the working directory for a folder.
TEST(OddArguments, RefusesEmptyWordsWhereverTheyStand) {
  const std::vector<std::pair<std::vector<std::string>, std::vector<std::string>>> commands{
      {{"run", kWaypointsFile},
       {"--out", "--name", "--bag", "--bag-layout", "--junit", "--set", "--require", "--snapshot",
        "--seed", "--threads"}},
      {{"validate", kWaypointsFile}, {"--set"}},
      {{"params", kWaypointsFile}, {"--set"}},
      {{"world", kWaypointsFile}, {"--out", "--set"}},
      {{"sweep", "s.yaml"}, {"--out", "--jobs"}},
      {{"replay", "r.bag"}, {"--out", "--config", "--truth", "--lidar-topic", "--snapshot"}},
      {{"blame", "run"}, {"--out"}},
      {{"report", "run"}, {}},
      {{"render", "run"}, {"--out", "--what", "--view", "--time"}},
      {{"semantics", "run"}, {"--out", "--set"}},
      {{"evaluate", "run"}, {"--out", "--truth", "--delta"}},
      {{"sparse"}, {"--out", "--thickness"}},
      {{"pattern"}, {"--mode"}},
      {{"help"}, {}},
  };
  for (const auto& [words, options] : commands) {
    const std::string command = "arex " + words.front() + ": ";
    for (const std::string& option : options) {
      std::vector<std::string> apart = words, together = words;
      apart.insert(apart.end(), {option, ""});
      together.push_back(option + "=");
      expect_one_line(apart, command + option + " is empty, expected a value");
      expect_one_line(together, command + option + " is empty, expected a value");
    }
    expect_one_line({words.front(), ""}, command + "an argument is empty, expected a value");
    expect_one_line({words.front(), "--", ""}, command + "an argument is empty");
  }
}

// A sweep or a blame takes devices away: what was to befall them is told, and flown without.
TEST(OddArguments, SaysWhichFaultsCanHaveNoEffect) {
  const TemporaryFolder folder;
  write_text(folder / "s.yaml",
             "world: {kind: empty, empty: {size_m: [20, 20]}}\nlidar: {enabled: false}\n"
             "mapping: {enabled: false, use_depth: false}\nodometry: {source: mocap}\n"
             "faults: [{device: imu, kind: delayed}, {device: lidar, kind: silent}]\n"
             "mission: {kind: waypoints, waypoints_m: [[1, 0, 1]], max_time_s: 0.2}\n");
  const std::string file = (folder / "s.yaml").string();
  const std::string line =
      "arex: faults: item 2, lidar silent from 0 s, has no effect: lidar.enabled is false\n";
  const Result flown =
      run_arex({"run", file, "--quiet", "--no-report", "--out", (folder / "run").string()});
  EXPECT_EQ(flown.exit_code, 1);  // timed out
  EXPECT_EQ(flown.err.substr(0, line.size()), line);
  EXPECT_EQ(std::count(flown.err.begin(), flown.err.end(), '\n'), 2) << flown.err;
  const Result valid = run_arex({"validate", file});
  EXPECT_EQ(valid.exit_code, 0);
  EXPECT_EQ(valid.err, line);
}

}  // namespace
}  // namespace arex
