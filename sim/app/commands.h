#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

/// The commands of `arex`, one function each. All return the process's exit code and throw
/// ConfigError for bad input (main turns it into one line and exit code 2).
namespace arex::app {

/// What every command that reads a scenario takes.
struct ScenarioArguments {
  std::string file;
  std::vector<std::string> overrides;  ///< --set key=value
  std::optional<std::uint64_t> seed;   ///< --seed
};

struct RunArguments {
  ScenarioArguments scenario;
  std::string out;                        ///< empty: see RunFolder::first_free
  std::string name;                       ///< of the scenario, in the summary; empty: the file's
  std::string bag;                        ///< ROS 1 bag or MCAP to write; empty: none
  std::string bag_layout = "generic";     ///< see BagLayout
  std::string bag_compression = "none";   ///< or lz4
  std::vector<std::string> requirements;  ///< of the summary: field>=value
  std::vector<std::string> snapshots;     ///< times of the mission, s
  std::string junit;                      ///< JUnit file to write; empty: none
  int threads = 0;                        ///< 0: one a core, four at most
  bool report = true;                     ///< also write report.html
  bool quiet = false;
};
int run(const RunArguments& arguments);

struct WorldArguments {
  std::string file;  ///< a world recipe, or a scenario, whose `world` section is taken
  std::vector<std::string> overrides;
  std::optional<std::uint64_t> seed;
  std::string out;
};
int world(const WorldArguments& arguments);

struct PatternArguments {
  std::string mode = "device";
  int shots = 50'000;
};
int pattern(const PatternArguments& arguments);

struct SparseArguments {
  std::vector<std::string> thicknesses_m, distances_m, rates_hz;  ///< empty: a table of each
  int frames = 40;                                                ///< of each case
  std::vector<std::string> overrides;                             ///< --set key=value, of the LiDAR
  std::optional<std::uint64_t> seed;
  std::string out;  ///< folder to write
};
int sparse(const SparseArguments& arguments);

struct RenderArguments {
  std::string folder;  ///< a run folder
  std::string out;     ///< FILE.png: a picture; FILE.mp4: a film
  std::string what;    ///< infrared, or a part of a snapshot; empty: the flight in its world
  std::string view;    ///< chase, top or both; empty: chase for a picture, both for a film
  std::optional<double> time_s;  ///< of a picture; default the middle of the flight, of a snapshot
                                 ///< the only one
  std::optional<double> from_s;  ///< of a film; default the flight's start
  std::optional<double> to_s;    ///< of a film; default the flight's end
  int fps = 25;
  double speed = 8;  ///< seconds of flight in a second of film
};
int render(const RenderArguments& arguments);

struct SweepArguments {
  std::string file;
  std::string out;
  int jobs = 0;          ///< runs at a time; 0: one a core
  bool dry_run = false;  ///< list what would run
  bool status = false;   ///< say what has run
  bool slurm = false;    ///< submit instead of flying here
  std::vector<std::string> sbatch_options;
};
int sweep(const SweepArguments& arguments);

/// What a job of `sweep --slurm` does: one run of a batch.
struct SweepTaskArguments {
  std::string batch;
  std::uint64_t index = 0;
};
int sweep_task(const SweepTaskArguments& arguments);

struct BlameArguments {
  std::string folder;  ///< of a failed run
  std::string out;     ///< folder to write; empty: the run's with -blame behind its name
  int jobs = 0;        ///< flights at a time; 0: one a core
};
int blame(const BlameArguments& arguments);

struct SemanticsArguments {
  std::string input;                   ///< a cloud (PCD, PLY) or a run folder
  std::string out;                     ///< folder to write
  std::vector<std::string> overrides;  ///< --set key=value, keys of the section `semantics`
};
int semantics(const SemanticsArguments& arguments);

struct ReportArguments {
  std::vector<std::string> folders;  ///< run folders and sweeps
  bool runs = false;                 ///< also of every run of a sweep
};
int report(const ReportArguments& arguments);

struct ReplayArguments {
  std::string recording;                    ///< a ROS 1 bag or MCAP
  std::string out;                          ///< run folder to write
  std::string config;                       ///< a scenario; empty: the defaults
  std::vector<std::string> overrides;       ///< --set key=value
  std::string lidar_topic, imu_topic;       ///< empty: told by type
  std::string truth_topic;                  ///< empty: told by type and name
  std::string depth_topic, infrared_topic;  ///< likewise; of the left eye
  std::string truth;                        ///< TUM file; empty: what the recording has
  std::vector<std::string> snapshots;       ///< times of the recording, s
  std::string imu_unit = "auto";            ///< of accelerations: auto, g or mps2
  std::string time_unit = "auto";           ///< of points: auto, s, ms, us or ns
  int threads = 1;
  bool report = true;  ///< also write report.html
  bool quiet = false;
};
int replay(const ReplayArguments& arguments);

struct EvaluateArguments {
  std::vector<std::string> files;  ///< estimates and, without `truth`, the reference behind them
  std::string truth;               ///< a trajectory or a run folder; empty: the last of the files
  std::string align = "none";
  std::uint64_t poses_to_align = 0;  ///< the first so many matched ones; 0: all
  double max_time_difference_s = 0.01;
  double time_offset_s = 0;
  std::vector<std::string> deltas_m;  ///< empty: 1 and 10
  bool pairs_from_reference = false;
  std::string format;  ///< of files that cannot be told apart; empty: none is
  std::string out;     ///< folder of evaluation.json and .html; empty: neither
};
int evaluate(const EvaluateArguments& arguments);

int params(const ScenarioArguments& arguments);
int validate(const ScenarioArguments& arguments);

/// Prints what every figure of a summary and every column of a run folder is, with its unit.
int help_figures();

}  // namespace arex::app
