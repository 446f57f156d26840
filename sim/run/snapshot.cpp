#include "run/snapshot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "files/files.h"
#include "mapping/cloud_io.h"
#include "mapping/state_tree.h"
#include "run/snapshot_picture.h"
#include "run/summary.h"

namespace arex::sim {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

/// The centres of the cells for which `chosen` holds of their flags.
template <class Chosen>
std::vector<Vec3f> cells_of(const GridView& grid, const Chosen& chosen) {
  std::vector<Vec3f> centres;
  Eigen::Vector3i cell;
  for (cell.z() = 0; cell.z() < grid.size.z(); ++cell.z()) {
    for (cell.x() = 0; cell.x() < grid.size.x(); ++cell.x()) {
      for (cell.y() = 0; cell.y() < grid.size.y(); ++cell.y()) {
        if (chosen(grid.cells[grid.index(cell)])) {
          centres.push_back(grid.centre_of(cell).cast<float>());
        }
      }
    }
  }
  return centres;
}

// What is barred for its height alone is no obstacle.
bool is_inflated(std::uint8_t flags) {
  return (flags & GridView::kBlocked) != 0 && (flags & GridView::kBarred) == 0;
}

std::string own_cell_of(const GridView& grid, const Vec3& p_OB) {
  const std::uint8_t flags = grid.at(p_OB);
  if ((flags & GridView::kOccupied) != 0) return "occupied";
  if (is_inflated(flags)) return "inflated";
  return (flags & GridView::kKnown) != 0 ? "free" : "unknown";
}

/// Appends the points of a depth frame that the grid takes for obstacles.
void add_depth(const RegisteredDepth& depth, const LocalGridConfig& config, double own_returns_m,
               const Vec3& p_OB, std::vector<Vec3f>& cloud) {
  const DepthImage& image = *depth.image;
  for (int v = 0; v < image.camera.height; v += config.depth_hit_stride_px) {
    for (int u = 0; u < image.camera.width; u += config.depth_hit_stride_px) {
      const auto z = static_cast<double>(image.at(u, v));
      if (!(z >= config.depth_min_m && z <= config.depth_max_m)) continue;
      const Vec3 p = depth.X_OC * image.camera.unproject(u, v, z);
      if ((p - p_OB).norm() >= own_returns_m) cloud.push_back(p.cast<float>());
    }
  }
}

/// The cells that a frame alone would bar.
std::vector<Vec3f> inflate(const std::vector<Vec3f>& points, const GridView& grid, double radius_m,
                           double own_returns_m, const Vec3& p_OB, InflationShape shape) {
  BitGrid occupied(grid.size.x(), grid.size.z(), grid.size.y()), inflated = occupied;
  for (const Vec3f& point : points) {
    const Vec3 p = point.cast<double>();
    const Eigen::Vector3i cell = grid.cell_of(p);
    if (!grid.contains(cell) || (p - p_OB).norm() < own_returns_m) continue;
    occupied.row(cell.z(), cell.x())[cell.y() / 64] |= std::uint64_t{1} << (cell.y() % 64);
  }
  Inflation(radius_m, grid.resolution_m, shape).apply(occupied, inflated);
  std::vector<Vec3f> centres;
  for (int h = 0; h < inflated.rows_h; ++h) {
    for (int w = 0; w < inflated.rows_w; ++w) {
      for (int l = 0; l < inflated.length; ++l) {
        if ((inflated.row(h, w)[l / 64] >> (l % 64) & 1U) == 0) continue;
        centres.push_back(grid.centre_of({w, l, h}).cast<float>());
      }
    }
  }
  return centres;
}

/// A grid as OctoMap's tree: `chosen` cells occupied, other known ones free.
template <class Chosen>
void write_tree(const fs::path& file, const GridView& grid, const SensorModelConfig& sensor,
                const Chosen& chosen) {
  struct Masks {
    BrickMask known{}, occupied{};
  };
  const auto before = [](const Cell& a, const Cell& b) {
    return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
  };
  std::map<Cell, Masks, decltype(before)> bricks(before);
  const Cell low = (grid.low / grid.resolution_m).array().round().cast<int>();
  Cell cell;
  for (cell.z() = 0; cell.z() < grid.size.z(); ++cell.z()) {
    for (cell.x() = 0; cell.x() < grid.size.x(); ++cell.x()) {
      for (cell.y() = 0; cell.y() < grid.size.y(); ++cell.y()) {
        const std::uint8_t flags = grid.cells[grid.index(cell)];
        const bool occupied = chosen(flags);
        if (!occupied && (flags & GridView::kKnown) == 0) continue;
        const Cell at = low + cell;
        const auto inside = [&](int axis) { return static_cast<std::uint64_t>(at[axis] & 7); };
        const std::uint64_t voxel = morton(inside(0), inside(1), inside(2));
        Masks& masks = bricks[at.unaryExpr([](int c) { return c >> 3; })];
        masks.known[voxel / 64] |= std::uint64_t{1} << (voxel % 64);
        masks.occupied[voxel / 64] |= std::uint64_t{occupied} << (voxel % 64);
      }
    }
  }
  std::vector<BrickChange> changes;
  for (const auto& [brick, masks] : bricks) {
    changes.push_back({brick, &masks.known, &masks.occupied, masks.known});
  }
  StateTree tree(grid.resolution_m, sensor.min_probability, sensor.max_probability);
  tree.apply(changes);
  tree.write(file);
}

ordered_json description(const Snapshot& snapshot) {
  const Quat q = snapshot.X_OB.quaternion();
  const Vec3& p = snapshot.X_OB.p;
  ordered_json json{{"time_s", to_seconds(snapshot.stamp)},
                    {"grid_time_s", nullptr},
                    {"x_m", p.x()},
                    {"y_m", p.y()},
                    {"z_m", p.z()},
                    {"qx", q.x()},
                    {"qy", q.y()},
                    {"qz", q.z()},
                    {"qw", q.w()},
                    {"resolution_m", snapshot.resolution_m},
                    {"inflation_m", snapshot.inflation_m},
                    {"vehicle_radius_m", snapshot.radius_m},
                    {"own_cell", snapshot.own_cell},
                    {"scan_points", snapshot.scan.size()},
                    {"cloud_points", snapshot.cloud.size()},
                    {"grid_cells", snapshot.grid.size()},
                    {"inflated_grid_cells", snapshot.inflated.size()}};
  if (snapshot.grid_stamp) json["grid_time_s"] = to_seconds(*snapshot.grid_stamp);
  return json;
}

}  // namespace

