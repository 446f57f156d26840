#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "app/commands.h"
#include "app/host.h"
#include "app/interrupts.h"
#include "app/snapshot_option.h"
#include "config/text.h"
#include "files/files.h"
#include "report/run_report.h"
#include "run/idle_faults.h"
#include "run/recorder.h"
#include "run/requirement.h"
#include "run/run_folder.h"
#include "run/scenario.h"
#include "run/simulation.h"
#include "run/snapshot.h"
#include "run/summary.h"

namespace arex::app {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kMostThreads = 4;  // unless more are asked for: these keep all lanes busy

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// The line that a person watches.
class ProgressLine {
 public:
  explicit ProgressLine(bool shown) : shown_(shown), on_terminal_(isatty(STDERR_FILENO) != 0) {}
  ~ProgressLine() {
    if (drawn_ && on_terminal_) std::fputc('\n', stderr);
  }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void update(const sim::Simulation& simulation) {
    if (!shown_) return;
    const double wall = seconds_since(begin_);
    if (wall < next_) return;
    next_ = wall + (on_terminal_ ? 0.25 : 10.0);  // a log wants a line now and then
    const double time = to_seconds(simulation.now());
    const FlightView view = simulation.view();
    const auto state = kMissionStateNames[static_cast<std::size_t>(view.state)];
    if (on_terminal_) std::fputc('\r', stderr);
    std::fprintf(stderr, "%7.1f s  %-10.*s  targets %2zu  explored %3.0f %%  %5.2fx real time ",
                 time, static_cast<int>(state.size()), state.data(), view.targets.size(),
                 100 * simulation.area_fraction(), time / wall);
    if (!on_terminal_) std::fputc('\n', stderr);
    drawn_ = true;
  }

 private:
  bool shown_;
  bool on_terminal_;
  bool drawn_ = false;
  double next_ = 0;
  Clock::time_point begin_ = Clock::now();
};

std::unique_ptr<sim::RunFolder> claim_folder(const RunArguments& arguments,
                                             const sim::Scenario& scenario) {
  if (!arguments.out.empty()) return std::make_unique<sim::RunFolder>(arguments.out);
  std::string name = scenario.name + "-seed" + std::to_string(scenario.config.seed);
  std::replace(name.begin(), name.end(), '/', '_');
  return sim::RunFolder::first_free(std::filesystem::path("runs") / name, scenario.resolved_yaml());
}

// The flight may take minutes: what cannot be written afterwards is said before.
void check_outputs(const RunArguments& arguments, const std::filesystem::path& folder) {
  std::vector<sim::NamedFile> files = sim::files_of_a_run(folder);
  files.push_back({"the scenario", arguments.scenario.file});
  if (!arguments.bag.empty()) {
    files.push_back({"--bag", arguments.bag});
    files.push_back({"the growing bag", arguments.bag + ".active"});
  }
  if (!arguments.junit.empty()) files.push_back({"--junit", arguments.junit});
  for (const std::string& file : {arguments.bag, arguments.junit}) {
    if (!file.empty()) check_writable(file);
  }
  sim::expect_different_files(files);
}

/// The times of --snapshot. @throws ConfigError for one that the mission cannot have.
std::vector<Stamp> times_of_snapshots(const RunArguments& arguments,
                                      const sim::Scenario& scenario) {
  return snapshot_times(arguments.snapshots, scenario.config.stack.mission.max_time_s,
                        "mission.max_time_s");
}

sim::BagOptions bag_options(const RunArguments& arguments, const sim::Scenario& scenario) {
  const auto named =
      std::find(sim::kBagLayoutNames.begin(), sim::kBagLayoutNames.end(), arguments.bag_layout);
  return {
      static_cast<sim::BagLayout>(named - sim::kBagLayoutNames.begin()),
      arguments.bag_compression == "lz4" ? sim::BagCompression::kLz4 : sim::BagCompression::kNone,
      scenario.config.lidar.model.misses_in_bag, scenario.config.draws_infrared(),
      scenario.config.depth.model.baseline_m};
}

/// What a flight leaves: the run folder and, if asked for, a bag. A file that the disk refuses does
/// not keep the others from being written.
class Outputs {
 public:
  /// @throws DiskError if one of them cannot be begun.
  void begin(const RunArguments& arguments, const sim::Scenario& scenario,
             const std::filesystem::path& folder, sim::Simulation& simulation) {
    if (!arguments.bag.empty()) {
      bag_.emplace(arguments.bag, scenario.config.stack.vehicle, bag_options(arguments, scenario));
    }
    recorder_.emplace(folder, scenario.resolved_yaml());
    snapshots_.emplace(folder, times_of_snapshots(arguments, scenario), scenario.config.stack);
    simulation.record_to(*recorder_);
    if (bag_) simulation.record_to(*bag_);
  }
  /// Does it, and remembers what went wrong: the others are still to be written.
  void attempt(const std::function<void()>& write) {
    try {
      write();
    } catch (const std::exception& error) {
      failed(error);
    }
  }
  void failed(const std::exception& error) { failures_.emplace_back(error.what()); }
  void close_bag() {
    if (bag_ && failures_.empty()) attempt([&] { bag_->close(); });
  }
  sim::Recorder& recorder() { return *recorder_; }
  sim::SnapshotTaker& snapshots() { return *snapshots_; }
  [[nodiscard]] std::vector<std::string> failures() const {
    std::vector<std::string> all = failures_;
    for (std::string& failure : recorder_->failures()) all.push_back(std::move(failure));
    return all;
  }

