#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <exception>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/host.h"
#include "app/number_option.h"
#include "config/config.h"
#include "config/nearest.h"
#include "config/text.h"
#include "files/files.h"
#include "run/summary.h"

namespace {

using namespace arex::app;
using arex::ConfigError;
using arex::nearest;

constexpr Range<std::uint64_t> kSeeds{};
constexpr Range<double> kMoments{-1e9, 1e9};  // s, as in a scenario
constexpr int kMostShots = 100'000'000;       // 500 s of the device

void add_scenario_options(CLI::App& command, ScenarioArguments& arguments, bool file_required) {
  auto* file = command.add_option("scenario", arguments.file, "scenario file, scenarios/*.yaml");
  if (file_required) file->required();
  command.add_option("--set", arguments.overrides, "key=value over what the file says")
      ->allow_extra_args(false);
  add_number(command, "--seed", arguments.seed, kSeeds, "the seed of everything random");
}

void add_run(CLI::App& app, RunArguments& arguments, int& exit_code) {
  auto* command = app.add_subcommand("run", "fly a scenario, write a scored run folder");
  add_scenario_options(*command, arguments.scenario, true);
  command->add_option("--out", arguments.out, "run folder; default runs/SCENARIO-seedN");
  command->add_option("--name", arguments.name, "the scenario's name; default the file's");
  command->add_option(
      "--bag", arguments.bag,
      "also write the sensors' data: FILE.mcap as MCAP with ROS 2 messages, else a ROS 1 bag");
  command
      ->add_option("--bag-layout", arguments.bag_layout,
                   "of its LiDAR points: generic, livox_driver2, livox_custom or livox_custom2")
      ->check(CLI::IsMember({"generic", "livox_driver2", "livox_custom", "livox_custom2"}))
      ->capture_default_str();
  command->add_option("--bag-compression", arguments.bag_compression, "of its chunks: none or lz4")
      ->check(CLI::IsMember({"none", "lz4"}))
      ->capture_default_str();
  command
      ->add_option("--require", arguments.requirements,
                   "field>=value of the summary, else exit code 1; may be repeated")
      ->allow_extra_args(false);
  command
      ->add_option("--snapshot", arguments.snapshots,
                   "mission time, s, at which to write what the vehicle sees; may be repeated")
      ->allow_extra_args(false);
  command->add_option("--junit", arguments.junit, "also write the verdicts as JUnit XML");
  add_number(*command, "--threads", arguments.threads, Range<int>{1, 64},
             "host threads; the result does not change; default one a core, at most 4");
  command->add_flag("!--no-report", arguments.report, "no report.html");
  command->add_flag("--quiet", arguments.quiet, "no progress line; a failed mission is one line");
  command->callback([&] { exit_code = run(arguments); });
}

void add_world(CLI::App& app, WorldArguments& arguments, int& exit_code) {
  auto* command = app.add_subcommand("world", "write a world: mesh, MJCF, ground-truth map");
  command
      ->add_option("recipe", arguments.file,
                   "world recipe, scenario, or a mesh, Gazebo world, octree or cloud")
      ->required();
  command->add_option("--set", arguments.overrides, "key=value over what the file says")
      ->allow_extra_args(false);
  add_number(*command, "--seed", arguments.seed, kSeeds, "the seed of the world");
  command->add_option("--out", arguments.out, "folder to write")->required();
  command->callback([&] { exit_code = world(arguments); });
}

void add_pattern(CLI::App& app, PatternArguments& arguments, int& exit_code) {
  auto* command = app.add_subcommand("pattern", "print the MID-360's firing directions as CSV");
  command->add_option("--mode", arguments.mode, "device or table")
      ->check(CLI::IsMember({"device", "table"}));
  add_number(*command, "--shots", arguments.shots, Range<int>{1, kMostShots},
             "shots to print; a shot is four firings");
  command->callback([&] { exit_code = pattern(arguments); });
}

void add_sparse(CLI::App& app, SparseArguments& arguments, int& exit_code) {
  auto* command = app.add_subcommand(
      "sparse", "how often one LiDAR frame misses a thin obstacle, CSV and page");
  const auto add_list = [&](const char* name, std::vector<std::string>& values,
                            const char* meaning) {
    command->add_option(name, values, meaning)->delimiter(',')->allow_extra_args(false);
  };
  add_list("--thickness", arguments.thicknesses_m, "of upright bars, m");
  add_list("--distance", arguments.distances_m, "to them, m");
  add_list("--rate", arguments.rates_hz, "of the frames, Hz");
  add_number(*command, "--frames", arguments.frames, Range<int>{5, 10'000}, "of each case");
  command
      ->add_option("--set", arguments.overrides,
                   "key=value of the section lidar, as lidar.echo.dropout_probability=0")
      ->allow_extra_args(false);
  add_number(*command, "--seed", arguments.seed, kSeeds, "of the LiDAR's noise");
  command->add_option("--out", arguments.out, "folder to write")->required();
  command->callback([&] { exit_code = sparse(arguments); });
}

void add_render(CLI::App& app, RenderArguments& arguments, int& exit_code) {
  auto* command = app.add_subcommand("render", "draw a recorded flight, a picture or a film");
  command->add_option("folder", arguments.folder, "run folder")->required();
  command->add_option("--out", arguments.out, "FILE.png or FILE.mp4")->required();
  command
      ->add_option("--view", arguments.view,
                   "chase, top or both; default chase for a picture, both for a film")
      ->check(CLI::IsMember({"chase", "top", "both"}));
  command
      ->add_option(
          "--what", arguments.what,
          "infrared: the left infrared image, with the features followed in it; of a snapshot: "
          "scan, cloud, grid or inflated_grid")
      ->check(CLI::IsMember({"infrared", "scan", "cloud", "grid", "inflated_grid"}));
  add_number(*command, "--time", arguments.time_s, kMoments,
             "moment of a picture, s; default the flight's middle, or the only snapshot");
  add_number(*command, "--from", arguments.from_s, kMoments,
             "start of a film, s; default the flight's");
  add_number(*command, "--to", arguments.to_s, kMoments, "end of a film, s; default the flight's");
  add_number(*command, "--fps", arguments.fps, Range<int>{1, 120}, "frames of a second of film");
  add_number(*command, "--speed", arguments.speed, Range<double>{1e-3, 1e6},
             "seconds of flight in a second of film");
  command->callback([&] { exit_code = render(arguments); });
}

void add_sweep(CLI::App& app, SweepArguments& arguments, int& exit_code) {
  auto* command = app.add_subcommand("sweep", "fly many runs, each a process of its own");
  command->add_option("sweep", arguments.file, "sweep file, scenarios/sweeps/*.yaml")->required();
  command->add_option("--out", arguments.out, "folder; the same command there goes on")->required();
  add_number(*command, "--jobs", arguments.jobs, Range<int>{1, 1024}, "runs at a time")
      ->default_str("one a core");
  command->add_flag("--dry-run", arguments.dry_run, "list the runs, write nothing");
  command->add_flag("--status", arguments.status, "say how far it is, write nothing");
  command->add_flag("--slurm", arguments.slurm,
                    "submit to Slurm what is missing; all that follows goes to sbatch");
  command->callback([&] { exit_code = sweep(arguments); });
}

void add_sweep_task(CLI::App& app, SweepTaskArguments& arguments, int& exit_code) {
  auto* command = app.add_subcommand("sweep-task", "one run of a batch of 'sweep --slurm'");
  command->group("");  // for Slurm, not for people
  command->add_option("batch", arguments.batch, "file of the batch")->required();
  add_number(*command, "index", arguments.index, Range<std::uint64_t>{}, "of the run in it")
      ->required();
  command->callback([&] { exit_code = sweep_task(arguments); });
}

// Everything behind --slurm is sbatch's, whatever it looks like.
std::vector<std::string> take_sbatch_options(std::vector<std::string>& arguments) {
  const auto slurm = std::find(arguments.begin(), arguments.end(), "--slurm");
  if (arguments.empty() || arguments[0] != "sweep" || slurm == arguments.end()) return {};
  std::vector<std::string> options(slurm + 1, arguments.end());
  arguments.erase(slurm + 1, arguments.end());
  return options;
}

void add_report(CLI::App& app, ReportArguments& arguments, int& exit_code) {
  auto* command = app.add_subcommand("report", "write report.html beside recorded data");
  command
      ->add_option("folders", arguments.folders,
                   "run folders, folders of sweeps; several are compared")
      ->required();
  command->add_flag("--runs", arguments.runs, "also a report of every run of a sweep");
  command->callback([&] { exit_code = report(arguments); });
}

void add_evaluate(CLI::App& app, EvaluateArguments& arguments, int& exit_code) {
  auto* command =
      app.add_subcommand("evaluate", "compare trajectories with the truth, as evo does");
  command
      ->add_option("files", arguments.files,
                   "estimates and behind them the truth: TUM, EuRoC or KITTI, or a run folder")
      ->required();
  command->add_option("--truth", arguments.truth, "the truth, if all of the files are estimates");
  command
      ->add_option("--align", arguments.align,
                   "what moves an estimate onto the truth: none, origin, yaw, se3, sim3 or scale")
      ->check(CLI::IsMember({"none", "origin", "yaw", "se3", "sim3", "scale"}))
      ->capture_default_str();
  add_number(*command, "--n-to-align", arguments.poses_to_align, Range<std::uint64_t>{},
             "align by the first so many matched poses; 0: by all");
  add_number(*command, "--max-time-difference", arguments.max_time_difference_s,
             Range<double>{0, 1e9}, "between poses that belong together, s");
  add_number(*command, "--time-offset", arguments.time_offset_s, Range<double>{-1e12, 1e12},
             "added to the stamps of the estimates, s");
  command->add_option("--delta", arguments.deltas_m, "lengths of the relative error's sub-paths, m")
      ->default_str("1,10")
      ->delimiter(',')
      ->allow_extra_args(false);
  command->add_flag("--pairs-from-reference", arguments.pairs_from_reference,
                    "measure sub-paths along the truth, not along the estimate");
  command->add_option("--format", arguments.format, "what files are that may be of several formats")
      ->check(CLI::IsMember({"tum", "euroc", "kitti"}));
  command->add_option("--out", arguments.out, "folder for evaluation.json and evaluation.html");
  command->callback([&] { exit_code = evaluate(arguments); });
}

void add_replay(CLI::App& app, ReplayArguments& arguments, int& exit_code) {
  auto* command = app.add_subcommand("replay", "run odometry and maps on a recording");
  command->add_option("recording", arguments.recording, "a ROS 1 bag or MCAP")->required();
  command->add_option("--out", arguments.out, "run folder to write")->required();
  command->add_option("--config", arguments.config,
                      "scenario whose vehicle, odometry and maps are taken; default the defaults");
  command->add_option("--set", arguments.overrides, "key=value over what the file says")
      ->allow_extra_args(false);
  command->add_option("--lidar-topic", arguments.lidar_topic, "default: told by its type");
  command->add_option("--imu-topic", arguments.imu_topic, "default: told by its type");
  command->add_option("--truth-topic", arguments.truth_topic,
                      "default: poses whose topic's name says so");
  command->add_option("--depth-topic", arguments.depth_topic, "default: told by type and name");
  command->add_option("--infrared-topic", arguments.infrared_topic,
                      "of the pair's left eye; default: told by type and name");
  command
      ->add_option("--snapshot", arguments.snapshots,
                   "what it sees after so many seconds of the recording, into snapshots/; may be "
                   "repeated")
      ->allow_extra_args(false);
  command->add_option("--truth", arguments.truth, "a trajectory, in place of such a topic");
  command->add_option("--imu-unit", arguments.imu_unit, "of accelerations: auto, g or mps2")
      ->check(CLI::IsMember({"auto", "g", "mps2"}))
      ->capture_default_str();
  command->add_option("--time-unit", arguments.time_unit, "of points' times: auto, s, ms, us or ns")
      ->check(CLI::IsMember({"auto", "s", "ms", "us", "ns"}))
      ->capture_default_str();
  add_number(*command, "--threads", arguments.threads, Range<int>{1, 64},
             "host threads; the result does not change");
  command->add_flag("!--no-report", arguments.report, "no report.html");
  command->add_flag("--quiet", arguments.quiet, "no progress line");
  command->callback([&] { exit_code = replay(arguments); });
}

void add_semantics(CLI::App& app, SemanticsArguments& arguments, int& exit_code) {
  auto* command = app.add_subcommand("semantics", "name what a point cloud shows");
  command->add_option("cloud", arguments.input, "CLOUD.pcd, CLOUD.ply or a run folder")->required();
  command->add_option("--out", arguments.out, "folder to write")->required();
  command
      ->add_option("--set", arguments.overrides,
                   "key=value of the section semantics, as scene=forest; see arex params")
      ->allow_extra_args(false);
  command->callback([&] { exit_code = semantics(arguments); });
}

void add_blame(CLI::App& app, BlameArguments& arguments, int& exit_code) {
  auto* command = app.add_subcommand(
      "blame", "fly a failed run again, truth in the place of one module at a time");
  command->add_option("folder", arguments.folder, "run folder")->required();
  command->add_option("--out", arguments.out, "folder to write; default RUN-blame");
  add_number(*command, "--jobs", arguments.jobs, Range<int>{1, 64}, "flights at a time")
      ->default_str("one a core");
  command->callback([&] { exit_code = blame(arguments); });
}

void add_help(CLI::App& app, std::string& topic, int& exit_code) {
  auto* command = app.add_subcommand("help", "say what something is: help figures");
  command->add_option("topic", topic, "figures: every field of summary.json and column of the CSVs")
      ->required()
      ->check(CLI::IsMember({"figures"}));
  command->callback([&] { exit_code = help_figures(); });
}

// The names that a command line may use where `word` stands, or nothing if it is one of them.
std::vector<std::string> alternatives(const CLI::App& command, const std::string& word) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) {
      if ("--" + name == word) return {};
      names.push_back("--" + name);
    }
  }
  return names;
}

