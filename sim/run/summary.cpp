#include "run/summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#ifndef AREX_VERSION
#error "AREX_VERSION comes from CMake"
#endif

namespace arex::sim {
namespace {

using nlohmann::ordered_json;

// Rows of timing.csv.
constexpr const char* kPlannerModule = "replan";
constexpr const char* kExplorerModule = "exploration";

std::vector<Figures::Item> targets_of(const FlightResult& result) {
  std::vector<Figures::Item> targets;
  for (std::size_t i = 0; i < result.targets.size(); ++i) {
    const MissionTarget& target = result.targets[i];
    targets.push_back({{"x", target.p_O.x()},
                       {"y", target.p_O.y()},
                       {"z", target.p_O.z()},
                       {"time_s", to_seconds(target.reached)},
                       {"miss_m", result.flight.target_miss_m[i]}});
  }
  return targets;
}

void add_run(const Scenario& scenario, const FlightResult& result, const HostTime& host,
             Figures& figures) {
  const double sim_time = to_seconds(result.duration);
  figures.set("outcome", kOutcomeNames[static_cast<std::size_t>(result.outcome)]);
  figures.set("reason", result.reason);
  figures.set("scenario", scenario.name);
  figures.set("seed", scenario.config.seed);
  figures.set("sim_time_s", sim_time);
  figures.set("wall_time_s", host.wall_s);
  figures.set("cpu_time_s", host.cpu_s);
  figures.set("real_time_factor", sim_time / host.wall_s);
  figures.set("trajectory_hash", result.trajectory_hash);
  figures.set("sensor_hash", result.sensor_hash);
  for (const auto& [name, hash] : result.device_hashes) figures.set("device_hashes." + name, hash);
  if (result.lidar_firings > 0) {
    figures.set("lidar.firings", result.lidar_firings);
    figures.set("lidar.misses", result.lidar_misses);
  }
  figures.set("targets", targets_of(result));
  figures.set("collisions", result.collisions);
  figures.set("battery.used_wh", result.battery.used_wh);
  figures.set("battery.remaining_fraction", result.battery.state_of_charge);
  if (!result.renderer.empty()) figures.set("renderer", result.renderer);  // a frame was read
  figures.set("build.version", build_version());
  figures.set("build.compiler", build_compiler());
}

void add_flight(const FlightScore& flight, Figures& figures) {
  figures.set("distance_m", flight.distance_m);
  figures.set("yaw.turned_rad", flight.yaw.turned_rad());
  figures.set("yaw.fastest_radps", flight.yaw.fastest_radps());
  figures.set("yaw.spins", flight.yaw.spins());
  figures.set("tracking.rmse_m", flight.tracking_rmse_m);
  figures.set("tracking.landing_error_m", flight.landing_error_m);
  add_figures(flight.odometry, "odometry", figures);
  if (!flight.poses.empty()) figures.set("odometry.lost_s", flight.odometry_lost_s);
  add_figures(flight.tally, "odometry", figures);
  for (const auto& [name, source] : flight.others) {
    add_figures(source.score, "odometries." + name, figures);
    figures.set("odometries." + name + ".lost_s", source.lost_s);
    add_figures(source.tally, "odometries." + name, figures);
  }
  add_figures(flight.clearance, figures);
  if (flight.landing) add_figures(*flight.landing, figures);
  if (flight.thin) add_figures(*flight.thin, figures);
}

void add_timing(const FlightResult& result, const std::string& module, const std::string& section,
                Figures& figures) {
  for (const TimingRow& row : result.timing) {
    if (row.module != module) continue;
    figures.set(section + ".median_ms", row.median_ms);
    figures.set(section + ".p99_ms", row.p99_ms);
  }
}

void add_planner(const FlightResult& result, Figures& figures) {
  if (result.plans.plans == 0) return;
  figures.set("planner.replans", result.plans.plans);
  figures.set("planner.failures", result.plans.failures);
  figures.set("planner.retimed", result.plans.retimed);
  figures.set("planner.slowed", result.plans.slowed);
  figures.set("planner.emergency_stops", result.plans.emergency_stops);
  figures.set("planner.own_cell_blocked_fraction", result.flight.own_cell_blocked_fraction);
  for (std::size_t stage = 1; stage < kPlanStageNames.size(); ++stage) {
    figures.set("planner.stages." + std::string(kPlanStageNames[stage]),
                result.plans.stages[stage]);
  }
  add_timing(result, kPlannerModule, "planner", figures);
}

// Of explorations: what was possible, and how near the flight came to it. One that failed has no
// ratio: it is short because it ended early.
void add_tour(const FlightResult& result, Figures& figures) {
  if (result.complexity) add_figures(*result.complexity, figures);
  if (!result.tour) return;
  const bool succeeded = result.outcome == Outcome::kSucceeded;
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  add_figures(*result.tour, succeeded ? result.flight.distance_m : kNone,
              succeeded ? to_seconds(result.duration) : kNone, figures);
}

void flatten_into(const ordered_json& value, const std::string& key,
                  std::vector<std::pair<std::string, std::string>>& fields) {
  if (value.is_object()) {
    const std::string prefix = key.empty() ? "" : key + ".";
    for (const auto& [name, child] : value.items()) flatten_into(child, prefix + name, fields);
  } else if (value.is_array()) {
    fields.emplace_back(key + ".count", std::to_string(value.size()));
  } else if (value.is_null()) {
    fields.emplace_back(key, "");
  } else {
    fields.emplace_back(key, value.is_string() ? value.get<std::string>() : value.dump());
  }
}

}  // namespace

ordered_json summarise(const Scenario& scenario, const FlightResult& result, const HostTime& host) {
  Figures figures;
  add_run(scenario, result, host, figures);
  add_flight(result.flight, figures);
  add_planner(result, figures);
  figures.set("odometry.source", scenario.config.stack.odometry.source);
  if (result.map) add_figures(*result.map, figures);
  if (result.coverage) add_figures(*result.coverage, figures);
  if (result.semantic) add_figures(*result.semantic, figures);
  result.exploration.add_figures(figures);
  result.faults.add_figures(figures);
  add_timing(result, kExplorerModule, "exploration", figures);
  add_tour(result, figures);
  return figures.json();
}

std::string build_version() { return AREX_VERSION; }

std::string build_compiler() { return "g++ " __VERSION__; }

std::string json_text(const ordered_json& json) {
  return json.dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

std::vector<std::pair<std::string, std::string>> flatten(const ordered_json& summary) {
  std::vector<std::pair<std::string, std::string>> fields;
  flatten_into(summary, "", fields);
  return fields;
}

bool depends_on_host(std::string_view column) {
  const FigureInfo* figure = find_figure(column);
  return figure && figure->of_host;
}

std::string odometry_error_csv(const std::vector<PosePair>& poses) {
  // At 20 Hz; aligned at the first pose.
  constexpr std::size_t kStride = 10;
  const Pose X_WO = align_at_start(poses);
  std::string text = csv_header("odometry_error.csv");
  for (std::size_t i = 0; i < poses.size(); i += kStride) {
    const Pose aligned = X_WO * poses[i].X_OB;
    const Vec3 p = aligned.p - poses[i].X_WB.p;
    const Vec3 r = so3::Log(aligned.R * poses[i].X_WB.R.transpose());
    text += fmt::format("{:.3f},{:.5f},{:.5f},{:.5f},{:.6f},{:.6f},{:.6f}\n",
                        to_seconds(poses[i].stamp), p.x(), p.y(), p.z(), r.x(), r.y(), r.z());
  }
  return text;
}

std::string timing_csv(const std::vector<TimingRow>& rows) {
  std::string text = csv_header("timing.csv");
  for (const TimingRow& row : rows) {
    text += row.module + "," + std::to_string(row.calls) + "," + csv_number(row.median_ms, 4) +
            "," + csv_number(row.p99_ms, 4) + "," + csv_number(row.total_s, 4) + "\n";
  }
  return text;
}

}  // namespace arex::sim
