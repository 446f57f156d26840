#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "support/temporary_folder.h"

/// What the tests of a sweep's recovery write and read.
namespace arex::test {

/// 48 flights of 0.2 s without a LiDAR: a real run each, with a tenth of a second of work.
inline constexpr int kShortRuns = 48;

inline std::string short_sweep(const std::string& more = "") {
  return "base: " AREX_SOURCE_DIR "/scenarios/inflation.yaml\n" + std::string("set:\n") +
         "  mission.max_time_s: 0.2\n  devices.lidar: false\n  odometry.source: mocap\n"
         "  mapping.use_depth: false\n"
         "grid: {planning.inflation_m: [0.1, 0.3, 0.5, 0.75]}\n"
         "seeds: 1..12\n" +
         more;
}

inline std::vector<std::string> lines_of(const std::filesystem::path& file) {
  std::istringstream stream(read_text(file));
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// The runs that stand as finished: every folder under its plain id.
inline std::set<std::string> finished_runs(const std::filesystem::path& out) {
  std::set<std::string> ids;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(out / "runs", none)) {
    const std::string name = entry.path().filename().string();
    if (name.find('.') == std::string::npos) ids.insert(name);
  }
  return ids;
}

/// Those of them whose summary cannot be read: none, ever.
inline int invalid_runs(const std::filesystem::path& out) {
  int count = 0;
  for (const std::string& id : finished_runs(out)) {
    const auto summary =
        nlohmann::json::parse(read_text(out / "runs" / id / "summary.json"), nullptr, false);
    if (!summary.is_object() || summary.value("outcome", "") != "timed_out") ++count;
  }
  return count;
}

/// Events of log.csv by run: "start", "finish", "broken" ... in their order.
inline std::map<std::string, std::vector<std::string>> events_by_run(
    const std::filesystem::path& out) {
  std::map<std::string, std::vector<std::string>> events;
  for (const std::string& line : lines_of(out / "log.csv")) {
    std::istringstream cells(line);  // time,host,pid,event,run,attempt,detail
    std::array<std::string, 5> cell;
    for (std::string& text : cell) std::getline(cells, text, ',');
    if (cell[3] != "event") events[cell[4]].push_back(cell[3]);
  }
  return events;
}

}  // namespace arex::test