// A shell leaves an empty word where a variable is not set: no file has that name, and what is
// written by default is not what was asked for.
[[noreturn]] void refuse_empty(const std::string& command, const std::string& option) {
  throw ConfigError("arex " + command + ": " + (option.empty() ? "an argument" : option) +
                    " is empty, expected a value; see arex " + command + " --help");
}

// CLI11 only says that a word was not expected; the nearest one is what the user looks for. And it
// takes the next option for the value of one that was left without: `--bag --quiet` wrote a bag of
// that name.
void expect_known_words(const CLI::App& app, const std::vector<std::string>& words) {
  if (words.empty() || words[0].starts_with("-")) return;
  std::vector<std::string> names;
  const CLI::App* command = nullptr;
  for (const CLI::App* each : app.get_subcommands({})) {
    if (each->get_name() == words[0]) command = each;
    if (!each->get_group().empty()) names.push_back(each->get_name());
  }
  if (command == nullptr) {
    throw ConfigError("arex: unknown command '" + words[0] + "'; did you mean '" +
                      nearest(words[0], names) + "'? See arex --help");
  }
  const CLI::Option* waiting = nullptr;  // for its value, the next word
  bool names_only = false;               // from "--" on
  for (const std::string& word : words) {
    const CLI::Option* option_before = std::exchange(waiting, nullptr);
    if (word.empty()) refuse_empty(words[0], option_before ? option_before->get_name() : "");
    names_only = names_only || word == "--";
    if (names_only || !word.starts_with("--")) continue;
    const std::string option = word.substr(0, word.find('='));
    if (option + "=" == word) refuse_empty(words[0], option);
    const std::vector<std::string> known = alternatives(*command, option);
    if (known.empty() && option_before != nullptr) {
      throw ConfigError("arex " + words[0] + ": " + option_before->get_name() +
                        " needs a value before " + option + "; see arex " + words[0] + " --help");
    }
    if (known.empty()) {
      const CLI::Option* named = command->get_option_no_throw(option);
      if (named != nullptr && named->get_items_expected_min() > 0 && word == option)
        waiting = named;
      continue;
    }
    throw ConfigError("arex " + words[0] + ": unknown option '" + option + "'; did you mean '" +
                      nearest(option, known) + "'? See arex " + words[0] + " --help");
  }
}

