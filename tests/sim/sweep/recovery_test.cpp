#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/stat.h>

#include <thread>

#include "sim/sweep/sweep_files.h"
#include "support/process.h"
#include "support/sanitized.h"

// A sweep loses nothing and flies nothing twice, whatever dies.
namespace arex {
namespace {

namespace fs = std::filesystem;
using test::arex;
using test::events_by_run;
using test::expect_complete;
using test::expect_untouched;
using test::finished_runs;
using test::invalid_runs;
using test::kShortRuns;
using test::lines_of;
using test::marks_of;
using test::Process;
using test::ProcessResult;
using test::read_text;
using test::sweep_arguments;
using test::TemporaryFolder;
using test::wait_until;
using test::write_text;

std::vector<pid_t> children_of(pid_t pid) {
  const std::string id = std::to_string(pid);
  std::istringstream text(read_text("/proc/" + id + "/task/" + id + "/children"));
  std::vector<pid_t> children;
  for (pid_t child = 0; text >> child;) children.push_back(child);
  return children;
}

// Gone, or a zombie that its new parent has not buried.
bool dead(pid_t pid) {
  const std::string stat = read_text("/proc/" + std::to_string(pid) + "/stat");
  const auto name_end = stat.rfind(')');
  return name_end == std::string::npos || stat.substr(name_end + 2, 1) == "Z";
}

std::size_t count_lines_with(const fs::path& file, const std::string& text) {
  const auto lines = lines_of(file);
  return static_cast<std::size_t>(std::count_if(lines.begin(), lines.end(), [&](const auto& line) {
    return line.find(text) != std::string::npos;
  }));
}

/// The undisturbed sweep, flown once for all tests.
class SweepRecovery : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    shared_ = new TemporaryFolder;
    write_text(file(), test::short_sweep());
    const ProcessResult result = arex(sweep_arguments(file(), undisturbed()));
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_NE(result.err.find(" in flight: "), std::string::npos) << result.err;
    ASSERT_EQ(lines_of(undisturbed() / "sweep.csv").size(), std::size_t{kShortRuns + 1});
  }
  static void TearDownTestSuite() { delete shared_; }
  static fs::path file() { return *shared_ / "sweep.yaml"; }
  static fs::path undisturbed() { return *shared_ / "undisturbed"; }

  static TemporaryFolder* shared_;
};
TemporaryFolder* SweepRecovery::shared_ = nullptr;

TEST_F(SweepRecovery, SurvivesTheDeathOfTwoRunsAndOfTheDriver) {
  const TemporaryFolder folder;
  const fs::path out = folder / "out";
  const Process driver(AREX_BINARY, sweep_arguments(file(), out), folder.path());
  ASSERT_TRUE(wait_until([&] { return finished_runs(out).size() >= 6; }));
  ASSERT_TRUE(wait_until([&] {
    for (const pid_t child : children_of(driver.pid())) kill(child, SIGKILL);
    return count_lines_with(out / "log.csv", "signal 9") >= 2;
  }));
  ASSERT_TRUE(wait_until([&] { return finished_runs(out).size() >= 20; }));
  std::vector<pid_t> children;
  ASSERT_TRUE(wait_until([&] { return !(children = children_of(driver.pid())).empty(); }));
  driver.signal(SIGKILL);
  EXPECT_EQ(driver.wait().exit_code, 128 + SIGKILL);
  for (const pid_t child : children) EXPECT_TRUE(wait_until([&] { return dead(child); }));
  EXPECT_LT(finished_runs(out).size(), std::size_t{kShortRuns});
  EXPECT_EQ(invalid_runs(out), 0);
  const auto before = marks_of(out);
  auto status = sweep_arguments(file(), out);
  status.push_back("--status");
  const std::string said = arex(status).out;
  EXPECT_NE(said.find(std::to_string(before.size()) + " of 48 finished"), std::string::npos)
      << said;
  EXPECT_EQ(said.find("in flight"), std::string::npos) << said;  // no longer
  const ProcessResult resumed = arex(sweep_arguments(file(), out));
  EXPECT_EQ(resumed.exit_code, 0) << resumed.err;
  expect_untouched(before, out);
  expect_complete(out, undisturbed());
  // Done is done.
  const auto log = lines_of(out / "log.csv");
  EXPECT_EQ(arex(sweep_arguments(file(), out)).exit_code, 0);
  EXPECT_EQ(lines_of(out / "log.csv"), log);
}

