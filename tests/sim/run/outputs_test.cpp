#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>

#include <nlohmann/json.hpp>
#include <thread>

#include "support/process.h"

// What a run writes: refused before take-off or written, never in the place of something else.
namespace arex {
namespace {

namespace fs = std::filesystem;
using test::Process;
using test::ProcessResult;
using test::read_text;
using test::TemporaryFolder;
using test::write_text;

constexpr const char* kWaypoints = AREX_SOURCE_DIR "/scenarios/waypoints.yaml";

// A flight of a fifth of a second that ends by timed_out; it costs next to nothing.
constexpr const char* kHop =
    "world: {kind: forest, forest: {size_m: [20, 20], tree_density_per_m2: 0.02}}\n"
    "mission: {kind: waypoints, waypoints_m: [[1, 0, 1]], max_time_s: 0.2}\n"
    "lidar: {enabled: false}\nodometry: {source: mocap}\nmapping: {use_depth: false}\n";

/// A folder with hop.yaml in it, which is also where the program is started.
class RunOutputs : public ::testing::Test {
 protected:
  RunOutputs() { write_text(folder_ / "hop.yaml", kHop); }

  /// @param shell what a shell does with "$@", the command
  [[nodiscard]] ProcessResult arex(const std::vector<std::string>& arguments,
                                   const std::string& shell = "exec \"$@\"") const {
    std::vector<std::string> words{"-c", "cd \"$0\" && " + shell, folder_.path().string(),
                                   AREX_BINARY};
    words.insert(words.end(), arguments.begin(), arguments.end());
    return test::run_process("/bin/sh", words);
  }
  [[nodiscard]] ProcessResult hop(const std::vector<std::string>& more,
                                  const std::string& shell = "exec \"$@\"") const {
    std::vector<std::string> arguments{"run", "hop.yaml", "--no-report"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arex(arguments, shell);
  }
  void expect_refused(const std::vector<std::string>& more, const std::string& said,
                      const std::string& shell = "exec \"$@\"") const {
    const auto before = names();
    const ProcessResult result = hop(more, shell);
    EXPECT_EQ(result.exit_code, 2) << said;
    EXPECT_NE(result.err.find(said), std::string::npos) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_EQ(names(), before) << "something was written or lost";
  }
  /// Everything in the folder with its kind.
  [[nodiscard]] std::map<std::string, int> names() const {
    std::map<std::string, int> all;
    for (const auto& entry : fs::recursive_directory_iterator(folder_.path())) {
      all[entry.path().string()] = static_cast<int>(entry.symlink_status().type());
    }
    return all;
  }
  [[nodiscard]] nlohmann::json summary(const std::string& run = "run") const {
    return nlohmann::json::parse(read_text(folder_ / run / "summary.json"), nullptr, false);
  }
  [[nodiscard]] Process fly_waypoints(const TemporaryFolder& said,
                                      const std::vector<std::string>& more = {}) const {
    std::vector<std::string> arguments{"run", kWaypoints, "--quiet", "--out",
                                       (folder_ / "run").string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return {AREX_BINARY, arguments, said.path()};
  }
  void wait_for(const std::string& file, std::uintmax_t bytes = 0) const {
    std::error_code none;
    for (int i = 0; i < 6000; ++i) {
      if (fs::exists(folder_ / file, none) && fs::file_size(folder_ / file, none) >= bytes) return;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    FAIL() << file << " does not appear";
  }

  TemporaryFolder folder_;
};

TEST_F(RunOutputs, NothingButARegularFileIsEverReplaced) {
  fs::create_directory(folder_ / "folder");
  ASSERT_EQ(mkfifo((folder_ / "fifo").c_str(), 0600), 0);
  fs::create_symlink("nowhere", folder_ / "dangling");
  fs::create_symlink("/dev/null", folder_ / "device");
  for (const char* option : {"--bag", "--junit"}) {
    expect_refused({option, "folder", "--out", "run"}, "folder: is a folder, expected a file");
    expect_refused({option, "fifo", "--out", "run"}, "fifo: is a FIFO, expected a file");
    expect_refused({option, "dangling", "--out", "run"},
                   "dangling: is a symbolic link that points");
    expect_refused({option, "device", "--out", "run"}, "device: is a device, expected a file");
    expect_refused({option, "missing/x", "--out", "run"}, "missing/x: cannot be written: No such");
    expect_refused({option, "hop.yaml/x", "--out", "run"}, "hop.yaml/x: cannot be written");
  }
  if (mknod((folder_ / "null").c_str(), S_IFCHR | 0600, makedev(1, 3)) == 0) {
    expect_refused({"--bag", "null", "--out", "run"}, "null: is a device, expected a file");
  }
}

TEST_F(RunOutputs, TheRunFolderMustBeOneOrBecomeOne) {
  fs::create_symlink("nowhere", folder_ / "dangling");
  ASSERT_EQ(mkfifo((folder_ / "fifo").c_str(), 0600), 0);
  expect_refused({"--out", "hop.yaml"}, "hop.yaml: cannot be a folder to write");
  expect_refused({"--out", "hop.yaml/run"}, "hop.yaml/run: cannot be a folder to write");
  expect_refused({"--out", "dangling"}, "dangling: cannot be a folder to write");
  expect_refused({"--out", "fifo"}, "fifo: cannot be a folder to write");
  expect_refused({"--out", "new/and/deep", "--bag", "missing/x"}, "missing/x");
  // What is there and is no run's stays there.
  fs::create_directories(folder_ / "mine");
  write_text(folder_ / "mine/map.bt", "my own map");
  expect_refused({"--out", "mine"}, "mine: holds map.bt and no resolved.yaml");
  fs::create_directories(folder_ / "sweep");
  write_text(folder_ / "sweep/sweep.json", "{}");
  expect_refused({"--out", "sweep"}, "sweep: holds a sweep");
  fs::create_directories(folder_ / "run/events.csv");
  write_text(folder_ / "run/resolved.yaml", "seed: 1\n");
  expect_refused({"--out", "run"}, "events.csv: is no regular file");
}

TEST_F(RunOutputs, AFolderThatMayNotBeWrittenIsRefused) {
  // Root may write everywhere, unless it gives that up.
  const std::string caps = "-dac_override,-dac_read_search";
  const std::string shell =
      geteuid() == 0 ? "exec setpriv --inh-caps=" + caps + " --bounding-set=" + caps + " -- \"$@\""
                     : "exec \"$@\"";
  fs::create_directory(folder_ / "locked");
  fs::permissions(folder_ / "locked", fs::perms(0555));
  expect_refused({"--out", "locked/run"}, "locked/run: cannot be a folder to write", shell);
  expect_refused({"--out", "locked"}, "cannot be written: Permission denied", shell);
  expect_refused({"--out", "run", "--bag", "locked/x.bag"}, "locked/x.bag: cannot be written",
                 shell);
}

TEST_F(RunOutputs, NoTwoNamesMayMeanOneFile) {
  fs::create_directory(folder_ / "run");
  expect_refused({"--out", "run", "--bag", "x", "--junit", "./x"}, "are the same file");
  expect_refused({"--out", "run", "--junit", "run/summary.json"}, "are the same file");
  expect_refused({"--out", "run", "--bag", "run/../run/truth.tum"}, "are the same file");
  expect_refused({"--out", "run", "--junit", "hop.yaml"}, "are the same file");
  fs::create_hard_link(folder_ / "hop.yaml", folder_ / "link.yaml");
  expect_refused({"--out", "run", "--junit", "link.yaml"}, "are the same file");
}

TEST_F(RunOutputs, ABagMayLieInTheRunFolderAndALinkedOneFillsItsTarget) {
  EXPECT_EQ(hop({"--quiet", "--out", "run", "--bag", "run/x.bag"}).exit_code, 1);
  EXPECT_EQ(read_text(folder_ / "run/x.bag").substr(0, 12), "#ROSBAG V2.0");
  write_text(folder_ / "target", "older");
  fs::create_symlink("target", folder_ / "link");
  EXPECT_EQ(hop({"--quiet", "--out", "run", "--junit", "link"}).exit_code, 1);
  EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
  EXPECT_NE(read_text(folder_ / "target").find("<testsuite"), std::string::npos);
}

TEST_F(RunOutputs, ANameOfAnyBytesStillEndsWithASummary) {
  const std::string name = "\xff\xfe\n\x1b[31m";
  fs::copy_file(folder_ / "hop.yaml", folder_ / (name + ".yaml"));
  const ProcessResult result = arex({"run", name + ".yaml", "--no-report", "--junit", "junit.xml"});
  EXPECT_EQ(result.exit_code, 1) << result.err;
  EXPECT_EQ(result.out.find('\x1b'), std::string::npos) << "reaches the terminal";
  int summaries = 0;
  for (const auto& entry : fs::directory_iterator(folder_ / "runs")) {
    const auto json = nlohmann::json::parse(read_text(entry.path() / "summary.json"), nullptr,
                                            /*allow_exceptions=*/false);
    summaries += json.value("outcome", "") == "timed_out";
  }
  EXPECT_EQ(summaries, 1);
  EXPECT_EQ(hop({"--out", "run", "--name", "a/../b\n" + name}).exit_code, 1);
  EXPECT_EQ(summary()["outcome"], "timed_out");
}

TEST_F(RunOutputs, ClosedStreamsLeaveEveryFileAlone) {
  EXPECT_EQ(hop({"--out", "open"}).exit_code, 1);
  EXPECT_EQ(hop({"--out", "run"}, "exec \"$@\" <&- >&- 2>&-").exit_code, 1);
  ASSERT_EQ(summary()["outcome"], "timed_out");
  for (const char* file : {"events.csv", "truth.tum", "estimate.tum", "flight.csv"}) {
    EXPECT_EQ(read_text(folder_ / "run" / file), read_text(folder_ / "open" / file)) << file;
  }
}

TEST_F(RunOutputs, AReaderThatLeavesDoesNotEndTheRun) {
  const ProcessResult result = hop({"--out", "run", "--junit", "junit.xml"},
                                   "{ \"$@\"; echo $? > code; } 2>&1 | head -c 1 > /dev/null");
  EXPECT_EQ(result.exit_code, 0) << result.err;  // of head
  EXPECT_EQ(read_text(folder_ / "code"), "1\n");
  EXPECT_EQ(summary()["outcome"], "timed_out");
  EXPECT_TRUE(fs::exists(folder_ / "junit.xml"));
}

TEST_F(RunOutputs, TwoRunsDoNotMixInOneFolder) {
  const TemporaryFolder said;
  const Process first = fly_waypoints(said);
  wait_for("run/.lock", 1);
  const ProcessResult second = hop({"--out", "run"});
  EXPECT_EQ(second.exit_code, 2);
  EXPECT_NE(second.err.find("another run is at work here (process " + std::to_string(first.pid())),
            std::string::npos)
      << second.err;
  wait_for("run/truth.tum", 10'000);
  EXPECT_EQ(hop({"--out", "run"}).exit_code, 2);
  first.signal(SIGKILL);
  EXPECT_EQ(first.wait().exit_code, 128 + SIGKILL);
  write_text(folder_ / "run/cloud.pcd.4711.partial", "what the killed one left");
  // The dead hold no lock, and nothing of theirs remains.
  EXPECT_EQ(hop({"--quiet", "--out", "run"}).exit_code, 1);
  EXPECT_EQ(summary()["scenario"], "hop");
  EXPECT_FALSE(fs::exists(folder_ / "run/.lock"));
  EXPECT_FALSE(fs::exists(folder_ / "run/cloud.pcd.4711.partial"));
}

TEST_F(RunOutputs, TheDefaultFolderKeepsRunsOfOtherConfigurations) {
  EXPECT_EQ(hop({}).exit_code, 1);
  const std::string first = read_text(folder_ / "runs/hop-seed1/resolved.yaml");
  EXPECT_EQ(hop({"--set", "mission.max_time_s=0.1"}).exit_code, 1);
  EXPECT_EQ(hop({"--set", "mission.max_time_s=0.1"}).exit_code, 1);  // in the place of the same
  EXPECT_EQ(hop({}).exit_code, 1);
  EXPECT_EQ(read_text(folder_ / "runs/hop-seed1/resolved.yaml"), first);
  EXPECT_EQ(summary("runs/hop-seed1-2")["sim_time_s"], 0.1);
  EXPECT_FALSE(fs::exists(folder_ / "runs/hop-seed1-3"));
}

TEST_F(RunOutputs, EverySignalEndsTheFlightInGoodOrder) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    const TemporaryFolder said;
    const Process process = fly_waypoints(said);
    wait_for("run/truth.tum", 10'000);
    process.signal(signal);
    const ProcessResult result = process.wait();
    EXPECT_EQ(result.exit_code, 130) << signal;
    EXPECT_EQ(summary()["outcome"], "interrupted") << signal;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    fs::remove_all(folder_ / "run");
  }
}

TEST_F(RunOutputs, ASignalDuringSetUpIsHeededAndASecondOneKills) {
  const TemporaryFolder said;
  const Process process = fly_waypoints(said);
  wait_for("run/.lock");
  process.signal(SIGTERM);
  EXPECT_EQ(process.wait().exit_code, 130);
  EXPECT_EQ(summary()["outcome"], "interrupted");
  fs::remove_all(folder_ / "run");

  const Process impatient = fly_waypoints(said);
  wait_for("run/.lock");
  impatient.signal(SIGINT);
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  impatient.signal(SIGTERM);
  EXPECT_EQ(impatient.wait().exit_code, 128 + SIGTERM);
  EXPECT_FALSE(fs::exists(folder_ / "run/summary.json"));
}

TEST_F(RunOutputs, TheSummaryIsThereWhateverFailsBesideIt) {
  const TemporaryFolder said;
  const Process process = fly_waypoints(
      said, {"--set", "mission.max_time_s=3", "--set", "mapping.enabled=true", "--bag",
             (folder_ / "x.bag").string(), "--junit", (folder_ / "junit.xml").string()});
  wait_for("run/truth.tum", 1000);
  for (const char* name : {"run/report.html", "run/map.bt", "x.bag", "junit.xml"}) {
    fs::create_directory(folder_ / name);
  }
  const ProcessResult result = process.wait();
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  EXPECT_NE(result.err.find("is a folder, expected a file"), std::string::npos) << result.err;
  EXPECT_EQ(summary()["outcome"], "timed_out");
  EXPECT_EQ(summary()["unwritten"].size(), 2u) << summary()["unwritten"];  // bag and map
  EXPECT_TRUE(fs::exists(folder_ / "run/map2d.pgm") || fs::exists(folder_ / "run/timing.csv"));
}

TEST_F(RunOutputs, AFullDiskEndsTheFlightAndIsNamed) {
  // 40 kB a file: less than truth.tum after six seconds, more than the summary.
  const ProcessResult result = hop({"--quiet", "--out", "run", "--set", "mission.max_time_s=8"},
                                   "ulimit -f 80; exec \"$@\"");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.err.find(".tum: cannot be written: File too large"), std::string::npos)
      << result.err;
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  EXPECT_EQ(summary()["outcome"], "interrupted");
  EXPECT_GE(summary()["unwritten"].size(), 1u);
}

TEST_F(RunOutputs, StandardOutputThatTakesNothingIsAnError) {
  const std::string full = "exec \"$@\" > /dev/full";
  for (const std::vector<std::string>& arguments :
       std::vector<std::vector<std::string>>{{"params"},
                                             {"validate", "hop.yaml"},
                                             {"pattern", "--shots", "100"},
                                             {"--help"},
                                             {"--version"}}) {
    const ProcessResult result = arex(arguments, full);
    EXPECT_EQ(result.exit_code, 2) << arguments[0];
    EXPECT_TRUE(result.err.starts_with("standard output: cannot be written: ")) << result.err;
  }
  EXPECT_EQ(hop({"--out", "run", "--set", "mission.max_time_s=0.1"}, full).exit_code, 1);
  EXPECT_EQ(summary()["outcome"], "timed_out");
}

TEST_F(RunOutputs, TheOtherCommandsRefuseWhatTheyCannotWrite) {
  ASSERT_EQ(hop({"--quiet", "--out", "run"}).exit_code, 1);
  const auto expect = [&](const std::vector<std::string>& arguments, const std::string& said) {
    const auto before = names();
    const ProcessResult result = arex(arguments);
    EXPECT_EQ(result.exit_code, 2) << said;
    EXPECT_NE(result.err.find(said), std::string::npos) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_EQ(names(), before) << said;
  };
  expect({"world", "hop.yaml", "--out", "hop.yaml"}, "hop.yaml: cannot be a folder to write");
  expect({"world", "hop.yaml", "--out", "run"}, "run: holds resolved.yaml");
  expect({"render", "run", "--out", "missing/x.png"}, "missing/x.png: cannot be written");
  fs::create_symlink("/dev/null", folder_ / "device.png");
  expect({"render", "run", "--out", "device.png"}, "device.png: is a device");
  fs::create_directory(folder_ / "run/report.html");
  expect({"report", "run"}, "report.html: is a folder");
  write_text(folder_ / "sweep.yaml", "base: hop.yaml\nseeds: 1..2\n");
  expect({"sweep", "sweep.yaml", "--out", "hop.yaml"}, "hop.yaml: cannot be a folder to write");
  expect({"sweep", "sweep.yaml", "--out", "run"}, "run: holds a run");
}

TEST_F(RunOutputs, WithoutOpenGlAPictureIsRefusedInOneLine) {
  ASSERT_EQ(hop({"--quiet", "--out", "run"}).exit_code, 1);
  for (const char* file : {"x.png", "x.mp4"}) {
    const auto before = names();
    const ProcessResult result =
        arex({"render", "run", "--out", file}, "__EGL_VENDOR_LIBRARY_DIRS=/nowhere exec \"$@\"");
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_EQ(result.err.find("no EGL platform offers a headless OpenGL"), 0u) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_EQ(names(), before);
  }
}

}  // namespace
}  // namespace arex
