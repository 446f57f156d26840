#include "run/scenario.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "config/registry.h"
#include "run/moved_keys.h"

namespace arex::sim {
namespace {

/// Where the file or an option gives a point of a list of the mission.
std::string where_given(const ConfigNode& source, const std::string& list, std::size_t index) {
  const ConfigNode* mission = source.find("mission");
  const ConfigNode* points = mission ? mission->find(list) : nullptr;
  if (points && index < points->items.size()) return points->items[index].where;
  return points ? points->where : source.where;
}

/// Why nobody can fly to a point of O; empty: nothing speaks against it so far.
std::string fault_of(const Vec3& p_O, const worlds::World& world) {
  const Vec3 p_W = start_pose(world) * p_O;
  const Vec2 beyond =
      (p_W - world.bounds.high).head<2>().cwiseMax((world.bounds.low - p_W).head<2>());
  if (beyond.maxCoeff() > 0) {
    return fmt::format("lies {:.2f} m outside the world", beyond.maxCoeff());
  }
  const bool has_terrain = world.terrain.columns > 0;
  const double ground = has_terrain ? world.terrain.at(p_W.x(), p_W.y()) : world.bounds.low.z();
  if (p_W.z() >= ground) return {};
  return fmt::format("lies {:.2f} m below the ground", ground - p_W.z());
}

void check_points(const Scenario& scenario, const worlds::World& world, const std::string& list,
                  const std::vector<Vec3>& points) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::string fault = fault_of(points[i], world);
    if (fault.empty()) continue;
    throw ConfigError(
        fmt::format("{}: point {} of mission.{} {}, expected a place above the ground of the world",
                    where_given(scenario.source, list, i), i + 1, list, fault));
  }
}

/// That the points which the mission will be sent to lie in the world.
void check_way(const Scenario& scenario, const worlds::World& world) {
  const MissionConfig& mission = scenario.config.stack.mission;
  using Kind = MissionConfig::Kind;
  if (mission.kind == Kind::kWaypoints || mission.kind == Kind::kGoals) {
    check_points(scenario, world, "waypoints_m", mission.waypoints_m);
  } else if (mission.kind == Kind::kExplore) {
    check_points(scenario, world, "entry_m", mission.entry_m);
  }
}

/// Whether the vehicle has room where it begins to explore; the score's flood starts there.
bool has_room_to_explore_from(const worlds::World& world, const ScoredRegion& region,
                              const ReachableSpaceConfig& config) {
  const Vec2 p = region.start_O.head<2>(), around(1, 1);
  ScoredRegion nearby = region;
  nearby.bounds = {p - around, p + around, {}};
  try {
    static_cast<void>(
        find_reachable_space(world, start_pose(world), nearby, load_airframe().radius_m, config));
  } catch (const std::invalid_argument&) {
    return false;
  }
  return true;
}

/// What `build` gives; what it refuses is said with the place where the world was given.
auto at_world(const ConfigNode& source, const auto& build) {
  try {
    return build();
  } catch (const ConfigError& error) {
    const ConfigNode* node = source.find("world");
    throw ConfigError(last_given(node ? *node : source) + ": " + error.what());
  }
}

/// An absolute name for what `node` names.
std::string resolved_path(const ConfigNode& node, const std::string& path) {
  const bool from_command_line = node.where.starts_with("--");
  const std::filesystem::path file = node.where.substr(0, node.where.rfind(':'));
  const std::filesystem::path folder =
      from_command_line ? std::filesystem::path() : file.parent_path();
  return std::filesystem::absolute(folder / path).lexically_normal().string();
}

}  // namespace

void resolve_paths(const ConfigNode& node, worlds::WorldConfig& world) {
  if (world.kind != worlds::WorldKind::kFile) return;
  const ConfigNode* file = node.find("file");
  if (file == nullptr) return;
  if (const ConfigNode* path = file->find("path")) {
    world.file.path = resolved_path(*path, world.file.path);
  }
  const ConfigNode* folders = file->find("model_paths");
  for (std::size_t i = 0; folders && i < folders->items.size(); ++i) {
    std::string& folder = world.file.model_paths[i];
    folder = resolved_path(folders->items[i], folder);
  }
}

Eigen::AlignedBox2d ScenarioConfig::flown_area() const {
  Eigen::AlignedBox2d area(Vec2(0, 0));
  const MissionConfig& mission = stack.mission;
  const bool explores = mission.kind == MissionConfig::Kind::kExplore;
  if (explores) area.extend(stack.exploration.explorer.bounds.extent());
  for (const Vec3& p : explores ? mission.entry_m : mission.waypoints_m) area.extend(p.head<2>());
  for (const OperatorOrder& order : commands) {
    if (order.what == OperatorCommand::Kind::kGoTo) area.extend(order.goal_m.head<2>());
  }
  return area;
}

