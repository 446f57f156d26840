#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "app/commands.h"
#include "app/host.h"
#include "app/interrupts.h"
#include "run/file_io.h"
#include "run/foreign_json.h"
#include "sweep/slurm.h"
#include "sweep/supervisor.h"
#include "sweep/sweep_file.h"
#include "sweep/sweep_folder.h"
#include "sweep/sweep_plan.h"
#include "sweep/sweep_table.h"

namespace arex::app {
namespace {

constexpr double kTablePeriod_s = 60;             // a long sweep can be looked at while it flies
constexpr const char* kDriverLock = ".lock";      // of the local sweep or the submission
constexpr const char* kWorkersLock = ".workers";  // shared by Slurm's tasks
// A look whether someone is at work holds a lock for a moment.
constexpr double kPatience_s = 2;
constexpr double kTaskPatience_s = 60;

std::string clock_text(double seconds) {
  const long whole = std::lround(seconds);
  return fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
}

// How long a run in flight has flown: its newest whole row of flight.csv, which begins with the
// time. Negative before the first.
double flown_s(const std::filesystem::path& run) {
  constexpr std::streamoff kTail = 1024;  // bytes that hold a row for certain
  std::ifstream file(run / "flight.csv", std::ios::binary | std::ios::ate);
  const std::streamoff size = file ? std::streamoff(file.tellg()) : 0;
  file.seekg(std::max<std::streamoff>(0, size - kTail));
  const std::string tail{std::istreambuf_iterator<char>(file), {}};
  const std::size_t end = tail.rfind('\n');
  const std::size_t begin = end > 0 && end < tail.npos ? tail.rfind('\n', end - 1) : tail.npos;
  double time_s = -1;
  if (begin < tail.npos) std::from_chars(&tail[begin + 1], tail.data() + end, time_s);
  return time_s;
}

// What tells a run from the others of its sweep.
std::string title_of(const sim::PlannedRun& run, const sim::SweepPlan& plan) {
  std::string title = run.scenario;
  if (!run.variant.empty()) title += " " + run.variant;
  for (std::size_t i = 0; run.variant.empty() && i < plan.keys.size(); ++i) {
    title += " " + plan.keys[i].substr(plan.keys[i].rfind('.') + 1) + "=" + run.values[i];
  }
  title += fmt::format(" seed {}", run.seed);
  return plan.repeats > 1 ? title + fmt::format(" repeat {}", run.repeat) : title;
}

// "forest seed 3 at 84 s, forest seed 4 starting"; a run that has no folder yet is not among them.
std::string in_flight(const sim::SweepPlan& plan, const sim::SweepFolder& folder) {
  std::string text;
  for (const std::string& id : folder.partials()) {
    const auto run = std::find_if(plan.runs.begin(), plan.runs.end(),
                                  [&](const sim::PlannedRun& planned) { return planned.id == id; });
    if (run == plan.runs.end()) continue;
    const double time_s = flown_s(folder.root() / sim::SweepFolder::partial(id));
    text += (text.empty() ? "" : ", ") + title_of(*run, plan);
    text += time_s < 0 ? " starting" : fmt::format(" at {:.0f} s", time_s);
  }
  return text;
}

/// The line that a person watches, and a line of its own for every run that breaks.
class SweepLine {
 public:
  /// @param done runs that were finished before, @param total of the sweep
  SweepLine(std::size_t done, std::size_t total)
      : done_(done), total_(total), on_terminal_(isatty(STDERR_FILENO) != 0) {}
  ~SweepLine() {
    if (open_) std::fputc('\n', stderr);
  }
  SweepLine(const SweepLine&) = delete;
  SweepLine& operator=(const SweepLine&) = delete;

  void broken(const sim::RunOrder& order, const sim::RunState& state) {
    const auto name = sim::kFailureNames[static_cast<std::size_t>(state.failure)];
    if (open_) std::fputs("\r\033[K", stderr);
    open_ = false;
    std::fprintf(stderr, "%s: %.*s: %s\n", sim::SweepFolder::failed(order.id).c_str(),
                 static_cast<int>(name.size()), name.data(), state.detail.c_str());
  }

