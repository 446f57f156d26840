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

}  // namespace
}  // namespace arex