double ScenarioConfig::mapped_frames_hz() const {
  double frames = lidar.enabled ? lidar.model.rate_hz : 0;
  const auto depth_frames = [&](const DepthConfig& camera) {
    return stack.mapping.local.use_depth
               ? std::min<double>(camera.model.rate_hz, stack.mapping.depth_rate_hz)
               : 0;
  };
  frames += depth_frames(depth);
  for (const auto& [name, device] : devices) {
    if (device.type == "mid360") frames += read_over(lidar, device.own).model.rate_hz;
    if (device.type == "d430") frames += depth_frames(read_over(depth, device.own));
  }
  return frames;
}

ScoredRegion ScenarioConfig::scored_region() const {
  return {stack.exploration.explorer.bounds, scoring.low_m, scoring.high_m, stack.explored_from()};
}

std::string Scenario::resolved_yaml() const { return write_yaml(list_parameters(config)); }

std::shared_ptr<const worlds::FileWorld> Scenario::read_file_world() const {
  if (file_world) return file_world;
  return std::make_shared<worlds::FileWorld>(at_world(source, [&] {
    return worlds::load_file_world(config.world.file, load_airframe().radius_m);
  }));
}

worlds::World Scenario::build_world() const {
  worlds::World world;
  if (file_world) {
    world = file_world->world;
  } else {
    world = at_world(source, [&] {
      return worlds::build_world(config.world, config.seed, load_airframe().radius_m,
                                 config.flown_area());
    });
  }
  check_way(*this, world);
  const bool explores = config.stack.mission.kind == MissionConfig::Kind::kExplore;
  if (explores &&
      !has_room_to_explore_from(world, scored_region(), config.scoring.coverage.space)) {
    const std::string rule =
        "mission.entry_m to end, or without it the start to stand, where the vehicle has room "
        "between scoring.low_m and scoring.high_m";
    config_detail::fail(config_detail::locate_rule(source, rule), "expected " + rule);
  }
  return world;
}

Pose start_pose(const worlds::World& world) {
  static const double standing_m = load_airframe().standing_height_m;
  return world.X_WS * Pose{Mat3::Identity(), {0, 0, standing_m}};
}

