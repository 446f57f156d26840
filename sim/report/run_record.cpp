#include "report/run_record.h"

#include <algorithm>
#include <charconv>
#include <cstring>
#include <sstream>
#include <string_view>

#include "config/config.h"
#include "run/foreign_json.h"

namespace arex::sim {
namespace {

// The next number of a line of blanks and numbers; false at its end.
bool next_number(std::string_view& line, double& value) {
  line.remove_prefix(std::min(line.find_first_not_of(" \t\r"), line.size()));
  const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), value);
  if (error != std::errc()) return false;
  line.remove_prefix(static_cast<std::size_t>(end - line.data()));
  return true;
}

bool parse_pose(std::string_view line, TimedPose& pose) {
  Quat q;
  Vec3& p = pose.X.p;
  const bool whole = next_number(line, pose.time_s) && next_number(line, p.x()) &&
                     next_number(line, p.y()) && next_number(line, p.z()) &&
                     next_number(line, q.x()) && next_number(line, q.y()) &&
                     next_number(line, q.z()) && next_number(line, q.w());
  if (!whole || q.norm() < 0.5) return false;
  pose.X.R = q.normalized().toRotationMatrix();
  return true;
}

// What a PCD's header says, as far as it matters here.
struct PcdHeader {
  std::size_t points = 0;
  std::size_t stride = 0;  ///< bytes of a point
  std::size_t data = 0;    ///< where the points begin
};

std::optional<PcdHeader> parse_pcd_header(std::string_view bytes) {
  PcdHeader header;
  std::vector<std::size_t> sizes;
  bool xyz = false;
  std::size_t begin = 0;
  while (begin < bytes.size()) {
    const std::size_t end = bytes.find('\n', begin);
    if (end == std::string_view::npos) return std::nullopt;
    std::istringstream line{std::string(bytes.substr(begin, end - begin))};
    begin = end + 1;
    std::string key, first;
    line >> key;
    if (key == "FIELDS") {
      std::string x, y, z;
      line >> x >> y >> z;
      xyz = x == "x" && y == "y" && z == "z";
    } else if (key == "SIZE") {
      for (std::size_t size = 0; line >> size;) header.stride += size;
    } else if (key == "POINTS") {
      line >> header.points;
    } else if (key == "DATA") {
      line >> first;
      header.data = begin;
      return xyz && first == "binary" && header.stride >= 12 ? std::optional(header) : std::nullopt;
    }
  }
  return std::nullopt;
}

double yaml_number(const std::string& text, const std::string& key, std::size_t index) {
  const std::size_t at = text.find(key + ":");
  if (at == std::string::npos) return 0;
  std::string_view rest = std::string_view(text).substr(at + key.size() + 1);
  rest = rest.substr(0, rest.find('\n'));
  double value = 0;
  for (std::size_t i = 0; i <= index; ++i) {
    rest.remove_prefix(std::min(rest.find_first_of("-.0123456789"), rest.size()));
    if (!next_number(rest, value)) return 0;
  }
  return value;
}

}  // namespace

std::vector<TimedPose> read_tum(const std::filesystem::path& file) {
  std::vector<TimedPose> poses;
  const auto bytes = read_bytes(file);
  if (!bytes) return poses;
  const std::string_view text = *bytes;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = text.find('\n', begin);
    if (end == std::string_view::npos) break;  // cut short
    const std::string_view line = text.substr(begin, end - begin);
    begin = end + 1;
    TimedPose pose;
    if (!line.empty() && line.front() != '#' && parse_pose(line, pose)) poses.push_back(pose);
  }
  return poses;
}

