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

namespace {

// What a pilot would read off the battery's label. A scenario may say otherwise.
void tell_battery(const BatteryConfig& battery, ConsumptionConfig& believed) {
  believed.full_v = battery.cells * battery.cell_full_v;
  believed.middle_v = battery.cells * battery.cell_middle_v;
  believed.empty_v = battery.cells * battery.cell_empty_v;
  believed.middle_charge = battery.middle_charge;
  believed.internal_resistance = battery.resistance_ohm;
  believed.capacity_wh = 0.5 * battery.capacity_ah *
                         ((believed.empty_v + believed.middle_v) * believed.middle_charge +
                          (believed.middle_v + believed.full_v) * (1 - believed.middle_charge));
}

}  // namespace

Scenario load_scenario(const std::filesystem::path& file, const std::vector<std::string>& overrides,
                       std::optional<std::uint64_t> seed) {
  Scenario scenario;
  scenario.name = file.stem().string();
  scenario.source = load_yaml(file);
  for (const std::string& assignment : overrides) apply_override(scenario.source, assignment);
  if (seed) apply_override(scenario.source, "seed=" + std::to_string(*seed));
  ScenarioConfig flown;
  read_config(scenario.source, flown);
  tell_battery(flown.physics.battery, scenario.config.stack.exploration.explorer.consumption);
  read_config(scenario.source, scenario.config);
  return scenario;
}

}  // namespace arex::sim
