#include "run/summary.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>

#include "scoring/figures.h"

namespace arex::sim {
namespace {

using nlohmann::ordered_json;

std::set<std::string> with_value(const ordered_json& summary) {
  std::set<std::string> keys;
  for (const auto& [key, text] : flatten(summary)) {
    if (!text.empty()) keys.insert(key);
  }
  return keys;
}

// A run that never took off: counts are counts, everything else was not measured.
TEST(Summary, HasNoFigureWhereThereWasNothingToMeasure) {
  FlightResult result;
  result.outcome = Outcome::kTimedOut;
  result.reason = "no odometry";
  const std::set<std::string> expected{
      "outcome",         "reason",           "scenario",        "seed",
      "sim_time_s",      "wall_time_s",      "cpu_time_s",      "real_time_factor",
      "trajectory_hash", "sensor_hash",      "distance_m",      "targets.count",
      "odometry.source", "collisions",       "battery.used_wh", "battery.remaining_fraction",
      "build.version",   "build.compiler",   "faults.events",   "yaw.spins",
      "yaw.turned_rad",  "yaw.fastest_radps"};
  result.trajectory_hash = result.sensor_hash = "0";
  Scenario scenario;
  scenario.name = "s";
  EXPECT_EQ(with_value(summarise(scenario, result, {1, 1})), expected);

  // Scorers that ran and found nothing to score.
  result.map.emplace();
  result.coverage.emplace();
  result.flight.thin.emplace();
  result.plans.plans = 1;
  result.timing = {timing_row("replan", std::vector<float>())};
  std::set<std::string> counts{"map.points",
                               "map.scored",
                               "map.foliage",
                               "coverage.surface_samples",
                               "coverage.reachable_area_m2",
                               "thin.branches",
                               "thin.seen_in_time",
                               "planner.replans",
                               "planner.failures",
                               "planner.retimed",
                               "planner.slowed",
                               "planner.emergency_stops"};
  for (std::size_t stage = 1; stage < kPlanStageNames.size(); ++stage) {
    counts.insert("planner.stages." + std::string(kPlanStageNames[stage]));
  }
  counts.insert(expected.begin(), expected.end());
  EXPECT_EQ(with_value(summarise(scenario, result, {1, 1})), counts);
}

// What was possible is said of every exploration; how near the flight came to it, of one that
// succeeded.
TEST(Summary, OnlyAnExplorationThatSucceededHasARatio) {
  FlightResult result;
  result.duration = 30 * kNanosecondsPerSecond;
  result.flight.distance_m = 100;
  result.tour.emplace();
  result.tour->path_m = 40;
  result.tour->time_s = 20;
  result.complexity.emplace();
  result.complexity->mean_free_path_m = 12;
  result.timing = {timing_row("exploration", std::vector<float>{0.5F})};
  for (const Outcome outcome : {Outcome::kSucceeded, Outcome::kCollided, Outcome::kStuck}) {
    result.outcome = outcome;
    const ordered_json summary = summarise({}, result, {1, 1});
    const bool succeeded = outcome == Outcome::kSucceeded;
    EXPECT_EQ(summary["tour"]["path_ratio"], succeeded ? ordered_json(2.5) : ordered_json());
    EXPECT_EQ(summary["tour"]["time_ratio"], succeeded ? ordered_json(1.5) : ordered_json());
    EXPECT_EQ(summary["tour"]["path_m"], 40.0);
    EXPECT_EQ(summary["world"]["mean_free_path_m"], 12.0);
    EXPECT_EQ(summary["exploration"]["median_ms"], 500.0);
  }
  EXPECT_TRUE(depends_on_host("exploration.median_ms"));
  EXPECT_FALSE(depends_on_host("tour.time_s"));
}

TEST(Summary, HasEveryFigureOfTheListAndNoOther) {
  ordered_json summary = summarise({}, {}, {});
  const auto sections = [&](std::string_view key) { return key.substr(0, key.find('.')); };
  std::set<std::string_view> listed;
  for (const FigureInfo& figure : figure_list()) listed.insert(sections(figure.key));
  for (const auto& [key, value] : summary.items()) EXPECT_TRUE(listed.contains(key)) << key;
  EXPECT_EQ(summary.size(), listed.size());
}

TEST(Summary, AModuleThatNeverRanHasNoTime) {
  EXPECT_EQ(
      timing_csv({timing_row("depth", std::vector<float>()),
                  timing_row("imu", std::vector<float>{0.001F})}),
      "module,calls,median_ms,p99_ms,total_s\ndepth,0,,,0.0000\nimu,1,1.0000,1.0000,0.0010\n");
}

TEST(ExplorationLog, CountsHowEachTargetEnded) {
  ExplorationLog log;
  const auto decide = [&](DecisionKind kind, TargetEnd end) {
    Decision decision;
    decision.kind = kind;
    decision.previous_end = end;
    log.add(decision);
  };
  Figures none;
  log.add_figures(none);
  EXPECT_TRUE(none.json()["exploration"].is_null());  // never asked

  decide(DecisionKind::kNewTarget, TargetEnd::kNone);
  decide(DecisionKind::kKeepTarget, TargetEnd::kNone);
  decide(DecisionKind::kNewTarget, TargetEnd::kSeen);
  decide(DecisionKind::kNewTarget, TargetEnd::kUnreachable);
  decide(DecisionKind::kNewTarget, TargetEnd::kCutOff);
  decide(DecisionKind::kStop, TargetEnd::kReached);
  log.reached = 1;
  Figures figures;
  log.add_figures(figures);
  const ordered_json exploration = figures.json()["exploration"];
  EXPECT_EQ(exploration["decisions"], 6);
  EXPECT_EQ(exploration["targets_issued"], 4);
  EXPECT_EQ(exploration["targets"], 4);
  EXPECT_EQ(exploration["targets_seen"], 1);
  EXPECT_EQ(exploration["targets_given_up"], 2);
  EXPECT_EQ(exploration["targets_reached"], 1);
  EXPECT_TRUE(exploration["stop"].is_null());
}

}  // namespace
}  // namespace arex::sim
