#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <list>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <stdexcept>

#include "app/commands.h"
#include "app/host.h"
#include "blame/blame_report.h"
#include "blame/experiments.h"
#include "blame/verdict.h"
#include "config/config.h"
#include "config/text.h"
#include "files/files.h"
#include "report/result_table.h"
#include "report/run_record.h"
#include "run/file_io.h"
#include "run/foreign_json.h"
#include "run/simulation.h"
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
  return {name,
          text,
          sim::text_field(summary, "outcome"),
          sim::text_field(summary, "reason"),
          summary.at("sim_time_s").get<double>(),
          sim::text_field(summary, "trajectory_hash")};
}

/// @throws ConfigError for the first field that a blame needs and a summary lacks.
void expect_fields(const fs::path& file, const ordered_json& summary) {
  const auto expect = [&](const char* key, const char* type, auto is_of_type) {
    const auto field = summary.find(key);
    if (field != summary.end() && is_of_type(*field)) return;
    throw ConfigError(file.string() + (field == summary.end() ? ": lacks '" : ": has an odd '") +
                      key + "', expected " + type + ", as a run's summary has");
  };
  for (const char* key : {"outcome", "reason", "scenario"}) {
    expect(key, "a text", [](const ordered_json& field) { return field.is_string(); });
  }
  expect("seed", "an integer",
         [](const ordered_json& field) { return field.is_number_unsigned(); });
  expect("sim_time_s", "a number", [](const ordered_json& field) { return field.is_number(); });
}

/// @throws ConfigError for a folder that is none of a run.
void expect_run_folder(const fs::path& run) {
  std::error_code none;
  if (sim::is_sweep_folder(run)) {
    throw ConfigError(run.string() + ": is the folder of a sweep, expected one of its runs");
  }
  if (sim::is_run_folder(run)) return;
  throw ConfigError(run.string() + (fs::exists(run, none) ? ": holds no run" : ": does not exist") +
                    ", expected a run folder");
}

/// The summary of a run that can be blamed for something. @throws ConfigError
ordered_json summary_of(const fs::path& run) {
  std::error_code none;
  expect_run_folder(run);
  const fs::path file = run / "summary.json";
  if (!fs::exists(file, none)) {
    throw ConfigError(run.string() + ": is unfinished, expected a run with a summary");
  }
  const auto summary = sim::read_summary(run);
  if (!summary) throw ConfigError(file.string() + ": is no JSON object, expected a run's summary");
  if (summary->contains("replay")) {
    throw ConfigError(run.string() + ": is a replay, expected a flight");
  }
  expect_fields(file, *summary);
  const std::string outcome = sim::text_field(*summary, "outcome");
  if (outcome == "interrupted") {
    throw ConfigError(run.string() + ": was interrupted, expected a flight that came to its end");
  }
  const auto ends = std::span(sim::kOutcomeNames).subspan(1);  // "flying" is none
  if (std::find(ends.begin(), ends.end(), outcome) == ends.end()) {
    throw ConfigError(file.string() + ": has the outcome '" + shortened(outcome) +
                      "', expected succeeded, collided, stuck, lost or timed_out");
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
  blame.seed = summary.at("seed").get<std::uint64_t>();
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
