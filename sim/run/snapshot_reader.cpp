#include "run/snapshot_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "clouds/pcd_reader.h"
#include "run/file_io.h"
#include "run/foreign_json.h"

namespace arex::sim {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

std::string chosen_name(const fs::path& run, std::optional<double> time_s) {
  const std::vector<std::string> names = snapshot_names(run);
  if (names.empty()) {
    throw ConfigError(run.string() + ": holds no snapshot, expected one of `arex run --snapshot`");
  }
  if (!time_s && names.size() == 1) return names.front();
  const std::string wanted = time_s ? snapshot_name(from_seconds(*time_s)) : "";
  if (std::find(names.begin(), names.end(), wanted) != names.end()) return wanted;
  std::string all;
  for (const std::string& name : names) all += (all.empty() ? "" : ", ") + name;
  throw ConfigError(time_s ? fmt::format("--time {:g}: no snapshot of that time in {}, expected {}",
                                         *time_s, run.string(), all)
                           : run.string() +
                                 ": holds several snapshots, expected --time with one "
                                 "of " +
                                 all);
}

double number_field(const ordered_json& json, const char* key, const fs::path& file) {
  const auto found = json.find(key);
  if (found != json.end() && found->is_number()) return found->get<double>();
  throw ConfigError(file.string() + ":1: has no number '" + key + "', expected a snapshot's");
}

std::vector<Vec3f> read_points(const fs::path& file) {
  const std::string bytes = read_file(file);
  if (bytes.empty()) throw ConfigError(file.string() + ":1: cannot be read, expected a PCD file");
  try {
    std::vector<Vec3f> points;
    for (const Vec3& p : read_pcd(parse_pcd_header(bytes, bytes.size()), bytes).points) {
      points.push_back(p.cast<float>());
    }
    return points;
  } catch (const ConfigError& error) {
    throw ConfigError(file.string() + ": " + error.what());
  }
}

}  // namespace

ReadSnapshot read_snapshot(const fs::path& run, SnapshotPart part, std::optional<double> time_s) {
  ReadSnapshot read;
  read.name = chosen_name(run, time_s);
  const fs::path folder = snapshots_folder(run) / read.name;
  const fs::path file = folder / "snapshot.json";
  const ordered_json json = parse_object(read_file(file));
  if (!json.is_object()) {
    throw ConfigError(folder.string() + ": is unfinished, expected a snapshot with snapshot.json");
  }
  const auto number = [&](const char* key) { return number_field(json, key, file); };
  Snapshot& snapshot = read.snapshot;
  snapshot.stamp = from_seconds(number("time_s"));
  snapshot.X_OB = {
      Quat(number("qw"), number("qx"), number("qy"), number("qz")).normalized().toRotationMatrix(),
      Vec3(number("x_m"), number("y_m"), number("z_m"))};
  snapshot.resolution_m = number("resolution_m");
  snapshot.radius_m = number("vehicle_radius_m");
  if (!(snapshot.resolution_m > 0)) {
    throw ConfigError(file.string() + ":1: out of range: expected resolution_m > 0");
  }
  const std::string name(kSnapshotParts[static_cast<std::size_t>(part)]);
  std::vector<Vec3f> points = read_points(folder / (name + ".pcd"));
  switch (part) {
    case SnapshotPart::kScan:
      snapshot.scan = std::move(points);
      break;
    case SnapshotPart::kCloud:
      snapshot.cloud = std::move(points);
      break;
    case SnapshotPart::kGrid:
      snapshot.grid = std::move(points);
      break;
    case SnapshotPart::kInflatedGrid:
      snapshot.inflated = std::move(points);
      break;
  }
  return read;
}

}  // namespace arex::sim
