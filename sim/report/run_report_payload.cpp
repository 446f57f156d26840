#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "report/payload.h"
#include "report/run_report.h"
#include "report/targets.h"

namespace arex::sim {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t kMaxRows = 6000;         // of a series: more than a screen has pixels
constexpr std::size_t kMaxCandidates = 30000;  // over all decisions
constexpr double kTrackPeriod = 0.1;           // s

/// What stands for several rows when a series is thinned.
enum class Keep { kMiddle, kLeast, kGreatest };

// Thins by runs of equal length, so that no spike of an error and no dip of a clearance is lost.
std::vector<double> thinned(const std::vector<double>& values, Keep keep) {
  const std::size_t run = values.size() / kMaxRows + 1;
  if (run == 1) return values;
  std::vector<double> kept;
  for (std::size_t begin = 0; begin < values.size(); begin += run) {
    const auto first = values.begin() + static_cast<std::ptrdiff_t>(begin);
    const auto last =
        values.begin() + static_cast<std::ptrdiff_t>(std::min(begin + run, values.size()));
    // What is missing is neither the least nor the greatest of those beside it.
    const auto order = [keep](double a, double b) {
      if (std::isnan(a) || std::isnan(b))
        return keep == Keep::kLeast ? std::isnan(b) && !std::isnan(a)
                                    : std::isnan(a) && !std::isnan(b);
      return std::abs(a) < std::abs(b);
    };
    switch (keep) {
      case Keep::kMiddle:
        kept.push_back(first[(last - first) / 2]);
        break;
      case Keep::kLeast:
        kept.push_back(*std::min_element(first, last, order));
        break;
      case Keep::kGreatest:
        kept.push_back(*std::max_element(first, last, order));
        break;
    }
  }
  return kept;
}

ordered_json flight_json(const Table& flight) {
  ordered_json json = ordered_json::object();
  if (flight.rows.empty()) return json;
  for (const auto& [name, keep] : {std::pair{"time_s", Keep::kMiddle},
                                   {"speed_mps", Keep::kGreatest},
                                   {"tracking_error_m", Keep::kGreatest},
                                   {"odometry_error_m", Keep::kGreatest},
                                   {"odometry_yaw_error_rad", Keep::kGreatest},
                                   {"clearance_m", Keep::kLeast},
                                   {"height_m", Keep::kMiddle},
                                   {"battery_power_w", Keep::kMiddle},
                                   {"battery_fraction", Keep::kMiddle}}) {
    if (flight.column(name)) json[name] = quantised(thinned(flight.numbers(name), keep));
  }
  return json;
}

ordered_json coverage_json(const Table& coverage) {
  ordered_json json = ordered_json::object();
  if (coverage.rows.empty()) return json;
  for (const char* name : {"time_s", "distance_m", "area_fraction", "surface_fraction"}) {
    if (!coverage.column(name)) return ordered_json::object();
    json[name] = quantised(thinned(coverage.numbers(name), Keep::kMiddle));
  }
  return json;
}

ordered_json track_json(const std::vector<TimedPose>& poses) {
  if (poses.empty()) return nullptr;
  std::vector<double> t, x, y, z, yaw;
  const double span = poses.back().time_s - poses.front().time_s;
  const double period = std::max(kTrackPeriod, span / 12000);
  double next = poses.front().time_s;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (poses[i].time_s < next - 1e-6 && i + 1 != poses.size()) continue;
    next = poses[i].time_s + period;
    t.push_back(poses[i].time_s);
    x.push_back(poses[i].X.p.x());
    y.push_back(poses[i].X.p.y());
    z.push_back(poses[i].X.p.z());
    yaw.push_back(so3::yaw(poses[i].X.R));
  }
  return {{"t", quantised(t)},
          {"x", quantised(x)},
          {"y", quantised(y)},
          {"z", quantised(z)},
          {"yaw", quantised(yaw)}};
}

