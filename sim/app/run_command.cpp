#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <vector>

#include "app/commands.h"
#include "report/run_report.h"
#include "run/recorder.h"
#include "run/requirement.h"
#include "run/scenario.h"
#include "run/simulation.h"
#include "run/summary.h"

namespace arex::app {
namespace {

using Clock = std::chrono::steady_clock;

std::atomic<int> interrupt_signal{0};

void on_signal(int signal) { interrupt_signal = signal; }

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
    const Mission& mission = simulation.stack().mission();
    const auto state = kMissionStateNames[static_cast<std::size_t>(mission.state())];
    if (on_terminal_) std::fputc('\r', stderr);
    std::fprintf(stderr, "%7.1f s  %-10.*s  targets %2zu  explored %3.0f %%  %5.2fx real time ",
                 time, static_cast<int>(state.size()), state.data(), mission.targets().size(),
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

std::filesystem::path run_folder(const RunArguments& arguments, const sim::Scenario& scenario) {
  if (!arguments.out.empty()) return arguments.out;
  return std::filesystem::path("runs") /
         (scenario.name + "-seed" + std::to_string(scenario.config.seed));
}

void print_result(const sim::FlightResult& result, const std::filesystem::path& folder) {
  const auto outcome = sim::kOutcomeNames[static_cast<std::size_t>(result.outcome)];
  std::printf("%.*s (%s) after %.1f s and %.1f m, hash %s: %s\n", static_cast<int>(outcome.size()),
              outcome.data(), result.reason.c_str(), to_seconds(result.duration),
              result.flight.distance_m, result.trajectory_hash.c_str(), folder.c_str());
}

int exit_code_of(sim::Outcome outcome) {
  if (outcome == sim::Outcome::kSucceeded) return 0;
  return outcome == sim::Outcome::kInterrupted ? 128 + SIGINT : 1;
}

std::vector<sim::Requirement> parse_requirements(const RunArguments& arguments) {
  std::vector<sim::Requirement> requirements;
  for (const std::string& text : arguments.requirements) {
    requirements.push_back(sim::parse_requirement(text));
  }
  return requirements;
}

// The flight may take minutes: that its verdict cannot be written is said before.
void check_writable(const std::string& file) {
  if (file.empty()) return;
  const std::filesystem::path folder = std::filesystem::absolute(file).parent_path();
  if (access(folder.c_str(), W_OK) != 0 || std::filesystem::is_directory(file)) {
    throw ConfigError(file + ": cannot be written, expected a file in a folder that exists");
  }
}

/// @return whether every requirement is met; one line for each that is not.
bool judge(const std::vector<sim::Requirement>& requirements,
           const nlohmann::ordered_json& summary) {
  bool all = true;
  for (const sim::Requirement& requirement : requirements) {
    const std::string violation = sim::violation(requirement, summary);
    if (violation.empty()) continue;
    all = false;
    std::fprintf(stderr, "arex: required %s, but %s\n", requirement.text.c_str(),
                 violation.c_str());
  }
  return all;
}

void write_junit(const std::string& file, const std::string& xml) {
  std::ofstream stream(file);
  stream << xml;
  if (!stream.flush()) throw std::runtime_error(file + ": cannot be written");
}

}  // namespace

int run(const RunArguments& arguments) {
  const Clock::time_point begin = Clock::now();
  const double cpu_begin = cpu_seconds();
  sim::Scenario scenario = sim::load_scenario(arguments.scenario.file, arguments.scenario.overrides,
                                              arguments.scenario.seed);
  if (!arguments.name.empty()) scenario.name = arguments.name;
  const std::filesystem::path folder = run_folder(arguments, scenario);
  const std::vector<sim::Requirement> requirements = parse_requirements(arguments);
  check_writable(arguments.junit);

  // The world is built before anything is written: a bad recipe leaves nothing.
  sim::Simulation simulation(scenario, arguments.threads);
  std::optional<sim::BagWriter> bag;
  std::optional<sim::Recorder> recorder;
  try {
    if (!arguments.bag.empty()) bag.emplace(arguments.bag, scenario.config.stack.vehicle);
    recorder.emplace(folder, scenario.resolved_yaml());
  } catch (const std::runtime_error& error) {
    throw ConfigError(error.what());  // a path that cannot be written is bad input
  }
  simulation.record_to(*recorder);
  if (bag) simulation.record_to(*bag);

  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
  {
    ProgressLine progress(!arguments.quiet);
    while (simulation.tick()) {
      if (interrupt_signal != 0) simulation.interrupt("signal");
      progress.update(simulation);
    }
  }
  const sim::FlightResult result = simulation.finish();
  if (bag) bag->close();
  recorder->write_file("odometry_error.csv", sim::odometry_error_csv(result.flight.poses));
  if (result.coverage) {
    recorder->write_file("coverage.csv", sim::write_coverage_csv(result.coverage->rows));
  }
  recorder->write_file("timing.csv", sim::timing_csv(result.timing));
  const nlohmann::ordered_json summary =
      sim::summarise(scenario, result, {seconds_since(begin), cpu_seconds() - cpu_begin});
  recorder->write_summary(summary);
  if (arguments.report) sim::write_run_report(folder);
  if (!arguments.quiet) print_result(result, folder);
  if (!arguments.junit.empty()) {
    write_junit(arguments.junit, sim::junit_xml(summary, requirements));
  }
  const int exit_code = exit_code_of(result.outcome);
  return judge(requirements, summary) || exit_code != 0 ? exit_code : 1;
}

}  // namespace arex::app