Snapshot take_snapshot(Stamp stamp, const Odometry& odometry, const GridSnapshot* grid,
                       const MappedFrames& frames, const StackConfig& config) {
  const double own_returns_m = config.vehicle.own_returns_m();
  Snapshot snapshot;
  snapshot.stamp = stamp;
  snapshot.X_OB = odometry.X_OB;
  snapshot.resolution_m = config.mapping.resolution_m;
  snapshot.inflation_m = config.planning.inflation_m;
  snapshot.radius_m = config.vehicle.radius_m;
  snapshot.own_cell = "unknown";
  if (!grid) return snapshot;
  snapshot.grid_stamp = grid->stamp;
  const Vec3& p_OB = odometry.X_OB.p;
  std::vector<RegisteredScan> scans;  // that this grid was made from
  for (const RegisteredScan& scan : frames.scans) {
    if (scan.stamp <= grid->stamp) scans.push_back(scan);
  }
  const std::size_t held =
      std::min(scans.size(), static_cast<std::size_t>(config.mapping.local.lidar_frames));
  for (std::size_t i = scans.size() - held; i < scans.size(); ++i) {
    const std::vector<Vec3f>& points = *scans[i].points_O;
    snapshot.cloud.insert(snapshot.cloud.end(), points.begin(), points.end());
    if (i + 1 == scans.size()) snapshot.scan = points;
  }
  if (config.mapping.local.use_depth && frames.depth && frames.depth->image) {
    add_depth(*frames.depth, config.mapping.local, own_returns_m, p_OB, snapshot.cloud);
  }
  snapshot.grid =
      cells_of(grid->view, [](std::uint8_t flags) { return (flags & GridView::kOccupied) != 0; });
  snapshot.inflated = cells_of(grid->view, is_inflated);
  snapshot.scan_alone = inflate(snapshot.scan, grid->view, config.planning.inflation_m,
                                own_returns_m, p_OB, config.mapping.local.inflation_shape);
  snapshot.own_cell = own_cell_of(grid->view, p_OB);
  return snapshot;
}

