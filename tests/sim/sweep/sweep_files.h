#pragma once

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <array>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "support/process.h"

/// What the tests of a sweep's recovery write and read.
namespace arex::test {

/// 48 flights of 0.2 s without a LiDAR: a real run each, with a tenth of a second of work.
inline constexpr int kShortRuns = 48;

inline std::string short_sweep(const std::string& more = "") {
  return "base: " AREX_SOURCE_DIR "/scenarios/inflation.yaml\n" + std::string("set:\n") +
         "  mission.max_time_s: 0.2\n  lidar.enabled: false\n  odometry.source: mocap\n"
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

inline ProcessResult arex(const std::vector<std::string>& arguments) {
  return run_process(AREX_BINARY, arguments);
}

inline std::vector<std::string> sweep_arguments(const std::filesystem::path& file,
                                                const std::filesystem::path& out) {
  return {"sweep", file.string(), "--out", out.string(), "--jobs", "2"};
}

template <class Condition>
bool wait_until(const Condition& condition) {
  for (int i = 0; i < 6000; ++i) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}

/// What tells whether a finished run was touched again.
inline std::map<std::string, std::pair<ino_t, std::filesystem::file_time_type>> marks_of(
    const std::filesystem::path& out) {
  std::map<std::string, std::pair<ino_t, std::filesystem::file_time_type>> marks;
  for (const std::string& id : finished_runs(out)) {
    const std::filesystem::path file = out / "runs" / id / "summary.json";
    struct stat status {};
    stat(file.c_str(), &status);
    marks[id] = {status.st_ino, std::filesystem::last_write_time(file)};
  }
  return marks;
}

inline void expect_untouched(
    const std::map<std::string, std::pair<ino_t, std::filesystem::file_time_type>>& before,
    const std::filesystem::path& out) {
  auto after = marks_of(out);
  for (const auto& [id, mark] : before) EXPECT_EQ(after[id], mark) << id;
}

inline void expect_complete(const std::filesystem::path& out,
                            const std::filesystem::path& undisturbed) {
  EXPECT_EQ(finished_runs(out).size(), std::size_t{kShortRuns});
  EXPECT_EQ(invalid_runs(out), 0);
  EXPECT_EQ(read_text(out / "sweep.csv"), read_text(undisturbed / "sweep.csv"));
  int unlogged = 0;  // whose driver was killed between the rename and the log
  for (const auto& [id, events] : events_by_run(out)) {
    const auto finish = std::find(events.begin(), events.end(), "finish");
    if (finish == events.end()) {
      ++unlogged;
    } else {
      EXPECT_EQ(finish + 1, events.end()) << id << " was flown again";
    }
  }
  EXPECT_LE(unlogged, 2);
  for (const auto& entry : std::filesystem::directory_iterator(out / "runs")) {
    EXPECT_EQ(entry.path().filename().string().find('.'), std::string::npos) << entry.path();
  }
}

}  // namespace arex::test
