#include "run/scenario.h"

namespace arex::sim {

std::string Scenario::resolved_yaml() const { return write_yaml(list_parameters(config)); }

worlds::World Scenario::build_world() const {
  try {
    return worlds::build_world(config.world, config.seed);
  } catch (const ConfigError& error) {
    const ConfigNode* world = source.find("world");
    throw ConfigError((world ? world->where : source.where) + ": " + error.what());
  }
}

Pose start_pose(const worlds::World& world, const VehicleConfig& vehicle) {
  return world.X_WS * Pose{Mat3::Identity(), {0, 0, vehicle.ground_offset_m}};
}

Scenario load_scenario(const std::filesystem::path& file, const std::vector<std::string>& overrides,
                       std::optional<std::uint64_t> seed) {
  Scenario scenario;
  scenario.name = file.stem().string();
  scenario.source = load_yaml(file);
  for (const std::string& assignment : overrides) apply_override(scenario.source, assignment);
  if (seed) apply_override(scenario.source, "seed=" + std::to_string(*seed));
  read_config(scenario.source, scenario.config);
  return scenario;
}

}  // namespace arex::sim