  /// @param in_flight asked for only when the line is written
  void update(const sim::SweepProgress& p, const std::function<std::string()>& in_flight) {
    const bool last = p.finished + p.broken == p.total;
    if (!on_terminal_ && !last && p.elapsed_s < next_s_) return;
    next_s_ = p.elapsed_s + 30;  // a log wants a line now and then
    std::string line =
        fmt::format("{}/{} done, {} missions failed, {} broken, {}, ETA {}", done_ + p.finished,
                    total_, p.missions_failed, p.broken, clock_text(p.elapsed_s),
                    p.left_s < 0 ? "?" : clock_text(p.left_s));
    if (p.running > 0) line += fmt::format(", {} in flight: {}", p.running, in_flight());
    if (on_terminal_) line = "\r\033[K" + cut(line);
    std::fputs(line.c_str(), stderr);
    if (!on_terminal_) std::fputc('\n', stderr);
    open_ = on_terminal_;
  }

 private:
  // A line that wraps could not be written over.
  static std::string cut(const std::string& line) {
    winsize size{};
    if (ioctl(STDERR_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col < 2) return line;
    return line.size() < size.ws_col ? line : line.substr(0, size.ws_col - 2U) + "…";
  }

  std::size_t done_;
  std::size_t total_;
  bool on_terminal_;
  bool open_ = false;
  double next_s_ = 0;
};

int dry_run(const sim::SweepPlan& plan, const sim::SweepFolder& folder) {
  std::size_t missing = 0;
  for (const sim::PlannedRun& run : plan.runs) {
    const bool finished = folder.summary(run.id).has_value();
    missing += finished ? 0 : 1;
    std::string text = run.id + (finished ? "  finished  " : "  to fly    ") + run.scenario;
    if (!run.variant.empty()) text += " " + run.variant;
    for (std::size_t i = 0; i < plan.keys.size(); ++i) {
      text += " " + plan.keys[i] + "=" + run.values[i];
    }
    text += " seed=" + std::to_string(run.seed);
    if (plan.repeats > 1) text += " repeat=" + std::to_string(run.repeat);
    std::printf("%s\n", text.c_str());
  }
  std::printf("%zu runs, %zu to fly\n", plan.runs.size(), missing);
  return 0;
}

// Empty also where there is no Slurm to ask.
std::set<std::string> queued_or_none(const sim::SweepFolder& folder) {
  try {
    return sim::queue_of(folder).runs;
  } catch (const sim::SlurmError&) {
    return {};
  }
}

// Whether what looks as if it were in flight is: what a killed sweep has left does not count.
bool at_work(const sim::SweepFolder& folder) {
  if (!std::filesystem::exists(folder.root() / kDriverLock)) return false;
  try {
    for (const char* name : {kDriverLock, kWorkersLock}) {
      if (!sim::FileLock(folder.root() / name, sim::FileLock::Mode::kExclusive).take()) return true;
    }
    return false;
  } catch (const DiskError&) {
    return true;  // somebody else's folder: one can only look
  }
}

int status(const sim::SweepPlan& plan, const sim::SweepFolder& folder) {
  std::map<std::string, std::size_t> counts;
  std::size_t finished = 0;
  const std::vector<std::string> partials =
      at_work(folder) ? folder.partials() : std::vector<std::string>{};
  const std::set<std::string> queued = queued_or_none(folder);
  const auto order = plan.flying_order();
  for (const sim::PlannedRun* run : order) {
    if (const auto summary = folder.summary(run->id)) {
      ++finished;
      ++counts[(*summary)["outcome"].get<std::string>()];
    } else if (std::binary_search(partials.begin(), partials.end(), run->id)) {
      ++counts["in flight"];
    } else if (queued.count(run->id) > 0) {
      ++counts["in Slurm's queue"];
    } else {
      const auto failure = folder.state(run->id).failure;
      ++counts[std::string(sim::kFailureNames[static_cast<std::size_t>(failure)])];
    }
  }
  std::printf("%s: %zu of %zu finished", plan.name.c_str(), finished, order.size());
  for (const auto& [what, count] : counts) std::printf(", %zu %s", count, what.c_str());
  std::printf("\n");
  return finished == order.size() ? 0 : 1;
}

void write_tables(const sim::SweepPlan& plan, const sim::SweepFolder& folder) {
  const sim::SweepTables tables = sim::sweep_tables(plan, folder);
  write_atomically(folder.root() / "sweep_host.csv", tables.host);
  write_atomically(folder.root() / "sweep.csv", tables.results);
}

void warn_of_another_build(const sim::SweepPlan& plan, const sim::SweepFolder& folder) {
  const auto before = sim::parse_object(sim::read_file(folder.root() / "sweep.json"));
  if (!before.is_object() || sim::text_field(before, "build", plan.build) == plan.build) return;
  std::fprintf(stderr, "%s: holds runs of another build, which do not count for this one\n",
               folder.root().c_str());
}

// What is swept must not stand in the middle of something else.
void expect_sweep_folder(const std::filesystem::path& folder) {
  if (!std::filesystem::exists(folder / "resolved.yaml")) return;
  throw ConfigError(folder.string() + ": holds a run, expected a folder for the sweep");
}

std::vector<sim::RunOrder> missing_runs(const sim::SweepPlan& plan,
                                        const sim::SweepFolder& folder) {
  std::vector<sim::RunOrder> orders;
  for (const sim::PlannedRun* run : plan.flying_order()) {
    if (!folder.summary(run->id)) orders.push_back({run->id, run->scenario});
  }
  return orders;
}

[[noreturn]] void fail_on_full_disk(const sim::SweepFolder& folder, const std::string& said) {
  throw std::runtime_error(folder.root().string() + ": the disk is full (" + said +
                           "); make room and give the same command again");
}

void prepare(const sim::SweepFolder& folder, const sim::SweepPlan& plan) {
  try {
    folder.prepare(plan);
  } catch (const DiskError& error) {
    if (error.disk_full()) fail_on_full_disk(folder, error.what());
    throw;
  }
}

int fly(const sim::SweepPlan& plan, const sim::SweepFolder& folder, int jobs) {
  sim::FileLock workers(folder.root() / kWorkersLock, sim::FileLock::Mode::kExclusive);
  if (!workers.take(kPatience_s)) {
    throw ConfigError(folder.root().string() + ": Slurm's tasks are at work here, expected them " +
                      "to be over; --status says how far they are");
  }
  folder.remove_all_partials();
  const std::vector<sim::RunOrder> orders = missing_runs(plan, folder);
  const std::size_t total = plan.flying_order().size();
  SweepLine line(total - orders.size(), total);
  double next_table_s = kTablePeriod_s;
  sim::Supervisor supervisor(
      folder, sim::kThisProgram, {jobs, plan.timeout_s, plan.retries},
      {[&](const auto& order, const auto& state) { line.broken(order, state); },
       [&](const auto& progress) {
         line.update(progress, [&] { return in_flight(plan, folder); });
         if (progress.elapsed_s < next_table_s) return;
         next_table_s = progress.elapsed_s + kTablePeriod_s;
         try {
           write_tables(plan, folder);
         } catch (const DiskError&) {
           // The next run finds out what is wrong with the disk.
         }
       }});
  const sim::SweepEnd end = supervisor.fly(orders);
  if (end == sim::SweepEnd::kDiskFull) fail_on_full_disk(folder, supervisor.disk_full());
  write_tables(plan, folder);
  if (end == sim::SweepEnd::kInterrupted) return 128 + SIGINT;
  return supervisor.progress().broken == 0 ? 0 : 1;
}

int submit(const sim::SweepPlan& plan, const sim::SweepFolder& folder,
           const sim::SlurmOptions& options) {
  {
    // What killed jobs have left can go when no task is at work.
    sim::FileLock workers(folder.root() / kWorkersLock, sim::FileLock::Mode::kExclusive);
    if (workers.take()) folder.remove_all_partials();
  }
  // The queue first: what leaves it after this look is finished at the next, or really missing.
  const sim::SlurmQueue queue = sim::queue_of(folder);
  std::vector<sim::RunOrder> orders = missing_runs(plan, folder);
  const std::size_t missing = orders.size();
  std::erase_if(orders, [&](const auto& order) { return queue.runs.count(order.id) > 0; });
  const sim::SlurmSubmission submission =
      sim::submit(folder, plan, orders, sim::kThisProgram, queue, options);
  std::size_t submitted = 0;
  for (const sim::SlurmBatch& batch : submission.batches) {
    submitted += batch.runs;
    std::printf("submitted %zu runs as job %s (%s)\n", batch.runs, batch.job_id.c_str(),
                batch.name.c_str());
  }
  if (missing > orders.size()) {
    std::printf("%zu runs are in Slurm's queue already\n", missing - orders.size());
  }
  write_tables(plan, folder);
  if (submission.refusal.empty()) return 0;
  std::fflush(stdout);
  throw std::runtime_error(submission.refusal + " (" + std::to_string(submitted) + " of " +
                           std::to_string(orders.size()) +
                           " runs are submitted and stay so; mend the cause and give the same " +
                           "command again for the others)");
}

std::size_t array_size_of_cluster() {
  try {
    return sim::max_array_size();
  } catch (const sim::SlurmError& error) {
    throw ConfigError(std::string("--slurm: ") + error.what());
  }
}

}  // namespace

int sweep(const SweepArguments& arguments) {
  const sim::SweepPlan plan = sim::expand(sim::load_sweep_file(resolve_input_file(arguments.file)),
                                          sim::content_hash_of_file(sim::kThisProgram));
  if (arguments.dry_run) return dry_run(plan, sim::SweepFolder(arguments.out));
  if (arguments.status) return status(plan, sim::SweepFolder(arguments.out));

  sim::SlurmOptions slurm{1, arguments.jobs, arguments.sbatch_options};
  if (arguments.slurm) slurm.longest = array_size_of_cluster();
  const Interrupts interrupts;
  std::signal(SIGPIPE, SIG_IGN);  // whoever reads the progress may leave: the sweep goes on
  const sim::OutputFolder made(arguments.out);
  const sim::SweepFolder folder(std::filesystem::canonical(made.path()));
  expect_sweep_folder(folder.root());
  sim::FileLock lock(folder.root() / kDriverLock, sim::FileLock::Mode::kExclusive);
  if (!lock.take(kPatience_s)) {
    throw ConfigError(arguments.out + ": another sweep is at work here (" + lock.holder() +
                      "), expected a folder of its own");
  }
  lock.sign();
  warn_of_another_build(plan, folder);
  prepare(folder, plan);
  if (Interrupts::signal() != 0) return 128 + SIGINT;
  try {
    const int result = arguments.slurm
                           ? submit(plan, folder, slurm)
                           : fly(plan, folder, arguments.jobs > 0 ? arguments.jobs : cores());
    std::printf("%s\n", (folder.root() / "sweep.csv").c_str());
    flush_standard_output();
    return result;
  } catch (const DiskError& error) {
    if (error.disk_full()) fail_on_full_disk(folder, error.what());
    throw std::runtime_error(error.what());  // no bad input: what was flown until then stays
  }
}

int sweep_task(const SweepTaskArguments& arguments) {
  const std::filesystem::path file = std::filesystem::absolute(arguments.batch);
  const sim::BatchFile batch = sim::load_batch(file);
  if (arguments.index >= batch.runs.size()) {
    throw ConfigError(file.string() + ":1: has " + std::to_string(batch.runs.size()) +
                      " runs, expected an index below that");
  }
  const sim::SweepFolder folder(file.parent_path().parent_path());
  sim::FileLock workers(folder.root() / kWorkersLock, sim::FileLock::Mode::kShared);
  if (!workers.take(kTaskPatience_s)) {
    throw std::runtime_error(folder.root().string() + ": a local sweep is at work here");
  }
  const sim::RunOrder order = batch.runs[arguments.index];
  if (folder.summary(order.id)) return 0;
  sim::Supervisor supervisor(folder, sim::kThisProgram, {1, batch.timeout_s, batch.retries},
                             {[](const auto& broken, const auto& state) {
                                std::fprintf(stderr, "%s: %s\n", broken.id.c_str(),
                                             state.detail.c_str());
                              },
                              {}});
  const sim::SweepEnd end = supervisor.fly({order});
  if (end == sim::SweepEnd::kDiskFull) fail_on_full_disk(folder, supervisor.disk_full());
  if (end == sim::SweepEnd::kInterrupted) return 128 + SIGINT;
  return supervisor.progress().broken == 0 ? 0 : 1;
}

}  // namespace arex::app