/// A small file system: one of the test's own, which root or an unprivileged user namespace allows,
/// or a container's small /dev/shm, filled up.
class SmallDisk {
 public:
  SmallDisk() {
    if (mount_own()) {
      root_ = mount_point_.path();
    } else if (fill_shared_memory()) {
      root_ = shared_ = "/dev/shm/arex-test-" + std::to_string(getpid());
      fs::create_directories(root_);
    }
  }
  ~SmallDisk() {
    if (!shared_.empty()) fs::remove_all(shared_), fs::remove(filler_);
    if (mounted_) umount2(mount_point_.path().c_str(), MNT_DETACH);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;

  /// Empty if there is none to be had.
  [[nodiscard]] const fs::path& root() const { return root_; }
  void grow() const {
    if (mounted_) {
      EXPECT_EQ(mount("none", root_.c_str(), "tmpfs", MS_REMOUNT, "size=200m"), 0);
    } else {
      fs::remove(filler_);
    }
  }

 private:
  static constexpr std::uintmax_t kRoom = 9 << 20;  // of 48 runs of a third of a megabyte

  static bool own_namespace() {
    const std::string user = std::to_string(getuid());
    const std::string group = std::to_string(getgid());
    if (unshare(CLONE_NEWNS) == 0) return true;
    if (unshare(CLONE_NEWUSER | CLONE_NEWNS) != 0) return false;
    write_text("/proc/self/setgroups", "deny");
    write_text("/proc/self/uid_map", "0 " + user + " 1");
    write_text("/proc/self/gid_map", "0 " + group + " 1");
    return true;
  }
  bool mount_own() {
    const std::string size = "size=" + std::to_string(kRoom);
    mounted_ = own_namespace() && mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
               mount("none", mount_point_.path().c_str(), "tmpfs", 0, size.c_str()) == 0;
    return mounted_;
  }
  bool fill_shared_memory() {
    std::error_code none;
    const fs::space_info space = fs::space("/dev/shm", none);
    if (none || space.capacity > (1 << 30) || space.available < 3 * kRoom) return false;
    filler_ = "/dev/shm/arex-filler-" + std::to_string(getpid());
    write_text(filler_, std::string(space.available - kRoom, 'x'));
    return true;
  }

  TemporaryFolder mount_point_;
  fs::path root_, shared_, filler_;
  bool mounted_ = false;
};

TEST_F(SweepRecovery, SurvivesAFullDisk) {
  const SmallDisk disk;
  ASSERT_FALSE(disk.root().empty()) << "needs root, user namespaces or a /dev/shm below 1 GB";
  const fs::path out = disk.root() / "out";
  const ProcessResult full = arex(sweep_arguments(file(), out));
  EXPECT_EQ(full.exit_code, 1);
  EXPECT_NE(full.err.find("the disk is full"), std::string::npos) << full.err;
  EXPECT_NE(full.err.find("No space left on device"), std::string::npos) << full.err;
  const std::size_t fitted = finished_runs(out).size();
  EXPECT_GT(fitted, 5u);
  EXPECT_LT(fitted, std::size_t{kShortRuns});
  EXPECT_EQ(invalid_runs(out), 0);
  EXPECT_FALSE(fs::exists(out / "sweep.csv"));
  // Still full: nothing changes but the attempt.
  const auto before = marks_of(out);
  EXPECT_EQ(arex(sweep_arguments(file(), out)).exit_code, 1);
  expect_untouched(before, out);
  disk.grow();
  const ProcessResult resumed = arex(sweep_arguments(file(), out));
  EXPECT_EQ(resumed.exit_code, 0) << resumed.err;
  expect_untouched(before, out);
  expect_complete(out, undisturbed());
}

TEST_F(SweepRecovery, AFileThatMayNotGrowIsNoCrashToBeTriedAgain) {
  const TemporaryFolder folder;
  const fs::path out = folder / "out";
  std::vector<std::string> words{"-c", "ulimit -f 60; exec \"$@\"", "sh", AREX_BINARY};
  for (const std::string& word : sweep_arguments(file(), out)) words.push_back(word);
  // 30 kB a file: a plan's configuration fits, a flight of some seconds does not.
  write_text(folder / "sweep.yaml", "base: " AREX_SOURCE_DIR
                                    "/scenarios/inflation.yaml\nset: {mission.max_time_s: 5, "
                                    "lidar.enabled: false, odometry.source: mocap, "
                                    "mapping.use_depth: false}\nretries: 3\n");
  words[5] = (folder / "sweep.yaml").string();
  const ProcessResult result = test::run_process("/bin/sh", words);
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.err.find("File too large"), std::string::npos) << result.err;
  EXPECT_EQ(count_lines_with(out / "log.csv", ",start,"), 1u);
}