 private:
  std::optional<sim::BagWriter> bag_;
  std::optional<sim::Recorder> recorder_;
  std::optional<sim::SnapshotTaker> snapshots_;
  std::vector<std::string> failures_;
};

void fly(sim::Simulation& simulation, Outputs& outputs, bool quiet) {
  ProgressLine progress(!quiet);
  // A flight that is not recorded is not worth flying: it ends where the disk refuses.
  try {
    while (simulation.tick()) {
      outputs.snapshots().update(simulation.now(), simulation.software());
      if (Interrupts::signal() != 0) simulation.interrupt("signal");
      if (outputs.recorder().failed()) simulation.interrupt(printable(outputs.failures().front()));
      progress.update(simulation);
    }
  } catch (const DiskError& error) {  // of the bag, or of a snapshot
    outputs.failed(error);
    simulation.interrupt(printable(error.what()));
  }
}

// Before the summary: what it does not say yet of the flight, and whether it is all there.
nlohmann::ordered_json write_results(const sim::Scenario& scenario, const sim::FlightResult& result,
                                     const sim::HostTime& host, Outputs& outputs) {
  sim::Recorder& recorder = outputs.recorder();
  recorder.write_file("odometry_error.csv", sim::odometry_error_csv(result.flight.poses));
  if (result.coverage) {
    recorder.write_file("coverage.csv", sim::write_coverage_csv(result.coverage->rows));
  }
  recorder.write_file("timing.csv", sim::timing_csv(result.timing));
  outputs.close_bag();
  recorder.flush();
  nlohmann::ordered_json summary = sim::summarise(scenario, result, host);
  if (const auto failures = outputs.failures(); !failures.empty()) summary["unwritten"] = failures;
  recorder.write_summary(summary);
  return summary;
}

void print_result(const sim::FlightResult& result, const std::filesystem::path& shown) {
  const std::string outcome(sim::kOutcomeNames[static_cast<std::size_t>(result.outcome)]);
  std::printf("%s: %s\n  time %.1f s, distance %.1f m, ", outcome.c_str(),
              printable(result.reason).c_str(), to_seconds(result.duration),
              result.flight.distance_m);
  if (result.coverage) std::printf("explored %.1f %%, ", 100 * result.coverage->area_fraction);
  std::printf("odometry error %.3f m, clearance %.2f m\n  hash %s\n  %s\n",
              result.flight.odometry.ate_rmse_m, result.flight.clearance.min_m,
              result.trajectory_hash.c_str(), printable(shown.string()).c_str());
  flush_standard_output();
}

std::vector<sim::Requirement> parse_requirements(const RunArguments& arguments) {
  std::vector<sim::Requirement> requirements;
  for (const std::string& text : arguments.requirements) {
    requirements.push_back(sim::parse_requirement(text));
  }
  return requirements;
}

/// @return whether every requirement is met; one line for each that is not.
bool all_met(const std::vector<sim::Requirement>& requirements,
             const nlohmann::ordered_json& summary) {
  bool all = true;
  for (const sim::Requirement& requirement : requirements) {
    const std::string violation = sim::violation(requirement, summary);
    if (violation.empty()) continue;
    all = false;
    std::fprintf(stderr, "arex: required %s, but %s\n", printable(requirement.text).c_str(),
                 violation.c_str());
  }
  return all;
}

/// One line of what went wrong, which no report and no result line replaces.
void complain(const sim::FlightResult& result, const std::vector<std::string>& failures,
              bool quiet) {
  if (!failures.empty()) {
    const std::string more =
        failures.size() == 1 ? "" : " (and " + std::to_string(failures.size() - 1) + " more)";
    std::fprintf(stderr, "arex: %s%s\n", printable(failures.front()).c_str(), more.c_str());
  } else if (quiet && result.outcome != sim::Outcome::kSucceeded) {
    const std::string outcome(sim::kOutcomeNames[static_cast<std::size_t>(result.outcome)]);
    std::fprintf(stderr, "arex: %s after %.1f s: %s\n", outcome.c_str(),
                 to_seconds(result.duration), printable(result.reason).c_str());
  }
}

}  // namespace

