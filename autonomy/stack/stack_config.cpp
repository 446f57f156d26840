#include "stack/stack_config.h"

#include <algorithm>

namespace arex {
namespace {

constexpr double kMostMapped_m = 400;  // along an axis, as GlobalMapConfig's own rule

}  // namespace

StackConfig with_shared_values(StackConfig config) {
  const double inflation = config.planning.inflation_m;
  const double speed = config.planning.local.max_speed_mps;

  config.planning.local.vehicle_radius_m = config.vehicle.radius_m;
  config.planning.replan.degenerate_speed_mps = config.caution.degenerate_speed_fraction * speed;
  GuideConfig& guide = config.planning.guide;
  guide.obstacle_distance_m = inflation + guide.margin_m;
  guide.comfort_distance_m = std::max(guide.comfort_distance_m, guide.obstacle_distance_m);

  config.mapping.global.sensor = config.mapping.local.sensor;

  ExplorerConfig& explorer = config.exploration.explorer;
  explorer.space.travel_radius_m = inflation;
  explorer.viewpoint.clearance_m = inflation + explorer.viewpoint.clearance_margin_m;
  explorer.viewpoint.standoff_m = inflation + explorer.viewpoint.standoff_margin_m;
  explorer.stop.return_home = config.mission.land_at_start;
  explorer.stop.return_speed_mps = explorer.stop.return_speed_fraction * speed;
  return config;
}

void set_mapped_box(const StackConfig& asked, GlobalMapConfig& box) {
  Eigen::AlignedBox2d area = asked.exploration.explorer.bounds.extent();
  area.extend(Vec2(Vec2::Zero()));
  for (const auto* legs : {&asked.mission.entry_m, &asked.mission.waypoints_m}) {
    for (const Vec3& p : *legs) area.extend(Vec2(p.head<2>()));
  }
  const Vec2 margin = Vec2::Constant(asked.mapping.global.margin_m);
  box.low_m.head<2>() = area.min() - margin;
  box.high_m.head<2>() = area.max() + margin;
}

std::string StackConfig::broken_region_rule() const {
  const auto any = [](const auto& comparison) { return comparison.any(); };
  const GlobalMapConfig& box = mapping.global;
  const Vec2 low = box.low_m.head<2>(), high = box.high_m.head<2>();
  if (mapping.enabled && (high - low).maxCoeff() > kMostMapped_m) {
    return "mapping.global.high_m - low_m <= 400 m: around exploration bounds, entry and waypoints";
  }
  if (mission.kind != MissionConfig::Kind::kExplore) return "";
  const ExplorationBounds& bounds = exploration.explorer.bounds;
  const Vec2 start = explored_from().head<2>();
  const std::string from = " the place it explores from: the start, or the last of mission.entry_m";
  if (any(bounds.low_m.array() > start.array())) return "exploration.bounds.low_m <=" + from;
  if (any(bounds.high_m.array() < start.array())) return "exploration.bounds.high_m >=" + from;
  if (!bounds.is_near(start, 0)) return "exploration.bounds.polygon_m around" + from;
  // Obstacles just outside decide what can be flown to inside.
  const Vec2 rim = Vec2::Constant(planning.inflation_m);
  const Eigen::AlignedBox2d area = bounds.extent();
  if (any(low.array() > (area.min() - rim).array())) {
    return "mapping.global.low_m <= exploration.bounds.low_m - planning.inflation_m, or left out";
  }
  if (any(high.array() < (area.max() + rim).array())) {
    return "mapping.global.high_m >= exploration.bounds.high_m + planning.inflation_m, or left out";
  }
  return "";
}

}  // namespace arex
