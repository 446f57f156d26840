#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/commands.h"
#include "app/host.h"
#include "app/interrupts.h"
#include "app/snapshot_option.h"
#include "config/text.h"
#include "evaluation/trajectory_file.h"
#include "report/run_report.h"
#include "run/replay.h"
#include "run/run_folder.h"
#include "run/snapshot.h"

namespace arex::app {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

sim::ReplayOptions options_of(const ReplayArguments& arguments) {
  sim::ReplayOptions options;
  options.lidar_topic = arguments.lidar_topic;
  options.imu_topic = arguments.imu_topic;
  options.truth_topic = arguments.truth_topic;
  options.depth_topic = arguments.depth_topic;
  options.infrared_topic = arguments.infrared_topic;
  if (arguments.imu_unit == "g") options.accel_unit = sim::AccelUnit::kG;
  if (arguments.imu_unit == "mps2") options.accel_unit = sim::AccelUnit::kMps2;
  if (arguments.time_unit == "s") options.time_unit = sim::TimeUnit::kSeconds;
  if (arguments.time_unit == "ms") options.time_unit = sim::TimeUnit::kMilliseconds;
  if (arguments.time_unit == "us") options.time_unit = sim::TimeUnit::kMicroseconds;
  if (arguments.time_unit == "ns") options.time_unit = sim::TimeUnit::kNanoseconds;
  return options;
}

/// Without a file the mapped box is that of no scenario: large, and under the user's own words.
sim::Scenario configuration(const ReplayArguments& arguments) {
  if (!arguments.config.empty()) {
    return sim::load_scenario(resolve_input_file(arguments.config), arguments.overrides, {});
  }
  std::vector<std::string> overrides{"mapping.global.low_m=[-100, -100, -10]",
                                     "mapping.global.high_m=[100, 100, 30]"};
  overrides.insert(overrides.end(), arguments.overrides.begin(), arguments.overrides.end());
  sim::Scenario scenario = sim::load_scenario({}, overrides, {});
  scenario.name = fs::path(arguments.recording).stem().string();
  return scenario;
}

void check_outputs(const ReplayArguments& arguments, const fs::path& folder) {
  std::vector<sim::NamedFile> files = sim::files_of_a_run(folder);
  files.push_back({"the recording", arguments.recording});
  if (!arguments.config.empty()) files.push_back({"--config", arguments.config});
  if (!arguments.truth.empty()) files.push_back({"--truth", arguments.truth});
  sim::expect_different_files(files);
}

/// The truth of a file, in the replay's time.
std::vector<sim::StampedPose> truth_of_file(const sim::Trajectory& trajectory, Stamp origin) {
  if (!trajectory.has_time()) {
    throw ConfigError("--truth: " + trajectory.file + " has no times, expected TUM or EuRoC");
  }
  std::vector<sim::StampedPose> poses;
  for (const sim::TimedPose& pose : trajectory.poses) {
    const Stamp stamp = from_seconds(pose.time_s) - origin;
    if (poses.empty() || stamp > poses.back().stamp) poses.push_back({stamp, pose.X});
  }
  return poses;
}

class Progress {
 public:
  explicit Progress(bool shown) : shown_(shown), on_terminal_(isatty(STDERR_FILENO) != 0) {}
  ~Progress() {
    if (drawn_ && on_terminal_) std::fputc('\n', stderr);
  }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void update(double replayed_s, double duration_s) {
    if (!shown_) return;
    const double wall = seconds_since(begin_);
    if (wall < next_) return;
    next_ = wall + (on_terminal_ ? 0.25 : 10.0);  // a log wants a line now and then
    if (on_terminal_) std::fputc('\r', stderr);
    std::fprintf(stderr, "%7.1f s of %.1f  %5.1fx real time ", replayed_s, duration_s,
                 replayed_s / wall);
    if (!on_terminal_) std::fputc('\n', stderr);
    drawn_ = true;
  }

 private:
  bool shown_, on_terminal_;
  bool drawn_ = false;
  double next_ = 0;
  Clock::time_point begin_ = Clock::now();
};

void print_result(const sim::ReplayResult& result, const sim::ReplayInput& input,
                  const fs::path& shown) {
  std::printf("%s: %s\n", result.outcome().c_str(), result.reason().c_str());
  for (const std::string& note : input.notes()) std::printf("  %s\n", printable(note).c_str());
  if (!result.poses.empty()) {
    std::printf("  path %.1f m, odometry error %.3f m (%.3f m after the best rigid fit)\n",
                *result.distance_m, result.odometry.ate_rmse_m, result.odometry.ate_se3_rmse_m);
  }
  std::printf("  %s\n", printable(shown.string()).c_str());
  flush_standard_output();
}

}  // namespace

int replay(const ReplayArguments& arguments) {
  const Clock::time_point begin = Clock::now();
  const std::clock_t cpu_begin = std::clock();
  const Interrupts interrupts;
  sim::Scenario scenario = configuration(arguments);
  constexpr double kLatest_s = 1e6;  // of a clock that a recording is replayed by
  const std::vector<Stamp> snapshots =
      snapshot_times(arguments.snapshots, kLatest_s, "ten days of recording");
  sim::ReplayInput input(arguments.recording, options_of(arguments));
  sim::prepare_for_replay(scenario, input);
  std::optional<sim::Trajectory> given;
  if (!arguments.truth.empty()) given = sim::read_trajectory(arguments.truth);
  const sim::RunFolder folder(arguments.out);
  check_outputs(arguments, folder.path());

  sim::Recorder recorder(folder.path(), scenario.resolved_yaml());
  sim::Replay replay(scenario, input, arguments.threads);
  replay.record_to(recorder);
  sim::SnapshotTaker taker(folder.path(), snapshots, scenario.config.stack);
  Progress progress(!arguments.quiet);
  const Stamp from = replay.now();
  while (replay.tick()) {
    taker.update(replay.now(), replay.software());
    if (Interrupts::signal() != 0 || recorder.failed()) replay.interrupt();
    progress.update(to_seconds(replay.now() - from), to_seconds(input.duration()));
  }
  const std::vector<sim::StampedPose> truth =
      given ? truth_of_file(*given, input.time_origin()) : input.read_truth();
  const sim::ReplayResult result = replay.finish(truth);
  if (!result.poses.empty()) {
    recorder.write_file("odometry_error.csv", sim::odometry_error_csv(result.poses));
  }
  recorder.write_file("timing.csv", sim::timing_csv(result.timing));
  recorder.flush();
  const sim::HostTime host{seconds_since(begin),
                           static_cast<double>(std::clock() - cpu_begin) / CLOCKS_PER_SEC};
  nlohmann::ordered_json summary = sim::summarise_replay(
      scenario, result, input, fs::path(arguments.recording).filename().string(), host);
  if (const auto failures = recorder.failures(); !failures.empty()) summary["unwritten"] = failures;
  recorder.write_summary(summary);
  if (arguments.report && !result.interrupted) sim::write_run_report(folder.path());
  if (!arguments.quiet) print_result(result, input, folder.path());
  tell_missed(taker.missed(), "recording", replay.now());
  for (const std::string& failure : recorder.failures()) {
    std::fprintf(stderr, "arex: %s\n", printable(failure).c_str());
  }
  if (arguments.quiet && result.outcome() != "succeeded") {
    std::fprintf(stderr, "arex: %s: %s\n", result.outcome().c_str(), result.reason().c_str());
  }
  if (Interrupts::signal() != 0) return 130;
  return result.outcome() == "succeeded" && recorder.failures().empty() ? 0 : 1;
}

}  // namespace arex::app