int run(const RunArguments& arguments) {
  const Clock::time_point begin = Clock::now();
  const double cpu_begin = cpu_seconds();
  const Interrupts interrupts;
  std::signal(SIGPIPE, SIG_IGN);  // whoever reads the progress may leave: the flight goes on
  sim::Scenario scenario =
      sim::load_scenario(resolve_input_file(arguments.scenario.file), arguments.scenario.overrides,
                         arguments.scenario.seed);
  scenario.name = printable(arguments.name.empty() ? scenario.name : arguments.name);
  const std::vector<sim::Requirement> requirements = parse_requirements(arguments);
  static_cast<void>(times_of_snapshots(arguments, scenario));
  const std::unique_ptr<sim::RunFolder> folder = claim_folder(arguments, scenario);
  check_outputs(arguments, folder->path());

  // The world is built before anything is written: a bad recipe leaves nothing. The outputs live
  // longer than the simulation, whose jobs may write to them until its end.
  Outputs outputs;
  sim::Simulation simulation(
      scenario, arguments.threads > 0 ? arguments.threads : std::min(cores(), kMostThreads));
  outputs.begin(arguments, scenario, folder->path(), simulation);
  for (const std::string& line : sim::idle_faults(scenario.config)) {
    std::fprintf(stderr, "arex: %s\n", printable(line).c_str());
  }
  fly(simulation, outputs, arguments.quiet);
  const sim::FlightResult result = simulation.finish();
  const nlohmann::ordered_json summary =
      write_results(scenario, result, {seconds_since(begin), cpu_seconds() - cpu_begin}, outputs);

  // Whoever stops us after the flight does not wait for its report.
  const bool stopped = Interrupts::signal() != 0 && result.outcome != sim::Outcome::kInterrupted;
  const bool report = arguments.report && !stopped;
  if (report) outputs.attempt([&] { sim::write_run_report(folder->path()); });
  if (!arguments.junit.empty()) {
    outputs.attempt(
        [&] { write_atomically(arguments.junit, sim::junit_xml(summary, requirements)); });
  }
  if (!arguments.quiet) {
    outputs.attempt(
        [&] { print_result(result, report ? folder->path() / "report.html" : folder->path()); });
  }
  tell_missed(outputs.snapshots().missed(), "flight", result.duration);
  complain(result, outputs.failures(), arguments.quiet);
  const bool met = all_met(requirements, summary);
  if (Interrupts::signal() != 0) return 128 + SIGINT;
  return met && outputs.failures().empty() && result.outcome == sim::Outcome::kSucceeded ? 0 : 1;
}

}  // namespace arex::app
