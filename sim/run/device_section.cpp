#include "run/device_section.h"

#include <utility>

#include "run/device_types.h"

namespace arex::sim {

void DeviceSection::read(std::string_view name, const ConfigNode& section) {
  const ConfigNode* named = section.find("type");
  if (named) config_detail::parse_scalar(*named, "type", type);
  const std::string where =
      (named ? named->where : section.where) + ": device '" + std::string(name) + "'";
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
  static_cast<void>(device_types().at(type, where).parameters(own));
}

std::vector<ParameterInfo> DeviceSection::parameters() const {
  const auto& made = device_types().at(type, "devices");
  std::vector<ParameterInfo> all{{"type", type, "", made.meaning}};
  for (ParameterInfo& parameter : list_parameters(mount)) all.push_back(std::move(parameter));
  for (ParameterInfo& parameter : made.parameters(own)) all.push_back(std::move(parameter));
  return all;
}

}  // namespace arex::sim