RecordedCloud read_cloud(const std::filesystem::path& file, std::size_t max_points) {
  RecordedCloud cloud;
  const auto bytes = read_bytes(file);
  if (!bytes) return cloud;
  const auto header = parse_pcd_header(*bytes);
  if (!header) return cloud;
  cloud.total = std::min(header->points, (bytes->size() - header->data) / header->stride);
  const std::size_t kept = std::min(cloud.total, max_points);
  cloud.points_O.resize(kept);
  for (std::size_t i = 0; i < kept; ++i) {
    const std::size_t index = i * cloud.total / kept;
    std::memcpy(cloud.points_O[i].data(), bytes->data() + header->data + index * header->stride,
                3 * sizeof(float));
  }
  return cloud;
}

std::optional<RecordedMap> read_map(const std::filesystem::path& folder) {
  const auto yaml = read_bytes(folder / "map2d.yaml");
  const auto bytes = read_bytes(folder / "map2d.pgm");
  if (!yaml || !bytes) return std::nullopt;
  RecordedMap map;
  map.resolution_m = yaml_number(*yaml, "resolution", 0);
  map.origin_x_m = yaml_number(*yaml, "origin", 0);
  map.origin_y_m = yaml_number(*yaml, "origin", 1);
  std::istringstream stream(*bytes);
  std::string magic;
  int greatest = 0;
  stream >> magic;
  while ((stream >> std::ws).peek() == '#') stream.ignore(1 << 20, '\n');
  stream >> map.width >> map.height >> greatest;
  stream.get();
  if (!stream || magic != "P5" || greatest != 255 || map.width <= 0 || map.height <= 0 ||
      map.width > 1 << 15 || map.height > 1 << 15 || !(map.resolution_m > 0)) {
    return std::nullopt;
  }
  map.cells.resize(static_cast<std::size_t>(map.width) * static_cast<std::size_t>(map.height));
  stream.read(reinterpret_cast<char*>(map.cells.data()),
              static_cast<std::streamsize>(map.cells.size()));
  if (static_cast<std::size_t>(stream.gcount()) != map.cells.size()) return std::nullopt;
  return map;
}

double RunRecord::duration_s() const {
  double end = 0;
  if (!truth.empty()) end = std::max(end, truth.back().time_s);
  for (const double t : events.numbers("time_s")) end = std::max(end, t);
  return end;
}

bool is_run_folder(const std::filesystem::path& folder) {
  return std::filesystem::exists(folder / "resolved.yaml") ||
         std::filesystem::exists(folder / "truth.tum");
}

std::optional<nlohmann::ordered_json> read_summary(const std::filesystem::path& folder) {
  const auto bytes = read_bytes(folder / "summary.json");
  if (!bytes) return std::nullopt;
  auto json = parse_object(*bytes);
  if (!json.is_object()) return std::nullopt;
  return json;
}

RunRecord read_run(const std::filesystem::path& folder, std::size_t max_cloud_points) {
  if (!is_run_folder(folder)) {
    throw ConfigError(folder.string() +
                      ":1: holds neither resolved.yaml nor truth.tum, expected a run folder");
  }
  RunRecord run;
  run.folder = folder;
  run.summary = read_summary(folder);
  run.resolved_yaml = read_bytes(folder / "resolved.yaml").value_or("");
  run.truth = read_tum(folder / "truth.tum");
  run.estimate = read_tum(folder / "estimate.tum");
  run.events = read_table(folder / "events.csv");
  run.flight = read_table(folder / "flight.csv");
  run.coverage = read_table(folder / "coverage.csv");
  run.decisions = read_table(folder / "decisions.csv");
  run.timing = read_table(folder / "timing.csv");
  run.cloud_growth = read_table(folder / "cloud_growth.csv");
  run.cloud = read_cloud(folder / "cloud.pcd", max_cloud_points);
  run.map = read_map(folder);
  for (const char* name : {"summary.json", "resolved.yaml", "truth.tum", "estimate.tum",
                           "events.csv", "flight.csv", "coverage.csv", "decisions.csv",
                           "timing.csv", "cloud.pcd", "cloud_growth.csv", "map2d.pgm"}) {
    if (!std::filesystem::exists(folder / name)) run.missing.emplace_back(name);
  }
  return run;
}

}  // namespace arex::sim
