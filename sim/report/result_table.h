#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "report/table.h"

namespace arex::sim {

/// Many runs, a row each, whatever they come from.
struct ResultTable {
  std::vector<std::string> keys;  ///< what varies beside the seed, in the table's columns
  /// Columns: keys, `seed`, `failure`, `detail`, then the flattened summaries. A run without a
  /// summary has a failure and empty figures.
  Table table;
  std::vector<std::filesystem::path> folders;  ///< of each row
};

/// What tells each run from the others: the values of the keys that vary, and its seed. Where
/// that does not tell two apart, their folders do.
std::vector<std::string> run_titles(const ResultTable& results);
std::string run_title(const ResultTable& results, std::size_t row);

/// The same without the seed: runs of one configuration have one title.
std::vector<std::string> configuration_titles(const ResultTable& results);

/// Every key of a run's resolved.yaml with its value; nothing without that file.
std::vector<std::pair<std::string, std::string>> resolved_keys(const std::filesystem::path& run);

/// The same of a run folder inside a sweep that has ended; empty for any other folder.
std::string title_in_sweep(const std::filesystem::path& run_folder);

/// Whether a folder holds a sweep, finished or not.
bool is_sweep_folder(const std::filesystem::path& folder);

/// Reads the sweep.csv of sweeps and the summaries of single runs into one table. What differs
/// between single runs is taken from their resolved.yaml.
/// @throws ConfigError if a folder is neither, or a sweep has no sweep.csv yet.
ResultTable read_results(const std::vector<std::filesystem::path>& folders);

}  // namespace arex::sim
