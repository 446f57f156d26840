#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "sweep/sweep_file.h"

namespace arex::sim {

/// One run of a sweep.
struct PlannedRun {
  std::string id;        ///< hash of (resolved configuration, seed, build): its folder's name
  std::string scenario;  ///< the base's name
  std::string variant;   ///< of `list`; empty if it has none
  std::vector<std::string> values;  ///< of SweepPlan::keys, in their order
  std::uint64_t seed = 0;
  int repeat = 1;        ///< from 1
  std::string resolved;  ///< the scenario, every value
};

/// All runs of a sweep, in the order of its table.
struct SweepPlan {
  std::string name;
  std::string build;              ///< hash of the binary that flies
  std::vector<std::string> keys;  ///< every key that `list`, `latin_hypercube` or `grid` varies
  bool has_variants = false;
  int repeats = 1;
  double timeout_s = 0;
  int retries = 0;
  std::vector<PlannedRun> runs;

  /// The order to fly in: seed by seed, so that an unfinished sweep has something of each variant;
  /// each run folder once, whatever number of rows it stands in.
  [[nodiscard]] std::vector<const PlannedRun*> flying_order() const;
};

/// How many runs a sweep asks for; a double, for it may be any product.
double count_runs(const SweepFile& sweep);

/// Expands a sweep and checks every scenario of it. @throws ConfigError at the sweep file's line
/// for a key that no scenario has or a value that it refuses.
SweepPlan expand(const SweepFile& sweep, const std::string& build);

/// The name of a run's folder: 16 hexadecimal digits.
std::string run_id(const std::string& build, const std::string& scenario, int repeat,
                   const std::string& resolved);

/// XXH3 of bytes, as 16 hexadecimal digits.
std::string content_hash(std::string_view bytes);
/// The same of a file's. @throws std::runtime_error.
std::string content_hash_of_file(const std::filesystem::path& file);

}  // namespace arex::sim
