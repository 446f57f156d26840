#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "exploration/explorer.h"
#include "mapping/mapper.h"
#include "math/pose.h"
#include "messages/events.h"

namespace arex::sim {

/// One row of flight.csv: what a report plots against time. Not a number: an empty cell.
struct FlightRow {
  Stamp stamp = 0;
  double speed_mps = 0;         ///< true
  double tracking_error_m = 0;  ///< true position against the setpoint
  double odometry_error_m = 0;  ///< estimate against truth, aligned at the start
  double odometry_yaw_error_rad = 0;
  double clearance_m = 0;  ///< airframe to the nearest surface
  double height_m = 0;     ///< true z in O
  double battery_voltage_v = 0;
  double battery_power_w = 0;
  double battery_fraction = 1;  ///< state of charge
};

/// How many points the cloud had at a moment. Points are in the order of their first sight, so that
/// the first `points` of cloud.pcd are the map of that moment.
struct CloudGrowth {
  Stamp stamp = 0;
  std::size_t points = 0;
};

/// The run folder. Everything but the summary is written while flying, so that a killed run leaves
/// what it had; the summary is written last and atomically: a folder without it is unfinished.
/// @throws std::runtime_error naming the file when the disk refuses.
class Recorder {
 public:
  /// Creates the folder, removes an older run's files of the contract and writes resolved.yaml.
  Recorder(std::filesystem::path directory, const std::string& resolved_yaml);
  ~Recorder();

  void truth(Stamp stamp, const Pose& X_OB);
  void estimate(Stamp stamp, const Pose& X_OB);
  void event(const Event& event);
  void flight(const FlightRow& row);
  /// Every candidate of a decision with its terms, to decisions.csv.
  void decision(const Decision& decision);
  /// Makes what was recorded so far readable by others.
  void flush();

  /// cloud.pcd and cloud_growth.csv, each replaced atomically. May be called from a job.
  void write_cloud(const std::vector<Vec3f>& points_O,
                   const std::vector<CloudGrowth>& growth) const;
  /// map.bt, map2d.pgm and map2d.yaml.
  void write_maps(const Mapper& mapper) const;
  /// A whole file of the folder, replaced atomically.
  void write_file(const std::string& name, const std::string& content) const;
  /// Flushes everything, then writes summary.json.
  void write_summary(const nlohmann::ordered_json& summary);

  [[nodiscard]] const std::filesystem::path& directory() const { return directory_; }

 private:
  using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;
  File open(const char* name, const std::string& header);
  void check(std::FILE* file, const char* name);

  std::filesystem::path directory_;
  File truth_;
  File estimate_;
  File events_;
  File flight_;
  File decisions_;
};

}  // namespace arex::sim