void write_snapshot(const fs::path& folder, const Snapshot& snapshot, const GridSnapshot* grid,
                    const SensorModelConfig& sensor) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw DiskError(folder, "cannot be created", error);
  write_pcd(folder / "scan.pcd", snapshot.scan);
  write_pcd(folder / "cloud.pcd", snapshot.cloud);
  write_pcd(folder / "grid.pcd", snapshot.grid);
  write_pcd(folder / "inflated_grid.pcd", snapshot.inflated);
  const GridView none;
  const GridView& view = grid ? grid->view : none;
  write_tree(folder / "grid.bt", view, sensor,
             [](std::uint8_t flags) { return (flags & GridView::kOccupied) != 0; });
  write_tree(folder / "inflated_grid.bt", view, sensor, is_inflated);
  write_atomically(folder / "snapshot.png", png_bytes(draw_snapshot(snapshot)));
  write_atomically(folder / "snapshot.json", json_text(description(snapshot)));
}

SnapshotTaker::SnapshotTaker(const fs::path& run_folder, std::vector<Stamp> times,
                             const StackConfig& config)
    : folder_(snapshots_folder(run_folder)), times_(std::move(times)), config_(config) {
  std::sort(times_.begin(), times_.end());
  times_.erase(std::unique(times_.begin(), times_.end()), times_.end());
}

void SnapshotTaker::update(Stamp now, const FlightSoftware& software) {
  if (times_.empty() || now < times_.front()) return;
  const Stamp stamp = times_.front();
  times_.erase(times_.begin());
  const FlightView view = software.view();
  const Snapshot snapshot =
      take_snapshot(stamp, view.odometry, view.grid.get(), software.mapped_frames(), config_);
  write_snapshot(folder_ / snapshot_name(stamp), snapshot, view.grid.get(),
                 config_.mapping.local.sensor);
}

fs::path snapshots_folder(const fs::path& run) { return run / "snapshots"; }

std::string snapshot_name(Stamp stamp) {
  std::string text = fmt::format("{:.9f}", to_seconds(stamp));
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text;
}

std::vector<std::string> snapshot_names(const fs::path& run) {
  std::vector<std::string> names;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(snapshots_folder(run), none)) {
    if (entry.is_directory(none)) names.push_back(entry.path().filename().string());
  }
  std::sort(names.begin(), names.end(), [](const std::string& a, const std::string& b) {
    return std::strtod(a.c_str(), nullptr) < std::strtod(b.c_str(), nullptr);
  });
  return names;
}

void remove_snapshots(const fs::path& run) {
  std::error_code none;
  for (const std::string& name : snapshot_names(run)) {
    const fs::path folder = snapshots_folder(run) / name;
    // The last one first: what is half removed is unfinished.
    for (auto file = kSnapshotFiles.rbegin(); file != kSnapshotFiles.rend(); ++file) {
      fs::remove(folder / *file, none);
    }
    fs::remove(folder, none);
  }
  fs::remove(snapshots_folder(run), none);
}

}  // namespace arex::sim