TEST_F(SweepRecovery, AnInterruptStopsItAndTheSameCommandGoesOn) {
  const TemporaryFolder folder;
  const fs::path out = folder / "out";
  const Process driver(AREX_BINARY, sweep_arguments(file(), out), folder.path());
  ASSERT_TRUE(wait_until([&] { return finished_runs(out).size() >= 4; }));
  driver.signal(SIGSTOP);  // it holds its lock, and nothing ends meanwhile
  const ProcessResult second = arex(sweep_arguments(file(), out));
  EXPECT_EQ(second.exit_code, 2);
  EXPECT_NE(second.err.find("another sweep is at work here"), std::string::npos) << second.err;
  driver.signal(SIGINT);
  driver.signal(SIGCONT);
  EXPECT_EQ(driver.wait().exit_code, 128 + SIGINT);
  const std::size_t done = finished_runs(out).size();
  EXPECT_LT(done, std::size_t{kShortRuns});
  EXPECT_EQ(count_lines_with(out / "sweep.csv", ",missing,"), kShortRuns - done);
  std::vector<std::string> arguments = sweep_arguments(file(), out);
  arguments.push_back("--status");
  const ProcessResult status = arex(arguments);
  EXPECT_EQ(status.exit_code, 1);
  EXPECT_NE(status.out.find(std::to_string(done) + " of 48 finished"), std::string::npos)
      << status.out;
  EXPECT_EQ(arex(sweep_arguments(file(), out)).exit_code, 0);
  EXPECT_EQ(read_text(out / "sweep.csv"), read_text(undisturbed() / "sweep.csv"));
}

TEST(SweepFailures, AreRecordedWithTheirCauseAndTriedAsOftenAsAsked) {
  const TemporaryFolder folder;
  // A world that nobody can start from is refused; the whole mission takes longer than 8 s.
  const std::string limit_s = std::to_string(8 * test::kSlowdown);
  write_text(folder / "sweep.yaml",
             "list:\n"
             "  - {name: walled in, base: " AREX_SOURCE_DIR
             "/scenarios/inflation.yaml, "
             "world.kind: forest, world.forest.size_m: [30, 30], "
             "world.forest.start_radius_m: 0.8, world.forest.tree_density_per_m2: 2, "
             "world.forest.min_spacing_m: 0.5, world.forest.tree.leaves: 0, "
             "world.forest.clearings: [{centre_m: [8, 8], radius_m: 4}]}\n"
             "  - {name: endless, base: " AREX_SOURCE_DIR
             "/scenarios/waypoints.yaml}\n"
             "timeout_s: " +
                 limit_s + "\nretries: 1\n");
  const fs::path out = folder / "out";
  const ProcessResult result = arex(sweep_arguments(folder / "sweep.yaml", out));
  EXPECT_EQ(result.exit_code, 1);
  const auto rows = lines_of(out / "sweep.csv");
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_NE(rows[1].find("walled in"), std::string::npos);
  EXPECT_NE(rows[1].find(",refused,"), std::string::npos) << rows[1];
  EXPECT_NE(rows[1].find("leaves no free start"), std::string::npos) << rows[1];
  EXPECT_NE(rows[2].find(",overran,killed after " + limit_s + " s"), std::string::npos) << rows[2];
  std::multiset<std::size_t> starts;
  for (const auto& [id, events] : events_by_run(out)) {
    starts.insert(static_cast<std::size_t>(std::count(events.begin(), events.end(), "start")));
  }
  EXPECT_EQ(starts, (std::multiset<std::size_t>{1, 2}));
  EXPECT_TRUE(finished_runs(out).empty());
}

TEST(SweepFailures, BadInputIsOneLineAndWritesNothing) {
  const TemporaryFolder folder;
  write_text(folder / "sweep.yaml", test::short_sweep("grid: 3\n"));
  const fs::path out = folder / "out";
  const ProcessResult result = arex(sweep_arguments(folder / "sweep.yaml", out));
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  EXPECT_FALSE(fs::exists(out));
  write_text(folder / "sweep.yaml", test::short_sweep());
  auto arguments = sweep_arguments(folder / "sweep.yaml", out);
  arguments.push_back("--dry-run");
  const ProcessResult dry = arex(arguments);
  EXPECT_EQ(dry.exit_code, 0);
  EXPECT_NE(dry.out.find("48 runs, 48 to fly"), std::string::npos) << dry.out;
  EXPECT_FALSE(fs::exists(out));
}

}  // namespace
}  // namespace arex