namespace {

// What a pilot would read off the battery's label. A scenario may say otherwise.
void set_believed_battery(const BatteryConfig& battery, ConsumptionConfig& believed) {
  believed.full_v = battery.cells * battery.cell_full_v;
  believed.middle_v = battery.cells * battery.cell_middle_v;
  believed.empty_v = battery.cells * battery.cell_empty_v;
  believed.middle_charge = battery.middle_charge;
  believed.internal_resistance = battery.resistance_ohm;
  believed.capacity_wh = 0.5 * battery.capacity_ah *
                         ((believed.empty_v + believed.middle_v) * believed.middle_charge +
                          (believed.middle_v + believed.full_v) * (1 - believed.middle_charge));
}

/// Fills in, before the scenario's own words are read again over it, what follows from them where
/// they say nothing: exploration bounds that end where the world does, the mapped box around them,
/// the scores of that region as the map sees it, and what the stack knows of its battery.
/// A file's world is explored as far as a vehicle gets.
void derive(ScenarioConfig asked, const worlds::FileWorld* file_world, ScenarioConfig& config) {
  if (asked.stack.mission.kind == MissionConfig::Kind::kExplore) {
    ExplorationBounds& bounds = asked.stack.exploration.explorer.bounds;
    if (file_world != nullptr) {
      const Eigen::AlignedBox2d reachable = worlds::extent_of(*file_world);
      bounds.low_m = reachable.min();
      bounds.high_m = reachable.max();
    } else if (const auto world = worlds::extent_of(asked.world)) {
      bounds.low_m = bounds.low_m.cwiseMax(world->min());
      bounds.high_m = bounds.high_m.cwiseMin(world->max());
    }
    config.stack.exploration.explorer.bounds = bounds;
  }
  set_believed_battery(asked.physics.battery, config.stack.exploration.explorer.consumption);
  set_mapped_box(asked.stack, config.stack.mapping.global);
  const GlobalMapConfig& map = asked.stack.mapping.global;
  config.scoring.low_m = std::max(config.scoring.low_m, map.low_m.z());
  config.scoring.high_m = std::min(config.scoring.high_m, map.high_m.z());
  CoverageConfig& coverage = config.scoring.coverage;
  coverage.band_above_terrain = map.band != BandReference::kAbsolute;
  coverage.band_low_m = map.band_low_m;
  coverage.band_high_m = map.band_high_m;
  coverage.visibility.range_m = asked.stack.mapping.cloud_range_m;
  config.scoring.tour.range_m = map.range_m;
  for (const auto& [name, device] : asked.devices) {
    config.stack.vehicle.mounts[name] = device.mount;
  }
}

/// The rule by which the explored region leaves the world; empty: none. Beyond the world's edge
/// nothing can become known.
std::string broken_world_rule(const ScenarioConfig& config) {
  if (config.stack.mission.kind != MissionConfig::Kind::kExplore) return "";
  const Vec2 rounding = Vec2::Constant(1e-6);
  const auto known = worlds::extent_of(config.world);
  if (!known) return "";  // nothing to see is beyond the edge of what was surveyed
  const Eigen::AlignedBox2d& world = *known;
  const Eigen::AlignedBox2d about(world.min() - rounding, world.max() + rounding);
  if (about.contains(config.stack.exploration.explorer.bounds.extent())) return "";
  return fmt::format(
      "exploration.bounds within the world, which reaches from [{:g}, {:g}] to [{:g}, {:g}]",
      world.min().x(), world.min().y(), world.max().x(), world.max().y());
}

/// The first rule that world, explored region, map and scores break together; empty: none.
std::string broken_region_rule(const ScenarioConfig& config) {
  if (std::string rule = broken_world_rule(config); !rule.empty()) return rule;
  if (std::string rule = config.stack.broken_region_rule(); !rule.empty()) return rule;
  if (config.stack.mission.kind != MissionConfig::Kind::kExplore) return "";
  const GlobalMapConfig& map = config.stack.mapping.global;
  const bool mapped =
      config.scoring.low_m >= map.low_m.z() && config.scoring.high_m <= map.high_m.z();
  return mapped ? "" : "scoring.low_m, scoring.high_m within the heights of mapping.global";
}

/// Whether the exploration's bounds follow from a file that has to be read first.
bool needs_file_to_bound(const ConfigNode& source, const ScenarioConfig& asked) {
  if (asked.world.kind != worlds::WorldKind::kFile) return false;
  if (asked.stack.mission.kind != MissionConfig::Kind::kExplore) return false;
  const ConfigNode* exploration = source.find("exploration");
  const ConfigNode* bounds = exploration ? exploration->find("bounds") : nullptr;
  return bounds == nullptr || !bounds->find("low_m") || !bounds->find("high_m");
}

void resolve_world(Scenario& scenario) {
  if (const ConfigNode* world = scenario.source.find("world")) {
    resolve_paths(*world, scenario.config.world);
  }
}

}  // namespace

Scenario make_scenario(const std::string& name, ConfigNode source) {
  Scenario scenario;
  scenario.name = name;
  scenario.source = std::move(source);
  refuse_moved_keys(scenario.source);
  load_plugins(scenario.source);
  ScenarioConfig asked;
  read_config(scenario.source, asked);
  if (needs_file_to_bound(scenario.source, asked)) {
    scenario.config.world = asked.world;
    resolve_world(scenario);
    scenario.file_world = scenario.read_file_world();
  }
  derive(std::move(asked), scenario.file_world.get(), scenario.config);
  read_config(scenario.source, scenario.config);
  check_modules(scenario.config.stack, scenario.source);
  resolve_world(scenario);
  if (const std::string rule = broken_region_rule(scenario.config); !rule.empty()) {
    config_detail::fail(config_detail::locate_rule(scenario.source, rule),
                        "out of range: expected " + rule);
  }
  return scenario;
}

void set_seed(ConfigNode& source, std::uint64_t seed, const std::string& where) {
  ConfigNode value;
  value.kind = ConfigNode::Kind::kScalar;
  value.where = where;
  value.scalar = std::to_string(seed);
  set_value(source, "seed", where, std::move(value));
}

Scenario load_scenario(const std::filesystem::path& file, const std::vector<std::string>& overrides,
                       std::optional<std::uint64_t> seed) {
  ConfigNode source = file.empty() ? parse_yaml("", "defaults") : load_yaml(file);
  if (const ConfigNode* base = source.find("base")) {
    throw ConfigError(base->where +
                      ": 'base' makes this a sweep, expected a scenario; `arex sweep " +
                      file.string() + " --dry-run` lists what it flies");
  }
  for (const std::string& assignment : overrides) apply_override(source, assignment);
  if (seed) set_seed(source, *seed, "--seed");
  return make_scenario(file.stem().string(), std::move(source));
}

}  // namespace arex::sim
