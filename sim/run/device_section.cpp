#include "run/device_section.h"

#include <utility>

namespace arex::sim {

void DeviceSection::read(std::string_view name, const ConfigNode& section) {
  const ConfigNode* named = section.find("type");
  if (named) config_detail::parse_scalar(*named, "type", type);
  if (type != "mid360" && type != "d430") {
    throw ConfigError((named ? named->where : section.where) + ": device '" + std::string(name) +
                      "' has the type '" + type + "', expected mid360 or d430");
  }
  own = section;
  own.entries.clear();
  for (const ConfigNode::Entry& entry : section.entries) {
    if (entry.key == "position_m")
      config_detail::read_value(entry.value, entry.key, mount.position_m);
    else if (entry.key == "rotation_rad")
      config_detail::read_value(entry.value, entry.key, mount.rotation_rad);
    else if (entry.key != "type")
      own.entries.push_back(entry);
  }
  if (type == "mid360") static_cast<void>(over(LidarConfig()));
  if (type == "d430") static_cast<void>(over(DepthConfig()));
}

LidarConfig DeviceSection::over(LidarConfig first) const {
  read_config(own, first);
  return first;
}

DepthConfig DeviceSection::over(DepthConfig first) const {
  read_config(own, first);
  return first;
}

std::vector<ParameterInfo> DeviceSection::parameters() const {
  std::vector<ParameterInfo> all{{"type", type, "", "mid360 or d430"}};
  for (ParameterInfo& parameter : list_parameters(mount)) all.push_back(std::move(parameter));
  for (ParameterInfo& parameter :
       type == "mid360" ? given_parameters<LidarConfig>(own) : given_parameters<DepthConfig>(own)) {
    all.push_back(std::move(parameter));
  }
  return all;
}

}  // namespace arex::sim
