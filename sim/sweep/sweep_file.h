#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "config/config.h"

/// Sweeps: many runs of `arex run`, each a process of its own, in one folder.
namespace arex::sim {

/// More runs are a slip of the pen: what each resolves to is kept in memory, 30 kB.
inline constexpr int kMostRuns = 50'000;

/// `key: value` of a scenario, with where the sweep file says it.
struct Assignment {
  std::string key;  ///< dotted
  std::string where;
  ConfigNode value;
};

/// A scenario file to start from.
struct BaseScenario {
  std::filesystem::path file;
  std::string where;
};

/// One key of `grid`.
struct GridAxis {
  std::string key;
  std::string where;
  std::vector<ConfigNode> values;
};

/// One item of `list`: values that belong together.
struct Variant {
  std::string name;                  ///< may be empty
  std::optional<BaseScenario> base;  ///< instead of the file's
  std::vector<Assignment> values;
};

/// One key of `latin_hypercube`.
struct HypercubeAxis {
  enum class Scale { kLinear, kLog, kInteger };
  std::string key;
  std::string where;
  double low = 0;
  double high = 0;
  Scale scale = Scale::kLinear;
};

/// Points that fill a box evenly in each of its keys.
/// Source: McKay, Beckman and Conover, Technometrics 1979.
struct LatinHypercube {
  int samples = 0;
  std::uint64_t seed = 1;
  std::vector<HypercubeAxis> axes;
};

/// A sweep as its file says it. Runs: list x base x hypercube x grid x seeds x repeats.
struct SweepFile {
  std::string name;  ///< the file's name without its ending
  std::string where;
  std::vector<BaseScenario> bases;
  std::vector<Assignment> set;
  std::vector<Variant> list;
  LatinHypercube hypercube;
  std::vector<GridAxis> grid;
  std::vector<std::uint64_t> seeds;  ///< empty: each base's own
  std::string seeds_where;
  int repeats = 1;          ///< of the same run: for times, or to see that nothing differs
  double timeout_s = 3600;  ///< wall time after which a run is killed
  int retries = 1;          ///< after a crash or a timeout; a mission that fails is no crash
};

/// Reads a sweep file; paths of scenarios are relative to it. @throws ConfigError.
SweepFile load_sweep_file(const std::filesystem::path& file);

}  // namespace arex::sim
