#include <gtest/gtest.h>

#include "sim/sweep/slurm_cluster.h"
#include "sim/sweep/sweep_files.h"

// The same sweep through a real Slurm.
namespace arex {
namespace {

namespace fs = std::filesystem;
using test::arex;
using test::finished_runs;
using test::kShortRuns;
using test::ProcessResult;
using test::read_text;
using test::run_process;
using test::SlurmCluster;
using test::TemporaryFolder;
using test::wait_until;
using test::write_text;

constexpr int kMaxArraySize = 21;  // 48 runs are 21 + 21 + 6

ProcessResult submit(const fs::path& file, const fs::path& out) {
  return arex({"sweep", file.string(), "--out", out.string(), "--slurm", "--partition=test"});
}

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

// Runs that a submission says it has submitted.
std::size_t submitted(const std::string& text) {
  std::istringstream words(text);
  std::size_t sum = 0;
  for (std::string word; words >> word;) {
    std::size_t runs = 0;
    if (word == "submitted" && words >> runs) sum += runs;
  }
  return sum;
}

// The process of a task of this folder, with a run in flight; 0 if there is none.
pid_t task_at_work(const fs::path& out) {
  for (const auto& entry : fs::directory_iterator(out / "runs")) {
    const std::string name = entry.path().filename().string();
    if (name.find(".partial-") == std::string::npos) continue;
    return static_cast<pid_t>(std::stol(name.substr(name.rfind('-') + 1)));
  }
  return 0;
}

bool queue_is_empty() {
  const ProcessResult queue = run_process("squeue", {"--noheader"});
  return queue.exit_code == 0 && queue.out.empty();
}

TEST(SlurmSweep, FliesWhatIsMissingAndSurvivesKilledJobs) {
  const TemporaryFolder folder;
  write_text(folder / "sweep.yaml", test::short_sweep("timeout_s: 60\n"));
  const fs::path file = folder / "sweep.yaml";
  const fs::path out = folder / "out";
  ASSERT_EQ(arex(test::sweep_arguments(file, folder / "undisturbed")).exit_code, 0);

  const SlurmCluster cluster(kMaxArraySize);
  const ProcessResult first = submit(file, out);
  ASSERT_EQ(first.exit_code, 0) << first.err << cluster.logs();
  EXPECT_EQ(count_of(first.out, "submitted 21 runs"), 2u) << first.out;
  EXPECT_EQ(count_of(first.out, "submitted 6 runs"), 1u) << first.out;
  const ProcessResult again = submit(file, out);
  EXPECT_EQ(submitted(again.out), 0u) << again.out;
  EXPECT_NE(again.out.find("in Slurm's queue already"), std::string::npos) << again.out;

  // A task is killed where it stands, then the second array is cancelled while it flies.
  ASSERT_TRUE(wait_until([&] {
    const pid_t victim = task_at_work(out);
    return victim != 0 && kill(victim, SIGKILL) == 0;
  })) << cluster.logs();
  ASSERT_TRUE(wait_until([] {
    return run_process("squeue", {"--noheader", "--states=R", "--format=%F"}).out.find("2") !=
           std::string::npos;
  })) << cluster.logs();
  EXPECT_EQ(run_process("scancel", {"2"}).exit_code, 0);
  ASSERT_TRUE(wait_until(queue_is_empty)) << cluster.logs();
  const std::size_t done = finished_runs(out).size();
  EXPECT_LT(done, std::size_t{kShortRuns});
  EXPECT_GT(done, 0u);
  EXPECT_EQ(test::invalid_runs(out), 0);
  const auto before = test::marks_of(out);

  const ProcessResult resumed = submit(file, out);
  EXPECT_EQ(submitted(resumed.out), kShortRuns - done) << resumed.out << resumed.err;
  ASSERT_TRUE(wait_until(queue_is_empty)) << cluster.logs();
  const ProcessResult status = arex({"sweep", file.string(), "--out", out.string(), "--status"});
  EXPECT_EQ(status.exit_code, 0) << status.out;
  EXPECT_NE(status.out.find("48 of 48 finished"), std::string::npos) << status.out;
  const ProcessResult last = submit(file, out);
  EXPECT_EQ(submitted(last.out), 0u) << last.out;
  test::expect_untouched(before, out);
  test::expect_complete(out, folder / "undisturbed");
}

TEST(SlurmSweep, SaysWhatSlurmSays) {
  const TemporaryFolder folder;
  write_text(folder / "sweep.yaml", test::short_sweep());
  const SlurmCluster cluster(kMaxArraySize);
  const ProcessResult refused = arex({"sweep", (folder / "sweep.yaml").string(), "--out",
                                      (folder / "out").string(), "--slurm", "--partition=none"});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_NE(refused.err.find("invalid partition specified: none"), std::string::npos)
      << refused.err;
  EXPECT_EQ(std::count(refused.err.begin(), refused.err.end(), '\n'), 1) << refused.err;
}

TEST(SlurmSweep, JobsBoundAllArraysTogether) {
  const TemporaryFolder folder;
  write_text(folder / "sweep.yaml", test::short_sweep());
  const SlurmCluster cluster(kMaxArraySize);  // of two cores
  const ProcessResult submitted =
      arex({"sweep", (folder / "sweep.yaml").string(), "--out", (folder / "out").string(), "--jobs",
            "1", "--slurm", "--partition=test", "--time=5"});
  ASSERT_EQ(submitted.exit_code, 0) << submitted.err << cluster.logs();
  ASSERT_EQ(count_of(submitted.out, "submitted "), 3u) << submitted.out;
  std::size_t most = 0;
  ASSERT_TRUE(wait_until([&] {
    const ProcessResult running =
        run_process("squeue", {"--noheader", "--array", "--states=R", "--format=%K"});
    most = std::max(most, count_of(running.out, "\n"));
    return queue_is_empty();
  })) << cluster.logs();
  EXPECT_EQ(most, 1u);
  EXPECT_EQ(finished_runs(folder / "out").size(), std::size_t{kShortRuns});
}

/// Commands of a cluster that are scripts of the test's own, first in PATH.
class FakeCluster {
 public:
  explicit FakeCluster(const std::map<std::string, std::string>& scripts) {
    for (const auto& [name, text] : scripts) {
      write_text(folder_ / name, "#!/bin/sh\n" + text);
      fs::permissions(folder_ / name, fs::perms(0755));
    }
    setenv("PATH", (folder_.path().string() + ":/bin").c_str(), 1);
  }
  ~FakeCluster() { setenv("PATH", path_.c_str(), 1); }
  FakeCluster(const FakeCluster&) = delete;
  FakeCluster& operator=(const FakeCluster&) = delete;

