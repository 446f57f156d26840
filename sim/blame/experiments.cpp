#include "blame/experiments.h"

#include <algorithm>
#include <span>

#include "run/scenario.h"
#include "sensors/fault.h"

namespace arex::sim {
namespace {

// What a scenario chooses of a device rather than suffers.
constexpr std::array<std::string_view, 5> kOfImu{"output_rate_hz", "magnetometer_rate_hz",
                                                 "barometer_rate_hz", "earth_field_gauss",
                                                 "sea_level_pressure_pa"};
constexpr std::array<std::string_view, 8> kOfLidar{
    "type",    "position_m", "rotation_rad",     "enabled",
    "rate_hz", "pattern",    "pattern_turn_deg", "misses_in_bag"};
constexpr std::array<std::string_view, 6> kOfCamera{"type",    "position_m", "rotation_rad",
                                                    "rate_hz", "width_px",   "height_px"};
constexpr std::array<std::string_view, 9> kOfSpinning{"type",        "position_m", "rotation_rad",
                                                      "rate_hz",     "rings",      "lowest_deg",
                                                      "highest_deg", "columns",    "range_max_m"};
// How the maps take frames: what the survey needs otherwise, or would be wrong if it were odd.
constexpr std::array<std::string_view, 6> kOfTaking{"latency_s", "confirm_frames", "decay_per_s",
                                                    "sensor",    "depth_min_m",    "depth_max_m"};
constexpr const char* kSurvey = "survey_of_truth";

ConfigNode* find(ConfigNode& node, std::string_view key) {
  for (ConfigNode::Entry& entry : node.entries) {
    if (entry.key == key) return &entry.value;
  }
  return nullptr;
}

void erase(ConfigNode& node, std::string_view key) {
  std::erase_if(node.entries, [&](const ConfigNode::Entry& entry) { return entry.key == key; });
}

void keep_only(ConfigNode& section, std::span<const std::string_view> keys) {
  std::erase_if(section.entries, [&](const ConfigNode::Entry& entry) {
    return std::find(keys.begin(), keys.end(), entry.key) == keys.end();
  });
}

std::string scalar_at(const ConfigNode& root, std::initializer_list<std::string_view> path) {
  const ConfigNode* node = &root;
  for (const std::string_view key : path) {
    node = node ? node->find(key) : nullptr;
  }
  return node ? node->scalar : "";
}

void set(ConfigNode& scenario, const std::string& assignment) {
  apply_override(scenario, assignment);
}

/// Leaves out the faults of what `concerns` says of a device's name.
template <class Concerns>
void erase_faults(ConfigNode& scenario, const Concerns& concerns) {
  ConfigNode* faults = find(scenario, "faults");
  if (!faults) return;
  std::erase_if(faults->items, [&](const ConfigNode& fault) {
    const ConfigNode* device = fault.find("device");
    return device && concerns(device->scalar);
  });
}

bool is_sensor(const std::string& device) {
  const FaultyPart part = faulty_part(device);
  return part != FaultyPart::kMotor && part != FaultyPart::kEsc && part != FaultyPart::kBattery;
}

/// What their makers sell: nothing but what the scenario chose of them, no fault, mounted where
/// they are believed to be.
void sell_sensors(ConfigNode& scenario) {
  if (ConfigNode* imu = find(scenario, "imu")) keep_only(*imu, kOfImu);
  if (ConfigNode* lidar = find(scenario, "lidar")) keep_only(*lidar, kOfLidar);
  if (ConfigNode* depth = find(scenario, "depth")) keep_only(*depth, kOfCamera);
  if (ConfigNode* infrared = find(scenario, "infrared")) {
    for (const char* key : {"clock_offset_s", "mount_error_rad"}) erase(*infrared, key);
  }
  erase_faults(scenario, is_sensor);
  if (ConfigNode* physics = find(scenario, "physics")) {
    erase(*physics, "lidar_mount");
    erase(*physics, "camera_mount");
  }
  ConfigNode* devices = find(scenario, "devices");
  if (!devices) return;
  for (ConfigNode::Entry& entry : devices->entries) {
    const std::string type = scalar_at(entry.value, {"type"});
    if (type == "mid360") keep_only(entry.value, kOfLidar);
    if (type == "d430") keep_only(entry.value, kOfCamera);
    if (type == "spinning") keep_only(entry.value, kOfSpinning);
  }
}

bool clean_sensors(ConfigNode& scenario) {
  sell_sensors(scenario);
  std::vector<std::string> noisy{"imu", "lidar", "depth"};
  if (const ConfigNode* devices = scenario.find("devices")) {
    for (const ConfigNode::Entry& entry : devices->entries) {
      if (scalar_at(entry.value, {"type"}) != "survey") noisy.push_back("devices." + entry.key);
    }
  }
  for (const std::string& device : noisy) set(scenario, device + ".noise_free=true");
  return true;
}

bool true_odometry(ConfigNode& scenario) {
  const bool sound = [&] {
    const ConfigNode* mocap = scenario.find("mocap");
    const ConfigNode* jump = mocap ? mocap->find("fault_jump_m") : nullptr;
    return !jump || std::all_of(jump->items.begin(), jump->items.end(), [](const ConfigNode& x) {
      return std::strtod(x.scalar.c_str(), nullptr) == 0;
    });
  }();
  if (scalar_at(scenario, {"odometry", "source"}) == "mocap" && sound) return false;
  erase(scenario, "mocap");
  erase_faults(scenario, [](const std::string& device) { return device == "mocap"; });
  set(scenario, "odometry.source=mocap");
  return true;
}

bool true_maps(ConfigNode& scenario) {
  if (scalar_at(scenario, {"mapping", "enabled"}) == "false") return false;
  if (ConfigNode* mapping = find(scenario, "mapping")) {
    for (const std::string_view key : kOfTaking) erase(*mapping, key);
  }
  set(scenario, std::string("devices.") + kSurvey + ".type=survey");
  set(scenario, std::string("mapping.lidar=") + kSurvey);
  // A frame shows all that is in sight: what was seen from elsewhere may have been misplaced.
  for (const char* assignment :
       {"use_depth=false", "lone_range_m=0", "lidar_frames=1", "remember=false"}) {
    set(scenario, std::string("mapping.") + assignment);
  }
  return true;
}

bool perfect_tracking(ConfigNode& scenario) {
  if (scalar_at(scenario, {"physics", "perfect_tracking"}) == "true") return false;
  set(scenario, "physics.perfect_tracking=true");
  return true;
}

Experiment experiment(const std::string& scenario, const std::string& name, std::string text,
                      ConfigNode source) {
  return {name, std::move(text), make_scenario(scenario, std::move(source)).resolved_yaml()};
}

}  // namespace

std::string_view replacement_text(BlamedModule module) {
  constexpr std::array<std::string_view, 4> kTexts{
      "sensors without noise and faults", "the true pose as odometry",
      "maps of a survey of what stands there", "a vehicle carried along its setpoint"};
  return kTexts[static_cast<std::size_t>(module)];
}

bool replace_by_truth(BlamedModule module, ConfigNode& scenario) {
  switch (module) {
    case BlamedModule::kSensors:
      return clean_sensors(scenario);
    case BlamedModule::kOdometry:
      return true_odometry(scenario);
    case BlamedModule::kMaps:
      return true_maps(scenario);
    case BlamedModule::kTracking:
      return perfect_tracking(scenario);
  }
  return false;
}

bool sensors_are_as_sold(const ConfigNode& scenario) {
  ConfigNode sold = scenario;
  sell_sensors(sold);
  return make_scenario("sold", std::move(sold)).resolved_yaml() ==
         make_scenario("sold", scenario).resolved_yaml();
}

std::vector<Experiment> plan_experiments(const std::string& name, const ConfigNode& scenario,
                                         bool timed_out, bool again) {
  std::vector<Experiment> plan;
  if (again) plan.push_back(experiment(name, "as_flown", "nothing", scenario));
  ConfigNode all = scenario;
  std::size_t replaced = 0;
  for (std::size_t i = 0; i < kBlamedModules.size(); ++i) {
    const auto module = static_cast<BlamedModule>(i);
    ConfigNode one = scenario;
    if (!replace_by_truth(module, one)) continue;
    replace_by_truth(module, all);
    ++replaced;
    plan.push_back(experiment(name, std::string(kBlamedModules[i]),
                              std::string(replacement_text(module)), std::move(one)));
  }
  if (replaced > 1) plan.push_back(experiment(name, "all", "all of these", std::move(all)));
  if (timed_out) {
    const double time_s = make_scenario(name, scenario).config.stack.mission.max_time_s;
    ConfigNode longer = scenario;
    set(longer, "mission.max_time_s=" + config_detail::format_scalar(2 * time_s));
    plan.push_back(experiment(name, "time", "twice the time", std::move(longer)));
  }
  return plan;
}

}  // namespace arex::sim
