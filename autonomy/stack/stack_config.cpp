#include "stack/stack_config.h"

#include <algorithm>

#include "config/nearest.h"
#include "stack/modules.h"

namespace arex {
namespace {

constexpr double kMostMapped_m = 400;  // along an axis, as GlobalMapConfig's own rule

/// A section without the keys that are not its module's own.
ConfigNode without(ConfigNode section, std::initializer_list<std::string_view> keys) {
  std::erase_if(section.entries, [&](const ConfigNode::Entry& entry) {
    return std::find(keys.begin(), keys.end(), entry.key) != keys.end();
  });
  return section;
}

/// Where a scenario says something, or else it itself.
std::string location_of(const ConfigNode& scenario, std::string_view section,
                        std::string_view key) {
  const ConfigNode* node = scenario.find(section);
  if (node) node = node->find(key);
  return node ? node->where : scenario.where;
}

/// A section's parameters, if a type of this name is registered anywhere.
std::optional<std::vector<ParameterInfo>> parameters_of(const std::string& name,
                                                        const ConfigNode& section) {
  const Modules& all = arex::modules();
  if (const auto* type = all.odometry.find(name)) return type->parameters(section);
  if (const auto* type = all.explorers.find(name)) return type->parameters(section);
  if (const auto* type = all.planners.find(name)) return type->parameters(section);
  return std::nullopt;
}

}  // namespace

void OdometrySection::read(std::string_view name, const ConfigNode& section) {
  const ConfigNode* named = section.find("type");
  if (named) config_detail::parse_scalar(*named, "type", type);
  if (type.empty()) {
    throw ConfigError(section.where + ": odometry '" + std::string(name) +
                      "' has no type, expected e.g. type: lidar_inertial");
  }
  if (const ConfigNode* latency = section.find("latency_s")) {
    config_detail::parse_scalar(*latency, "latency_s", latency_s.emplace());
    if (*latency_s < 0 || *latency_s > 60) {
      throw ConfigError(latency->where + ": out of range: expected 0 <= latency_s <= 60");
    }
  }
  own = without(section, {"type", "latency_s"});
  static_cast<void>(
      arex::modules().odometry.at(type, named ? named->where : section.where).parameters(own));
}

std::vector<ParameterInfo> OdometrySection::parameters() const {
  std::vector<ParameterInfo> all{{"type", type, "", "of the source"}};
  if (latency_s) {
    all.push_back({"latency_s", config_detail::format_scalar(*latency_s), "s",
                   "modelled compute time of an update"});
  }
  const auto more = arex::modules().odometry.at(type, own.where).parameters(own);
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

void ModuleSection::read(std::string_view given, const ConfigNode& section) {
  name = given;
  own = section;
  if (parameters_of(name, own)) return;
  std::vector<std::string> known = arex::modules().odometry.names();
  for (const auto& more : {arex::modules().explorers.names(), arex::modules().planners.names()}) {
    known.insert(known.end(), more.begin(), more.end());
  }
  throw ConfigError(section.where + ": unknown module '" + name + "'; did you mean '" +
                    nearest(name, known) + "'?");
}

std::vector<ParameterInfo> ModuleSection::parameters() const { return *parameters_of(name, own); }

void load_plugins(const ConfigNode& scenario) {
  const ConfigNode* plugins = scenario.find("plugins");
  if (plugins == nullptr) return;
  std::vector<std::string> files;
  config_detail::read_value(*plugins, "plugins", files);
  for (std::size_t i = 0; i < files.size(); ++i) load_plugin(files[i], plugins->items[i].where);
}

void check_modules(const StackConfig& config, const ConfigNode& scenario) {
  const Modules& all = arex::modules();
  if (!config.odometries.contains(config.odometry.source)) {
    static_cast<void>(
        all.odometry.at(config.odometry.source, location_of(scenario, "odometry", "source")));
  }
  for (const std::string& name : config.odometry.failover) {
    if (config.odometries.contains(name)) continue;
    static_cast<void>(all.odometry.at(name, location_of(scenario, "odometry", "failover")));
  }
  static_cast<void>(all.explorers.at(config.exploration.strategy,
                                     location_of(scenario, "exploration", "strategy")));
  static_cast<void>(
      all.planners.at(config.planning.strategy, location_of(scenario, "planning", "strategy")));
}

StackConfig with_shared_values(StackConfig config) {
  const double inflation = config.planning.inflation_m;
  const double speed = config.planning.local.max_speed_mps;

  config.planning.local.vehicle_radius_m = config.vehicle.radius_m;
  config.planning.replan.degenerate_speed_mps = config.caution.degenerate_speed_fraction * speed;
  GuideConfig& guide = config.planning.guide;
  guide.obstacle_distance_m = inflation + guide.margin_m;
  guide.comfort_distance_m = std::max(guide.comfort_distance_m, guide.obstacle_distance_m);
  guide.follow_ground = config.exploration.explorer.follow_ground &&
                        config.mapping.global.band == BandReference::kFloor;
  config.planning.replan.follow_ground = guide.follow_ground;

  config.mapping.global.sensor = config.mapping.local.sensor;

  ExplorerConfig& explorer = config.exploration.explorer;
  explorer.space.travel_radius_m = inflation;
  explorer.viewpoint.clearance_m = inflation + explorer.viewpoint.clearance_margin_m;
  explorer.viewpoint.standoff_m = inflation + explorer.viewpoint.standoff_margin_m;
  explorer.stop.return_home = config.mission.land_at_start == MissionConfig::LandAtStart::kTrue;
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

bool StackConfig::uses_odometry(std::string_view type) const {
  const bool takes_over = std::find(odometry.failover.begin(), odometry.failover.end(), type) !=
                          odometry.failover.end();
  return odometry.source == type || takes_over ||
         std::any_of(odometries.begin(), odometries.end(),
                     [&](const auto& further) { return further.second.type == type; });
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