// How many of the thinned points, which keep the order of first sight, were there at each moment.
ordered_json growth_json(const Table& growth, const RecordedCloud& cloud) {
  ordered_json times = ordered_json::array();
  ordered_json counts = ordered_json::array();
  const auto t = growth.numbers("time_s");
  const auto n = growth.numbers("points");
  const auto kept = static_cast<double>(cloud.points_O.size());
  for (std::size_t i = 0; cloud.total > 0 && i < std::min(t.size(), n.size()); ++i) {
    if (!std::isfinite(t[i]) || !std::isfinite(n[i])) continue;
    times.push_back(t[i]);
    // Thinned point k is point floor(k total / kept) of the file.
    counts.push_back(static_cast<std::size_t>(
        std::min(kept, std::ceil(n[i] * kept / static_cast<double>(cloud.total)))));
  }
  return {{"t", times}, {"count", counts}};
}

ordered_json cloud_json(const RunRecord& run) {
  const std::vector<Vec3f>& points = run.cloud.points_O;
  std::array<std::vector<float>, 3> axes;
  for (const Vec3f& p : points) {
    for (int axis = 0; axis < 3; ++axis) {
      axes[static_cast<std::size_t>(axis)].push_back(p.allFinite() ? p[axis] : 0);
    }
  }
  return {
      {"total", run.cloud.total},
      {"points", {{"x", quantised(axes[0])}, {"y", quantised(axes[1])}, {"z", quantised(axes[2])}}},
      {"growth", growth_json(run.cloud_growth, run.cloud)}};
}

ordered_json targets_json(const Table& events) {
  ordered_json targets = ordered_json::array();
  for (const RunTarget& target : run_targets(events)) {
    targets.push_back({{"t", target.time_s},
                       {"x", target.p_O.x()},
                       {"y", target.p_O.y()},
                       {"z", target.p_O.z()},
                       {"reached", target.reached}});
  }
  return targets;
}

// All candidates of every decision; where they are too many, the winners and those kept.
ordered_json decisions_json(const Table& decisions) {
  ordered_json times = ordered_json::array();
  ordered_json first = ordered_json::array();
  std::vector<double> x, y;
  std::string verdicts;
  const auto t = decisions.numbers("time_s");
  const auto sequence = decisions.numbers("decision");
  const auto all_x = decisions.numbers("x_m");
  const auto all_y = decisions.numbers("y_m");
  const bool crowded = decisions.rows.size() > kMaxCandidates;
  double last = -1;
  for (std::size_t i = 0; i < decisions.rows.size(); ++i) {
    if (!std::isfinite(all_x[i]) || !std::isfinite(all_y[i])) continue;
    const bool winner = decisions.text(i, "winner") == "1";
    const bool kept = decisions.text(i, "verdict") == "kept";
    if (crowded && !winner && (!kept || x.size() >= kMaxCandidates)) continue;
    if (sequence[i] != last) {
      last = sequence[i];
      times.push_back(t[i]);
      first.push_back(x.size());
    }
    x.push_back(all_x[i]);
    y.push_back(all_y[i]);
    verdicts += winner ? 'w' : kept ? 'k' : '-';
  }
  first.push_back(x.size());
  return {{"t", times},
          {"first", first},
          {"x", quantised(x)},
          {"y", quantised(y)},
          {"verdict", verdicts}};
}

}  // namespace

ordered_json run_payload(const RunRecord& run) {
  return {{"kind", "run"},
          {"duration_s", run.duration_s()},
          {"flight", flight_json(run.flight)},
          {"coverage", coverage_json(run.coverage)},
          {"tracks", {{"truth", track_json(run.truth)}, {"estimate", track_json(run.estimate)}}},
          {"cloud", cloud_json(run)},
          {"targets", targets_json(run.events)},
          {"decisions", decisions_json(run.decisions)}};
}

}  // namespace arex::sim
