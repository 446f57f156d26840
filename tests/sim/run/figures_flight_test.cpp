// The figures of real flights against the files beside them.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "report/table.h"
#include "run/recorder.h"
#include "run/simulation.h"
#include "run/summary.h"
#include "support/temporary_folder.h"

namespace arex::sim {
namespace {

using arex::test::read_text;
using arex::test::TemporaryFolder;
using arex::test::write_text;
using nlohmann::ordered_json;

constexpr const char* kHop = R"(
world: {kind: forest, forest: {size_m: [20, 20], tree_density_per_m2: 0.02}}
mapping: {enabled: false, use_depth: false}
odometry: {source: mocap}
mission: {kind: waypoints, waypoints_m: [[1, 0, 1.0]], takeoff_height_m: 1.0, max_time_s: 30}
)";

struct Flown {
  ordered_json summary;
  Table flight, events, decisions;
};

/// Flies a scenario and records it, to its end or until it is interrupted.
Flown fly(const Scenario& scenario,
          const std::function<bool(const Simulation&)>& interrupted = {}) {
  const TemporaryFolder folder;
  Recorder recorder(folder.path(), scenario.resolved_yaml());
  Simulation simulation(scenario, 2);
  simulation.record_to(recorder);
  while (simulation.tick()) {
    if (interrupted && interrupted(simulation)) simulation.interrupt("test");
  }
  const FlightResult result = simulation.finish();
  recorder.flush();
  return {summarise(scenario, result, {1, 1}), read_table(folder / "flight.csv"),
          read_table(folder / "events.csv"), read_table(folder / "decisions.csv")};
}

Scenario hop(const std::vector<std::string>& settings = {}) {
  const TemporaryFolder folder;
  write_text(folder / "hop.yaml", kHop);
  return load_scenario(folder / "hop.yaml", settings, std::nullopt);
}

double time_of(const Table& events, const std::string& kind, const std::string& detail) {
  for (std::size_t i = 0; i < events.rows.size(); ++i) {
    if (events.text(i, "kind") == kind && events.text(i, "detail") == detail) {
      return events.numbers("time_s")[i];
    }
  }
  return -1;
}

std::size_t count(const Table& table, const std::string& column, const std::string& value) {
  std::size_t found = 0;
  for (std::size_t i = 0; i < table.rows.size(); ++i) found += table.text(i, column) == value;
  return found;
}

TEST(FiguresOfAFlight, TheTrackingErrorStopsWhereItBeginsToLand) {
  const Flown flown = fly(hop());
  ASSERT_EQ(flown.summary["outcome"], "succeeded");
  EXPECT_LT(flown.summary["tracking"]["landing_error_m"].get<double>(), 0.3);
  const double off = time_of(flown.events, "mission_state", "takeoff");
  const double fly_at = time_of(flown.events, "mission_state", "fly");
  const double land_at = time_of(flown.events, "mission_state", "land");
  ASSERT_TRUE(0 < off && off < fly_at && fly_at < land_at);
  const auto time = flown.flight.numbers("time_s");
  const auto tracking = flown.flight.numbers("tracking_error_m");
  const auto clearance = flown.flight.numbers("clearance_m");
  double sum = 0, most = 0;
  int samples = 0;
  for (std::size_t i = 0; i < time.size(); ++i) {
    if (time[i] < off || time[i] > land_at + 0.05) {
      EXPECT_TRUE(std::isnan(tracking[i])) << time[i];
    }
    const bool en_route = time[i] > fly_at + 0.05 && time[i] < land_at - 0.05;
    EXPECT_TRUE(!en_route || clearance[i] > 0) << time[i];
    if (time[i] < fly_at - 0.05 || time[i] > land_at + 0.05) {
      EXPECT_TRUE(std::isnan(clearance[i])) << time[i];
    }
    if (std::isnan(tracking[i])) continue;
    sum += tracking[i] * tracking[i];
    most = std::max(most, tracking[i]);
    ++samples;
  }
  // The summary's is of the same rows, ten times as many.
  EXPECT_NEAR(flown.summary["tracking"]["rmse_m"].get<double>(), std::sqrt(sum / samples),
              0.1 * most);
}

TEST(FiguresOfAFlight, WhatNeverLandedHasNoLandingError) {
  // Still in the air, its target reached; and before anything happened.
  const Flown landing = fly(hop(), [](const Simulation& simulation) {
    return simulation.view().state == MissionState::kLand;
  });
  ASSERT_EQ(landing.summary["outcome"], "interrupted");
  ASSERT_EQ(landing.summary["targets"].size(), 1U);
  EXPECT_TRUE(landing.summary["tracking"]["landing_error_m"].is_null());
  EXPECT_TRUE(landing.summary["tracking"]["rmse_m"].is_number());
  const Flown standing =
      fly(hop(), [](const Simulation& simulation) { return to_seconds(simulation.now()) > 1; });
  EXPECT_TRUE(standing.summary["tracking"].is_null());
  EXPECT_TRUE(standing.summary["clearance"].is_null());
  EXPECT_TRUE(standing.summary["odometry"]["rpe_1m_m"].is_null());
  EXPECT_TRUE(standing.summary["exploration"].is_null());
  EXPECT_TRUE(standing.summary["device_hashes"]["depth"].is_null());
  EXPECT_TRUE(standing.summary["device_hashes"]["imu"].is_string());
  // Without a target there is no place to have missed.
  const Flown nowhere = fly(hop({"mission.waypoints_m=[]"}));
  ASSERT_EQ(nowhere.summary["outcome"], "succeeded");
  EXPECT_TRUE(nowhere.summary["tracking"]["landing_error_m"].is_null());
}

TEST(FiguresOfAFlight, TargetsAgreeWithDecisionsAndEvents) {
  const Flown flown =
      fly(load_scenario(AREX_SOURCE_DIR "/scenarios/forest_small.yaml", {}, std::nullopt));
  const ordered_json& exploration = flown.summary["exploration"];
  // A decision has a row for each candidate.
  std::set<std::string> issued, seen, given_up;
  struct Best {
    double revenue = -1e300;
    bool won = false;
  };
  std::map<std::string, Best> by_r;  // the candidate with the largest R = R_d + f_D
  for (std::size_t i = 0; i < flown.decisions.rows.size(); ++i) {
    const std::string number = flown.decisions.text(i, "decision");
    const std::string end = flown.decisions.text(i, "previous_end");
    if (flown.decisions.text(i, "kind") == "new_target") issued.insert(number);
    if (end == "seen") seen.insert(number);
    if (end == "unreachable" || end == "cut_off") given_up.insert(number);
    const std::string verdict = flown.decisions.text(i, "verdict");
    if (flown.decisions.text(i, "kind") == "new_target" &&
        flown.decisions.text(i, "revenue") != "") {
      const double r = std::stod(flown.decisions.text(i, "revenue")) +
                       std::stod(flown.decisions.text(i, "direction"));
      Best& best = by_r[number];
      if (r > best.revenue) best = {r, flown.decisions.text(i, "winner") == "1"};
    }
    if (verdict != "kept" && verdict != "off_direction") {
      EXPECT_EQ(flown.decisions.text(i, "revenue"), "") << number;
    }
  }
  EXPECT_GT(issued.size(), 3U);
  EXPECT_EQ(exploration["targets_issued"], issued.size());
  EXPECT_EQ(exploration["directed"],
            std::count_if(by_r.begin(), by_r.end(), [](const auto& d) { return !d.second.won; }));
  EXPECT_EQ(exploration["targets_seen"], seen.size());
  EXPECT_EQ(exploration["targets_given_up"], given_up.size());
  // It comes home: one more than it explored.
  const std::size_t reached = count(flown.events, "kind", "target_reached");
  EXPECT_EQ(exploration["targets_reached"], reached - 1);
  EXPECT_EQ(flown.summary["targets"].size(), reached);
  EXPECT_EQ(count(flown.events, "kind", "target_selected"), issued.size() + 1);
  // Each ended in one way, the last perhaps in none.
  const std::size_t ended = seen.size() + given_up.size() + reached - 1;
  EXPECT_TRUE(ended == issued.size() || ended + 1 == issued.size()) << ended;
}

// What a run and a sweep leave is all explained.
TEST(HelpFigures, NamesEveryFieldAndEveryColumn) {
  const TemporaryFolder folder;
  write_text(folder / "hop.yaml", kHop);
  const std::string run = "cd " + folder.path().string() + " && " AREX_BINARY " ";
  ASSERT_EQ(std::system((run + "run hop.yaml --set mission.max_time_s=4 --out run --quiet "
                               "--no-report > run.txt 2>&1")
                            .c_str()) >>
                8,
            1);
  ASSERT_EQ(std::system((run + "help figures > help.txt").c_str()), 0);
  std::istringstream help(read_text(folder / "help.txt"));
  std::set<std::string> words;
  for (std::string word; help >> word;) words.insert(word);
  const auto summary = ordered_json::parse(read_text(folder / "run/summary.json"));
  for (const auto& [key, text] : flatten(summary)) {
    EXPECT_TRUE(text.empty() || words.contains(key)) << key;
  }
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder / "run")) {
    if (entry.path().extension() != ".csv") continue;
    ++files;
    EXPECT_TRUE(words.contains(entry.path().filename())) << entry.path();
    const std::string text = read_text(entry.path());
    for (const std::string& column : parse_table(text).columns) {
      EXPECT_TRUE(words.contains(column)) << entry.path() << " " << column;
    }
  }
  EXPECT_GE(files, 4U);
}

}  // namespace
}  // namespace arex::sim
