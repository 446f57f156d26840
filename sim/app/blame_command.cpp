#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <list>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>

#include "app/commands.h"
#include "app/host.h"
#include "blame/blame_report.h"
#include "blame/experiments.h"
#include "blame/verdict.h"
#include "config/config.h"
#include "config/text.h"
#include "files/files.h"
#include "report/run_record.h"
#include "run/file_io.h"
#include "run/foreign_json.h"
#include "run/summary.h"
#include "sweep/child_process.h"

namespace arex::app {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr const char* kLock = ".lock";
constexpr const char* kJson = "blame.json";
constexpr const char* kBlameReport = "blame.html";
constexpr double kLongestWait_s = 0.5;  // between two looks at the flights

sim::FlightEnd end_of(const std::string& name, const std::string& text,
                      const ordered_json& summary) {
  const auto time = summary.find("sim_time_s");
  return {name,
          text,
          sim::text_field(summary, "outcome"),
          sim::text_field(summary, "reason"),
          time != summary.end() && time->is_number() ? time->get<double>() : 0,
          sim::text_field(summary, "trajectory_hash")};
}

/// The summary of a run that can be blamed for something. @throws ConfigError
ordered_json summary_of(const fs::path& run) {
  std::error_code none;
  if (!sim::is_run_folder(run)) {
    throw ConfigError(run.string() +
                      (fs::exists(run, none) ? ": holds no run" : ": does not exist") +
                      ", expected a run folder");
  }
  const auto summary = sim::read_summary(run);
  if (!summary) throw ConfigError(run.string() + ": is unfinished, expected a run with a summary");
  if (summary->contains("replay")) {
    throw ConfigError(run.string() + ": is a replay, expected a flight");
  }
  const std::string outcome = sim::text_field(*summary, "outcome");
  if (outcome.empty() || outcome == "interrupted") {
    throw ConfigError(run.string() + ": was interrupted, expected a flight that came to its end");
  }
  return *summary;
}

bool flown_by_this_build(const ordered_json& summary) {
  const auto build = summary.find("build");
  return build != summary.end() && build->is_object() &&
         sim::text_field(*build, "version") == sim::build_version() &&
         sim::text_field(*build, "compiler") == sim::build_compiler();
}

/// Flies experiments, some at a time, a process and a run folder each.
class Flights {
 public:
  Flights(fs::path folder, std::string scenario, int jobs)
      : folder_(std::move(folder)), scenario_(std::move(scenario)), jobs_(jobs) {}

  /// @return whether all came to their ends, not stopped by a signal
  bool fly(const std::vector<sim::Experiment>& experiments) {
    const sim::SignalGate gate;
    auto next = experiments.begin();
    std::size_t done = 0;
    while (next != experiments.end() || !flying_.empty()) {
      for (; next != experiments.end() && flying_.size() < static_cast<std::size_t>(jobs_);
           ++next) {
        start(*next);
      }
      if (sim::SignalGate::wait(kLongestWait_s) != 0) return false;
      for (auto flight = flying_.begin(); flight != flying_.end();) {
        const std::optional<sim::ChildExit> exit = flight->process.poll();
        if (!exit) {
          ++flight;
          continue;
        }
        expect_summary(*flight, *exit);
        flight = flying_.erase(flight);
        tell(++done, experiments.size());
      }
    }
    return true;
  }

 private:
  struct Flight {
    std::string name;
    sim::ChildProcess process;
  };

  void start(const sim::Experiment& experiment) {
    const std::string configuration = experiment.name + ".yaml";
    write_atomically(folder_ / configuration, experiment.resolved_yaml);
    const std::string threads = std::to_string(std::clamp(cores() / jobs_, 1, 4));
    flying_.push_back(
        {experiment.name,
         sim::ChildProcess(sim::kThisProgram,
                           {"run", configuration, "--name", scenario_, "--out", experiment.name,
                            "--threads", threads, "--quiet", "--no-report"},
                           folder_)});
  }

