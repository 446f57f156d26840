#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <thread>

#include "support/process.h"

// The contract of the command line, kept by the binary itself.
namespace arex {
namespace {

using Result = test::ProcessResult;
using test::read_text;
using test::TemporaryFolder;
using test::write_text;

constexpr const char* kWaypoints = AREX_SOURCE_DIR "/scenarios/waypoints.yaml";

test::Process start(const std::vector<std::string>& arguments, const TemporaryFolder& folder) {
  return {AREX_BINARY, arguments, folder.path()};
}

Result run(const std::vector<std::string>& arguments) {
  return test::run_process(AREX_BINARY, arguments);
}

void wait_for(const std::filesystem::path& file, std::size_t bytes) {
  for (int i = 0; i < 1200; ++i) {
    std::error_code ignored;
    if (std::filesystem::exists(file, ignored) &&
        std::filesystem::file_size(file, ignored) > bytes) {
      return;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  FAIL() << file << " did not grow";
}

// Exit code 2, one line that begins with the position, nothing written.
void expect_refused(const std::string& yaml, const std::vector<std::string>& extra,
                    const std::string& expected) {
  const TemporaryFolder folder;
  write_text(folder / "bad.yaml", yaml);
  std::vector<std::string> arguments{"run", (folder / "bad.yaml").string(), "--quiet", "--out",
                                     (folder / "out").string()};
  arguments.insert(arguments.end(), extra.begin(), extra.end());
  const Result result = run(arguments);
  EXPECT_EQ(result.exit_code, 2) << yaml;
  EXPECT_NE(result.err.find(expected), std::string::npos) << result.err;
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "out"));
}

TEST(CommandLine, RefusesBadInputWithOneLineAndWritesNothing) {
  expect_refused("seed: 1\nplan: 2\n", {}, "bad.yaml:2: unknown key 'plan'");
  expect_refused("mission:\n  max_time_s: long\n", {}, "bad.yaml:2: 'max_time_s' is 'long'");
  expect_refused("mission:\n  max_time_s: -1\n", {},
                 "bad.yaml:2: out of range: expected max_time_s > 0");
  expect_refused("mission:\n  max_time_s: .nan\n", {}, "bad.yaml:2: 'max_time_s' is '.nan'");
  expect_refused("seed: 1\nseed: 2\n", {}, "bad.yaml:2: duplicate key 'seed'");
  expect_refused("seed: 1\n", {"--set", "misson.max_time_s=1"}, "did you mean 'mission'?");
  expect_refused("seed: 1\n", {"--set", "seed"}, "expected key=value");
  expect_refused("seed: 1\n", {"--threads", "none"}, "--threads");
  expect_refused("seed: 1\n", {"--seed", "-1"}, "--seed");
  expect_refused("seed: 1\n", {"--require", "colisions==0"}, "did you mean 'collisions'?");
  expect_refused("seed: 1\n", {"--junit", "/does/not/exist/x.xml"}, "/does/not/exist/x.xml");
  expect_refused("seed: 1\n", {"--bag", "/does/not/exist/x.bag"}, "/does/not/exist/x.bag");
  const Result missing = run({"run", "/does/not/exist.yaml"});
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_EQ(missing.err, "/does/not/exist.yaml:1: cannot be read, expected a YAML file\n");
  EXPECT_EQ(run({"fly"}).exit_code, 2);
  EXPECT_EQ(run({}).exit_code, 2);
}

TEST(CommandLine, ListsParametersAndValidatesScenarios) {
  const Result params = run({"params", kWaypoints, "--set", "mission.max_time_s=77"});
  EXPECT_EQ(params.exit_code, 0);
  EXPECT_NE(params.out.find("mission.max_time_s"), std::string::npos);
  EXPECT_NE(params.out.find("  77 "), std::string::npos);
  EXPECT_EQ(run({"params"}).exit_code, 0);
  EXPECT_EQ(run({"validate", kWaypoints}).exit_code, 0);
  EXPECT_EQ(run({"--help"}).exit_code, 0);
}

TEST(CommandLine, PrintsThePatternOfTheDevice) {
  const Result result = run({"pattern", "--mode", "table", "--shots", "100"});
  EXPECT_EQ(result.exit_code, 0);
  std::istringstream lines(result.out);
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line, "time_s,line,azimuth_deg,elevation_deg");
  int count = 0;
  while (std::getline(lines, line)) ++count;
  EXPECT_EQ(count, 400);
  EXPECT_EQ(run({"pattern", "--mode", "other"}).exit_code, 2);
}

TEST(CommandLine, ARunThatFailsStillLeavesEverythingAndRunsAgainFromItsResolvedForm) {
  const TemporaryFolder folder;
  const Result first = run({"run", kWaypoints, "--set", "mission.max_time_s=6", "--seed", "5",
                            "--quiet", "--out", (folder / "a").string()});
  EXPECT_EQ(first.exit_code, 1) << first.err;  // timed out
  const auto summary = nlohmann::json::parse(read_text(folder / "a/summary.json"));
  EXPECT_EQ(summary["outcome"], "timed_out");
  EXPECT_EQ(summary["seed"], 5);
  EXPECT_EQ(summary["scenario"], "waypoints");
  EXPECT_DOUBLE_EQ(summary["sim_time_s"].get<double>(), 6.0);
  for (const char* key : {"reason", "wall_time_s", "cpu_time_s", "real_time_factor",
                          "trajectory_hash", "distance_m", "targets", "coverage", "map", "odometry",
                          "planner", "clearance", "collisions", "battery", "build"}) {
    EXPECT_TRUE(summary.contains(key)) << key;
  }
  for (const char* file :
       {"resolved.yaml", "truth.tum", "estimate.tum", "events.csv", "timing.csv", "report.html"}) {
    EXPECT_GT(std::filesystem::file_size(folder / "a" / file), 0u) << file;
  }
  const Result again = run({"run", (folder / "a/resolved.yaml").string(), "--quiet", "--threads",
                            "2", "--no-report", "--out", (folder / "b").string()});
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_FALSE(std::filesystem::exists(folder / "b/report.html"));
  const auto summary_again = nlohmann::json::parse(read_text(folder / "b/summary.json"));
  EXPECT_EQ(summary_again["trajectory_hash"], summary["trajectory_hash"]);
  EXPECT_EQ(summary_again["sensor_hash"], summary["sensor_hash"]);
}

TEST(CommandLine, RequirementsDecideTheExitCodeOfASuccessAndAreReported) {
  const TemporaryFolder folder;
  const std::string junit = (folder / "junit.xml").string();
  std::vector<std::string> arguments{"run",
                                     AREX_SOURCE_DIR "/scenarios/yaw_burst.yaml",
                                     "--set",
                                     "mission.yaw_rates_radps=[1]",
                                     "--set",
                                     "mission.yaw_burst_s=1",
                                     "--quiet",
                                     "--out",
                                     (folder / "run").string(),
                                     "--junit",
                                     junit,
                                     "--require",
                                     "collisions==0"};
  const Result met = run(arguments);
  EXPECT_EQ(met.exit_code, 0) << met.err;
  EXPECT_NE(read_text(junit).find("tests=\"2\" failures=\"0\""), std::string::npos);
  arguments.insert(arguments.end(), {"--require", "distance_m>=100"});
  const Result violated = run(arguments);
  EXPECT_EQ(violated.exit_code, 1);
  EXPECT_EQ(violated.err.find("arex: required distance_m>=100, but distance_m is "), 0u)
      << violated.err;
  EXPECT_EQ(std::count(violated.err.begin(), violated.err.end(), '\n'), 1) << violated.err;
  EXPECT_NE(read_text(junit).find("tests=\"3\" failures=\"1\""), std::string::npos);
}

TEST(CommandLine, AnInterruptedRunKeepsWhatItFlew) {
  const TemporaryFolder folder;
  const auto process =
      start({"run", kWaypoints, "--quiet", "--out", (folder / "run").string()}, folder);
  wait_for(folder / "run/truth.tum", 100'000);
  process.signal(SIGINT);
  EXPECT_EQ(process.wait().exit_code, 130);
  const auto summary = nlohmann::json::parse(read_text(folder / "run/summary.json"));
  EXPECT_EQ(summary["outcome"], "interrupted");
}

TEST(CommandLine, AKilledRunLeavesNothingThatLooksFinished) {
  const TemporaryFolder folder;
  const auto process =
      start({"run", kWaypoints, "--quiet", "--out", (folder / "run").string()}, folder);
  wait_for(folder / "run/truth.tum", 100'000);
  process.signal(SIGKILL);
  EXPECT_EQ(process.wait().exit_code, 128 + SIGKILL);
  EXPECT_FALSE(std::filesystem::exists(folder / "run/summary.json"));
  EXPECT_NE(read_text(folder / "run/events.csv").find("mission_state"), std::string::npos);
}

TEST(CommandLine, ReportNamesAFolderWithoutARun) {
  const TemporaryFolder folder;
  const std::string name = folder.path().string();
  for (const std::string& bad : {name, name + "/nowhere"}) {
    const Result result = run({"report", bad});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_EQ(result.err, bad + ":1: expected a run folder or the folder of a sweep\n");
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(CommandLine, ReportsUnfinishedRunsAndComparesSeveral) {
  const TemporaryFolder folder;
  for (const char* name : {"a", "b"}) {
    std::filesystem::create_directory(folder / name);
    write_text(folder / name / "resolved.yaml", "seed: 1\n");
  }
  const std::string a = (folder / "a").string(), b = (folder / "b").string();
  EXPECT_EQ(run({"report", a}).out, a + "/report.html (unfinished run)\n");
  EXPECT_FALSE(std::filesystem::exists(folder / "report.html"));
  EXPECT_EQ(run({"report", a, b}).exit_code, 0);
  EXPECT_NE(read_text(folder / "report.html").find("href=\"./a/report.html\""), std::string::npos);
}

TEST(CommandLine, RenderRefusesWhatItCannotDraw) {
  const TemporaryFolder folder;
  const std::string name = folder.path().string();
  EXPECT_EQ(run({"render", name, "--out", name + "/x.gif"}).err,
            "--out " + name + "/x.gif: expected FILE.png or FILE.mp4\n");
  const Result result = run({"render", name, "--out", name + "/x.mp4"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_EQ(result.err, name + "/truth.tum:1: holds no pose, expected a flown run\n");
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace arex
