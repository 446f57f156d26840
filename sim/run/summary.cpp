#include "run/summary.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#ifndef AREX_VERSION
#error "AREX_VERSION comes from CMake"
#endif

namespace arex::sim {
namespace {

using nlohmann::ordered_json;

constexpr const char* kPlannerModule = "replan";  // its row of timing.csv

// Numbers for people: six significant decimals are more than any of these hold.
double rounded(double value) { return std::round(value * 1e6) / 1e6; }

ordered_json targets_json(const FlightResult& result) {
  ordered_json targets = ordered_json::array();
  for (std::size_t i = 0; i < result.targets.size(); ++i) {
    const MissionTarget& target = result.targets[i];
    targets.push_back({{"x", rounded(target.p_O.x())},
                       {"y", rounded(target.p_O.y())},
                       {"z", rounded(target.p_O.z())},
                       {"time_s", to_seconds(target.reached)},
                       {"miss_m", rounded(result.flight.target_miss_m[i])}});
  }
  return targets;
}

ordered_json odometry_json(const Scenario& scenario, const FlightResult& result) {
  const auto source = scenario.config.stack.odometry.source;
  const OdometryScore& score = result.flight.odometry;
  return {{"source", enum_names(source)[static_cast<std::size_t>(source)]},
          {"ate_rmse_m", rounded(score.ate_rmse_m)},
          {"ate_max_m", rounded(score.ate_max_m)},
          {"ate_se3_rmse_m", rounded(score.ate_se3_rmse_m)},
          {"yaw_error_max_deg", rounded(score.yaw_error_max_deg)},
          {"start_tilt_deg", rounded(score.start_tilt_deg)},
          {"rpe_1m_m", rounded(score.rpe_1m_m)},
          {"rpe_10m_m", rounded(score.rpe_10m_m)},
          {"lost_s", rounded(result.flight.odometry_lost_s)}};
}

ordered_json map_json(const std::optional<MapScore>& score) {
  if (!score) return nullptr;
  return {{"points", score->points},        {"median_m", rounded(score->median_m)},
          {"p95_m", rounded(score->p95_m)}, {"outlier_fraction", rounded(score->outlier_fraction)},
          {"scored", score->scored},        {"foliage", score->foliage}};
}

ordered_json or_null(double value) {
  return std::isfinite(value) ? ordered_json(rounded(value)) : ordered_json(nullptr);
}

ordered_json coverage_json(const std::optional<CoverageResult>& coverage) {
  if (!coverage) return nullptr;
  ordered_json classes = ordered_json::object();
  for (std::size_t i = 0; i < coverage->classes.size(); ++i) {
    const ClassCoverage& c = coverage->classes[i];
    if (c.visible == 0) continue;
    classes[std::string(worlds::kSurfaceClassNames[i])] =
        rounded(static_cast<double>(c.mapped) / static_cast<double>(c.visible));
  }
  return {{"area_fraction", rounded(coverage->area_fraction)},
          {"surface_fraction", rounded(coverage->surface_fraction)},
          {"volume_m3", rounded(coverage->volume_m3)},
          {"t50_s", or_null(coverage->t50_s)},
          {"t90_s", or_null(coverage->t90_s)},
          {"t95_s", or_null(coverage->t95_s)},
          {"revisit_ratio", rounded(coverage->revisit_ratio)},
          {"heading_change_radpm", rounded(coverage->heading_change_radpm)},
          {"reachable_area_m2", rounded(coverage->area_m2)},
          {"surface_samples", coverage->surface_samples},
          {"surface_fraction_by_class", classes}};
}

ordered_json exploration_json(const ExplorationLog& log) {
  if (log.decisions == 0) return nullptr;
  return {{"decisions", log.decisions},
          {"targets", log.targets},
          {"exhaustive", log.exhaustive},
          {"stop", kStopReasonNames[static_cast<std::size_t>(log.stop_reason)]},
          {"open_frontier_m2",
           log.open_frontier_m2 ? ordered_json(rounded(*log.open_frontier_m2)) : nullptr}};
}

ordered_json planner_json(const FlightResult& result) {
  if (result.plans == 0) return nullptr;
  for (const TimingRow& row : result.timing) {
    if (row.module != kPlannerModule) continue;
    return {{"replans", result.plans},
            {"median_ms", rounded(row.median_ms)},
            {"p99_ms", rounded(row.p99_ms)},
            {"failures", result.plan_failures}};
  }
  return nullptr;
}

ordered_json thin_json(const std::optional<ThinBranchScore>& score) {
  if (!score) return nullptr;
  const auto share = [&](int count) {
    return score->branches == 0
               ? ordered_json(nullptr)
               : ordered_json(rounded(static_cast<double>(count) / score->branches));
  };
  return {{"branches", score->branches},
          {"seen_in_time", score->seen_in_time},
          {"seen_in_time_fraction", share(score->seen_in_time)},
          {"in_grid_fraction", share(score->in_grid)}};
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
  const double sim_time = to_seconds(result.duration);
  ordered_json json;
  json["outcome"] = kOutcomeNames[static_cast<std::size_t>(result.outcome)];
  json["reason"] = result.reason;
  json["scenario"] = scenario.name;
  json["seed"] = scenario.config.seed;
  json["sim_time_s"] = sim_time;
  json["wall_time_s"] = rounded(host.wall_s);
  json["cpu_time_s"] = rounded(host.cpu_s);
  json["real_time_factor"] = rounded(sim_time / std::max(host.wall_s, 1e-9));
  json["trajectory_hash"] = result.trajectory_hash;
  json["sensor_hash"] = result.sensor_hash;
  json["distance_m"] = rounded(result.flight.distance_m);
  json["targets"] = targets_json(result);
  json["coverage"] = coverage_json(result.coverage);
  json["exploration"] = exploration_json(result.exploration);
  json["map"] = map_json(result.map);
  json["odometry"] = odometry_json(scenario, result);
  json["planner"] = planner_json(result);
  json["tracking"] = {{"rmse_m", rounded(result.flight.tracking_rmse_m)},
                      {"landing_error_m", rounded(result.flight.landing_error_m)}};
  json["clearance"] = {{"min_m", rounded(result.flight.clearance.min_m)},
                       {"p05_m", rounded(result.flight.clearance.p05_m)}};
  json["thin"] = thin_json(result.flight.thin);
  json["collisions"] = result.collisions;
  json["battery"] = {{"used_wh", rounded(result.battery.used_wh)},
                     {"remaining_fraction", rounded(result.battery.state_of_charge)}};
  json["renderer"] =
      result.renderer.empty() ? ordered_json(nullptr) : ordered_json(result.renderer);
  json["build"] = {{"version", AREX_VERSION}, {"compiler", "g++ " __VERSION__}};
  return json;
}

std::vector<std::pair<std::string, std::string>> flatten(const ordered_json& summary) {
  std::vector<std::pair<std::string, std::string>> fields;
  flatten_into(summary, "", fields);
  return fields;
}

ordered_json full_summary() {
  FlightResult result;
  result.map.emplace();
  result.coverage.emplace();
  for (ClassCoverage& c : result.coverage->classes) c.visible = 1;
  result.flight.thin.emplace();
  result.flight.thin->branches = 1;
  result.plans = 1;
  result.timing.push_back({kPlannerModule, 1, 0, 0, 0});
  result.renderer = "any";
  return summarise({}, result, {});
}

bool depends_on_host(std::string_view key) {
  static constexpr std::array<std::string_view, 5> kHostFields{
      "wall_time_s", "cpu_time_s", "real_time_factor", "planner.median_ms", "planner.p99_ms"};
  return std::find(kHostFields.begin(), kHostFields.end(), key) != kHostFields.end();
}

std::string odometry_error_csv(const std::vector<PosePair>& poses) {
  // At 20 Hz; aligned at the first pose.
  constexpr std::size_t kStride = 10;
  const Pose X_WO = align_at_start(poses);
  std::string text = "time_s,x_m,y_m,z_m,roll_rad,pitch_rad,yaw_rad\n";
  for (std::size_t i = 0; i < poses.size(); i += kStride) {
    const Pose aligned = X_WO * poses[i].X_OB;
    const Vec3 p = aligned.p - poses[i].X_WB.p;
    const Vec3 r = so3::Log(aligned.R * poses[i].X_WB.R.transpose());
    std::array<char, 160> line{};
    std::snprintf(line.data(), line.size(), "%.3f,%.5f,%.5f,%.5f,%.6f,%.6f,%.6f\n",
                  to_seconds(poses[i].stamp), p.x(), p.y(), p.z(), r.x(), r.y(), r.z());
    text += line.data();
  }
  return text;
}

std::string timing_csv(const std::vector<TimingRow>& rows) {
  std::string text = "module,calls,median_ms,p99_ms,total_s\n";
  for (const TimingRow& row : rows) {
    std::array<char, 160> line{};
    std::snprintf(line.data(), line.size(), "%s,%zu,%.4f,%.4f,%.4f\n", row.module.c_str(),
                  row.calls, row.median_ms, row.p99_ms, row.total_s);
    text += line.data();
  }
  return text;
}

}  // namespace arex::sim