  void expect_summary(const Flight& flight, const sim::ChildExit& exit) const {
    const bool ended = exit.signal == 0 && (exit.exit_code == 0 || exit.exit_code == 1);
    if (ended && sim::read_summary(folder_ / flight.name)) return;
    const std::string said = printable(shortened(exit.output, 300));
    throw std::runtime_error(fmt::format("arex: {}: the flight broke off{}",
                                         (folder_ / flight.name).string(),
                                         said.empty() ? "" : ": " + said));
  }

  static void tell(std::size_t done, std::size_t total) {
    if (isatty(STDERR_FILENO) == 0) return;
    std::fprintf(stderr, "\rflight %zu of %zu %s", done, total, done == total ? "\n" : "");
  }

  fs::path folder_;
  std::string scenario_;
  int jobs_;
  std::list<Flight> flying_;
};

// What is blamed must not stand in the middle of something else.
void expect_own_folder(const fs::path& folder) {
  for (const char* name : {"resolved.yaml", "sweep.json"}) {
    if (!fs::exists(folder / name)) continue;
    throw ConfigError(folder.string() +
                      ": holds a run or a sweep, expected a folder for the blame");
  }
  check_writable(folder / kJson);
  check_writable(folder / kBlameReport);
}

fs::path folder_for(const BlameArguments& arguments, const fs::path& run) {
  if (!arguments.out.empty()) return arguments.out;
  return run.parent_path() / (run.filename().string() + "-blame");
}

}  // namespace

int blame(const BlameArguments& arguments) {
  std::error_code none;
  const fs::path given = arguments.folder;
  const ordered_json summary = summary_of(given);
  sim::Blame blame;
  blame.failed = end_of("as_flown", "nothing", summary);
  if (blame.failed.succeeded()) {
    std::printf("%s: succeeded, there is nothing to blame\n", printable(given.string()).c_str());
    return 0;
  }
  const fs::path run = fs::canonical(given, none);
  blame.run = run.string();
  blame.scenario = sim::text_field(summary, "scenario", "run");
  const auto seed = summary.find("seed");
  if (seed != summary.end() && seed->is_number_unsigned()) blame.seed = seed->get<std::uint64_t>();
  const std::vector<sim::Experiment> experiments =
      sim::plan_experiments(blame.scenario, load_yaml(run / "resolved.yaml"),
                            blame.failed.outcome == "timed_out", !flown_by_this_build(summary));

  const sim::OutputFolder made(folder_for(arguments, run));
  const fs::path folder = fs::canonical(made.path());
  expect_own_folder(folder);
  sim::FileLock lock(folder / kLock, sim::FileLock::Mode::kExclusive);
  if (!lock.take()) {
    throw ConfigError(folder.string() + ": another blame is at work here (" + lock.holder() +
                      "), expected a folder of its own");
  }
  lock.sign();
  std::signal(SIGPIPE, SIG_IGN);
  Flights flights(folder, blame.scenario, arguments.jobs > 0 ? arguments.jobs : cores());
  if (!flights.fly(experiments)) return 128 + SIGINT;

  for (const sim::Experiment& experiment : experiments) {
    blame.flights.push_back(end_of(experiment.name, experiment.text,
                                   sim::read_summary(folder / experiment.name).value()));
  }
  blame.verdict = sim::judge(blame.failed, blame.flights,
                             sim::sensors_are_as_sold(load_yaml(run / "resolved.yaml")));
  write_atomically(folder / kBlameReport, sim::blame_report_html(blame, folder));
  write_atomically(folder / kJson, sim::json_text(sim::blame_json(blame)));
  lock.remove();
  std::printf("%s%s\n", sim::blame_table(blame).c_str(),
              printable((folder / kBlameReport).string()).c_str());
  flush_standard_output();
  return 0;
}

}  // namespace arex::app
