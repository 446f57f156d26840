#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "evaluation/timed_pose.h"
#include "report/table.h"

/// Reading run folders back. A killed run leaves some files short and others out: what is there is
/// read, what is not is named.
namespace arex::sim {

/// A TUM file. A last line cut short by a kill is left out; empty if the file is missing.
std::vector<TimedPose> read_tum(const std::filesystem::path& file);

/// A cloud in the order of first sight, thinned evenly along that order.
struct RecordedCloud {
  std::size_t total = 0;        ///< points in the file
  std::vector<Vec3f> points_O;  ///< at most what was asked for
};

/// A binary PCD whose first fields are x, y, z (float). Empty if missing or of another kind.
RecordedCloud read_cloud(const std::filesystem::path& file, std::size_t max_points);

/// The 2D map of map_server's format, rows from the top.
struct RecordedMap {
  int width = 0;
  int height = 0;
  double resolution_m = 0;
  double origin_x_m = 0;  ///< lower left corner in O
  double origin_y_m = 0;
  std::vector<std::uint8_t> cells;  ///< 0 occupied, 205 unknown, 254 free
};
std::optional<RecordedMap> read_map(const std::filesystem::path& folder);

struct RunRecord {
  std::filesystem::path folder;
  std::string title;  ///< what tells it from the other runs of its sweep; may be empty
  std::optional<nlohmann::ordered_json> summary;  ///< nothing: the run is unfinished
  std::string resolved_yaml;
  std::vector<TimedPose> truth;     ///< X_OB, 200 Hz
  std::vector<TimedPose> estimate;  ///< X_OB, 200 Hz
  Table events;
  Table flight;
  Table coverage;
  Table decisions;
  Table timing;
  Table cloud_growth;
  RecordedCloud cloud;
  std::optional<RecordedMap> map;
  std::vector<std::string> missing;  ///< files of the contract that are not there

  /// End of what was recorded, s.
  [[nodiscard]] double duration_s() const;
};

/// Whether a folder is a run's, finished or not.
bool is_run_folder(const std::filesystem::path& folder);

/// summary.json if it is there and whole.
std::optional<nlohmann::ordered_json> read_summary(const std::filesystem::path& folder);

/// @throws ConfigError if the folder is not a run's.
RunRecord read_run(const std::filesystem::path& folder, std::size_t max_cloud_points);

}  // namespace arex::sim