int execute(int argc, char** argv) {
  CLI::App app{"AREX: a software-in-the-loop testbed for autonomous exploring drones", "arex"};
  app.require_subcommand(1);
  int exit_code = 0;
  RunArguments run_arguments;
  WorldArguments world_arguments;
  PatternArguments pattern_arguments;
  SparseArguments sparse_arguments;
  RenderArguments render_arguments;
  SweepArguments sweep_arguments;
  SweepTaskArguments sweep_task_arguments;
  ReportArguments report_arguments;
  ReplayArguments replay_arguments;
  EvaluateArguments evaluate_arguments;
  SemanticsArguments semantics_arguments;
  BlameArguments blame_arguments;
  ScenarioArguments params_arguments;
  ScenarioArguments validate_arguments;
  std::string help_topic;
  add_run(app, run_arguments, exit_code);
  add_world(app, world_arguments, exit_code);
  add_pattern(app, pattern_arguments, exit_code);
  add_sparse(app, sparse_arguments, exit_code);
  add_render(app, render_arguments, exit_code);
  add_sweep(app, sweep_arguments, exit_code);
  add_sweep_task(app, sweep_task_arguments, exit_code);
  add_report(app, report_arguments, exit_code);
  add_replay(app, replay_arguments, exit_code);
  add_evaluate(app, evaluate_arguments, exit_code);
  add_semantics(app, semantics_arguments, exit_code);
  add_blame(app, blame_arguments, exit_code);
  add_help(app, help_topic, exit_code);
  auto* params_command = app.add_subcommand("params", "list every parameter");
  add_scenario_options(*params_command, params_arguments, false);
  params_command->callback([&] { exit_code = params(params_arguments); });
  auto* validate_command = app.add_subcommand("validate", "check a scenario without flying it");
  add_scenario_options(*validate_command, validate_arguments, true);
  validate_command->callback([&] { exit_code = validate(validate_arguments); });

  app.set_version_flag("--version", [] {
    return "arex " + arex::sim::build_version() + ", compiled by " + arex::sim::build_compiler();
  });
  std::vector<std::string> words(argv + 1, argv + argc);
  sweep_arguments.sbatch_options = take_sbatch_options(words);
  expect_known_words(app, words);
  std::reverse(words.begin(), words.end());  // as CLI11 wants them
  try {
    app.parse(words);
  } catch (const CLI::Success& answered) {  // --help, --version
    std::ostringstream answer;              // through stdio, which says why it could not be written
    const int done = app.exit(answered, answer, answer);
    std::fputs(answer.str().c_str(), stdout);
    return done;
  }
  return exit_code;
}

int complain(const std::string& message, int exit_code) {
  std::fprintf(stderr, "%s\n", arex::printable(message).c_str());
  return exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  open_standard_streams();
  std::signal(SIGXFSZ, SIG_IGN);  // a file that may not grow is an error of write()
  try {
    const int exit_code = execute(argc, argv);
    flush_standard_output();
    return exit_code;
  } catch (const CLI::ParseError& error) {
    return complain("arex: " + std::string(error.what()) + "; see arex --help", 2);
  } catch (const arex::ConfigError& error) {
    return complain(error.what(), 2);
  } catch (const arex::DiskError& error) {
    return complain(error.what(), 2);
  } catch (const std::exception& error) {
    return complain("arex: " + std::string(error.what()), 1);
  }
}
