#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "mapping/local_grid.h"
#include "messages/estimates.h"
#include "messages/registered_scan.h"
#include "stack/flight_software.h"
#include "stack/stack_config.h"

/// What the vehicle saw at one moment: the newest frame, all frames that its local grid held, and
/// that grid as the planner flew in it. A folder of a run, snapshots/TIME/.
namespace arex::sim {

/// All files of a snapshot; the last one is written last: a folder without it is unfinished.
inline constexpr std::array<std::string_view, 8> kSnapshotFiles{
    "scan.pcd",          "cloud.pcd",        "grid.pcd",     "grid.bt",
    "inflated_grid.pcd", "inflated_grid.bt", "snapshot.png", "snapshot.json"};

/// A snapshot, in O as the flight software had it. Points, and the centres of cells, m.
struct Snapshot {
  Stamp stamp = 0;
  std::optional<Stamp> grid_stamp;  ///< of the newest frame in the grid; nothing: there was none
  Pose X_OB;                        ///< estimated
  double resolution_m = 0.1;
  double inflation_m = 0;
  double radius_m = 0;            ///< of the vehicle
  std::vector<Vec3f> scan;        ///< of the newest LiDAR frame in the grid
  std::vector<Vec3f> cloud;       ///< of all LiDAR frames in it and its depth frame
  std::vector<Vec3f> grid;        ///< occupied cells
  std::vector<Vec3f> inflated;    ///< cells that the planner may not enter for an obstacle's sake
  std::vector<Vec3f> scan_alone;  ///< what they would be with the newest LiDAR frame alone
  std::string own_cell;           ///< of the vehicle: free, inflated, occupied or unknown
};

/// @param grid null: none yet
[[nodiscard]] Snapshot take_snapshot(Stamp stamp, const Odometry& odometry,
                                     const GridSnapshot* grid, const MappedFrames& frames,
                                     const StackConfig& config);

/// Writes all of its files. @param grid as above. @throws DiskError.
void write_snapshot(const std::filesystem::path& folder, const Snapshot& snapshot,
                    const GridSnapshot* grid, const SensorModelConfig& sensor);

/// Takes snapshots of a flight at given times.
class SnapshotTaker {
 public:
  /// Creates no folder yet. @param times of the mission's clock, in any order
  SnapshotTaker(const std::filesystem::path& run_folder, std::vector<Stamp> times,
                const StackConfig& config);

  /// After each tick. @throws DiskError.
  void update(Stamp now, const FlightSoftware& software);
  /// The times that the flight has not reached.
  [[nodiscard]] const std::vector<Stamp>& missed() const { return times_; }

 private:
  std::filesystem::path folder_;
  std::vector<Stamp> times_;  ///< in order, those to come
  StackConfig config_;
};

/// snapshots/ below a run folder.
[[nodiscard]] std::filesystem::path snapshots_folder(const std::filesystem::path& run);
/// The name of the folder in it, the time in seconds: 12.5.
[[nodiscard]] std::string snapshot_name(Stamp stamp);
/// The names of all of them, whole or not, in the order of time.
[[nodiscard]] std::vector<std::string> snapshot_names(const std::filesystem::path& run);
/// Removes what an older run has left, and nothing but a snapshot's files.
void remove_snapshots(const std::filesystem::path& run);

}  // namespace arex::sim
