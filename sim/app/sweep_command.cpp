#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "app/commands.h"
#include "sweep/file_io.h"
#include "sweep/supervisor.h"
#include "sweep/sweep_file.h"
#include "sweep/sweep_folder.h"
#include "sweep/sweep_plan.h"
#include "sweep/sweep_table.h"

namespace arex::app {
namespace {

constexpr const char* kSelf = "/proc/self/exe";

int cores() {
  cpu_set_t set;
  CPU_ZERO(&set);
  return sched_getaffinity(0, sizeof set, &set) == 0 ? std::max(1, CPU_COUNT(&set)) : 1;
}

std::string clock_text(double seconds) {
  std::array<char, 32> text{};
  const long whole = std::lround(seconds);
  std::snprintf(text.data(), text.size(), "%ld:%02ld:%02ld", whole / 3600, whole / 60 % 60,
                whole % 60);
  return text.data();
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

  void update(const sim::SweepProgress& p) {
    const bool last = p.finished + p.broken == p.total;
    if (!on_terminal_ && !last && p.elapsed_s < next_s_) return;
    next_s_ = p.elapsed_s + 30;  // a log wants a line now and then
    std::string left = p.left_s < 0 ? "?" : clock_text(p.left_s);
    std::fprintf(stderr, "%s%zu/%zu done, %zu running, %zu missions failed, %zu broken, %s, ETA %s",
                 on_terminal_ ? "\r\033[K" : "", done_ + p.finished, total_, p.running,
                 p.missions_failed, p.broken, clock_text(p.elapsed_s).c_str(), left.c_str());
    if (!on_terminal_) std::fputc('\n', stderr);
    open_ = on_terminal_;
  }

 private:
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

int status(const sim::SweepPlan& plan, const sim::SweepFolder& folder) {
  std::map<std::string, std::size_t> outcomes;
  std::size_t finished = 0;
  std::size_t running = 0;
  const std::vector<std::string> partials = folder.partials();
  const auto order = plan.flying_order();
  for (const sim::PlannedRun* run : order) {
    if (const auto summary = folder.summary(run->id)) {
      ++finished;
      ++outcomes[(*summary)["outcome"].get<std::string>()];
      continue;
    }
    if (std::binary_search(partials.begin(), partials.end(), run->id)) {
      ++running;
      continue;
    }
    const auto failure = folder.state(run->id).failure;
    ++outcomes[std::string(sim::kFailureNames[static_cast<std::size_t>(failure)])];
  }
  std::printf("%s: %zu of %zu finished, %zu in flight", plan.name.c_str(), finished, order.size(),
              running);
  for (const auto& [outcome, count] : outcomes) std::printf(", %zu %s", count, outcome.c_str());
  std::printf("\n");
  return finished == order.size() ? 0 : 1;
}

void write_tables(const sim::SweepPlan& plan, const sim::SweepFolder& folder) {
  const sim::SweepTables tables = sim::sweep_tables(plan, folder);
  sim::write_atomically(folder.root() / "sweep_host.csv", tables.host);
  sim::write_atomically(folder.root() / "sweep.csv", tables.results);
}

void warn_of_another_build(const sim::SweepPlan& plan, const sim::SweepFolder& folder) {
  const auto before =
      nlohmann::json::parse(sim::read_file(folder.root() / "sweep.json"), nullptr, false);
  if (!before.is_object() || before.value("build", plan.build) == plan.build) return;
  std::fprintf(stderr, "%s: holds runs of another build, which do not count for this one\n",
               folder.root().c_str());
}

std::filesystem::path made_folder(const std::string& out) {
  std::error_code error;
  std::filesystem::create_directories(out, error);
  if (error) throw ConfigError(out + ": " + error.message() + ", expected a folder to write");
  return std::filesystem::canonical(out);
}

int fly(const sim::SweepPlan& plan, const sim::SweepFolder& folder, int jobs) {
  std::vector<sim::RunOrder> orders;
  const auto all = plan.flying_order();
  for (const sim::PlannedRun* run : all) {
    if (!folder.summary(run->id)) orders.push_back({run->id, run->scenario});
  }
  SweepLine line(all.size() - orders.size(), all.size());
  sim::Supervisor supervisor(
      folder, kSelf, {jobs, plan.timeout_s, plan.retries},
      {[&](const auto& order, const auto& state) { line.broken(order, state); },
       [&](const auto& progress) { line.update(progress); }});
  const sim::SweepEnd end = supervisor.fly(orders);
  if (end == sim::SweepEnd::kDiskFull) {
    throw std::runtime_error(folder.root().string() + ": the disk is full; " +
                             "make room and give the same command again");
  }
  write_tables(plan, folder);
  if (end == sim::SweepEnd::kInterrupted) return 128 + SIGINT;
  return supervisor.progress().broken == 0 ? 0 : 1;
}

}  // namespace

int sweep(const SweepArguments& arguments) {
  const sim::SweepPlan plan =
      sim::expand(sim::load_sweep_file(arguments.file), sim::fingerprint(kSelf));
  if (arguments.dry_run) return dry_run(plan, sim::SweepFolder(arguments.out));
  if (arguments.status) return status(plan, sim::SweepFolder(arguments.out));

  const sim::SweepFolder folder(made_folder(arguments.out));
  sim::FileLock lock(folder.root() / ".lock", sim::FileLock::Mode::kExclusive);
  if (!lock.take()) {
    throw ConfigError(arguments.out + ": another sweep is at work here (" + lock.holder() +
                      "), expected a folder of its own");
  }
  lock.sign("process " + std::to_string(getpid()) + " on " + sim::host_name());
  warn_of_another_build(plan, folder);
  folder.prepare(plan);
  folder.remove_all_partials();
  const int result = fly(plan, folder, arguments.jobs > 0 ? arguments.jobs : cores());
  std::printf("%s\n", (folder.root() / "sweep.csv").c_str());
  return result;
}

}  // namespace arex::app