 private:
  TemporaryFolder folder_;
  std::string path_ = getenv("PATH");
};

TEST(SlurmSweep, WithoutAClusterIsOneLineAndLeavesNothing) {
  const TemporaryFolder folder;
  write_text(folder / "sweep.yaml", test::short_sweep());
  const auto expect = [&](const std::map<std::string, std::string>& scripts,
                          const std::string& said) {
    const FakeCluster cluster(scripts);
    const ProcessResult result = submit(folder / "sweep.yaml", folder / "out");
    EXPECT_EQ(result.exit_code, 2) << said;
    EXPECT_EQ(result.err.find("--slurm: " + said), 0u) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_FALSE(fs::exists(folder / "out"));
  };
  const std::string fails = "echo 'first line' >&2; printf 'second\\033[31m' >&2; exit 1\n";
  expect({{"sbatch", fails}, {"scontrol", fails}}, "sbatch: first line; second\\x1b");
  expect({{"sbatch", "exit 0\n"}, {"scontrol", fails}}, "scontrol: first line; second");
  expect({{"sbatch", "exit 0\n"}, {"scontrol", "exit 3\n"}}, "scontrol: failed without a word");
}

TEST(SlurmSweep, ARefusedArrayKeepsTheAcceptedOnesAndSaysHowToGoOn) {
  const TemporaryFolder folder;
  write_text(folder / "sweep.yaml", test::short_sweep());
  const std::string count = (folder / "count").string();
  const FakeCluster cluster(
      {{"scontrol", "echo 'MaxArraySize = 21'\n"},
       {"squeue", "exit 0\n"},
       {"sbatch", "[ \"$1\" = --version ] && exit 0\necho x >> " + count + "\nif [ $(wc -l < " +
                      count +
                      ") -gt 2 ]; then echo 'sbatch: error: QOSMaxSubmitJobPerUserLimit' >&2; "
                      "exit 1; fi\nwc -l < " +
                      count + "\n"}});
  const ProcessResult result = submit(folder / "sweep.yaml", folder / "out");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(count_of(result.out, "submitted 21 runs as job "), 2u) << result.out;
  EXPECT_NE(result.err.find("QOSMaxSubmitJobPerUserLimit (42 of 48 runs are submitted"),
            std::string::npos)
      << result.err;
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  std::size_t batches = 0;
  for (const auto& entry : fs::directory_iterator(folder / "out/slurm")) {
    batches += entry.path().extension() == ".json";
  }
  EXPECT_EQ(batches, 2u);
}

}  // namespace
}  // namespace arex
