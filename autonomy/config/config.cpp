#include "config/config.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <limits>
#include <sstream>
#include <utility>

#include "config/nearest.h"
#include "config/text.h"
#include "config/yaml_reader.h"

namespace arex {
namespace {

constexpr std::string_view kOverride = "--set";

std::string shown(const ConfigNode& node) {
  switch (node.kind) {
    case ConfigNode::Kind::kScalar:
      return "'" + shortened(node.scalar) + "'";
    case ConfigNode::Kind::kMap:
      return "a map";
    case ConfigNode::Kind::kSequence:
      return "a list";
    default:
      return "nothing";
  }
}

[[noreturn]] void wrong_type(const ConfigNode& node, std::string_view key,
                             std::string_view expected) {
  config_detail::fail(node.where, "'" + std::string(key) + "' is " + shown(node) + ", expected " +
                                      std::string(expected));
}

// What an integer of this type can be; the bounds only where they are what is wrong.
template <class T>
std::string integer_expected(const std::string& text, std::string_view plainly) {
  const bool digits =
      text.find_first_not_of("0123456789", text.find_first_of("+-") == 0) == std::string::npos;
  if (!digits || text.empty() || (text[0] == '-' && std::is_unsigned_v<T>)) {
    return std::string(plainly);
  }
  return "an integer from " + std::to_string(std::numeric_limits<T>::min()) + " to " +
         std::to_string(std::numeric_limits<T>::max());
}

// The clock counts nanoseconds in 64 bits, and cells of a map are counted in 32: beyond these
// bounds a number means nothing to them.
struct Magnitude {
  std::string_view suffix, unit;
  double least, most;  // of the absolute value; zero is always one
};
constexpr std::array<Magnitude, 3> kMagnitudes{
    {{"_s", "s", 1e-9, 1e9}, {"_hz", "Hz", 1e-9, 1e9}, {"_m", "m", 0, 1e6}}};

void check_magnitude(const ConfigNode& node, std::string_view key, double value) {
  for (const Magnitude& m : kMagnitudes) {
    const std::string_view stem = key.substr(0, key.size() - std::min(key.size(), m.suffix.size()));
    if (!key.ends_with(m.suffix) || stem.ends_with("_per") || value == 0) continue;
    const double size = std::abs(value);
    if (size >= m.least && size <= m.most) continue;
    const std::string bound = size > m.most
                                  ? "at most " + config_detail::format_scalar(m.most)
                                  : "0, or at least " + config_detail::format_scalar(m.least);
    wrong_type(node, key, bound + " " + std::string(m.unit));
  }
}

// Marks a value and all in it as given by this override.
void set_order(ConfigNode& node, int order) {
  node.order = order;
  for (auto& entry : node.entries) set_order(entry.value, order);
  for (auto& item : node.items) set_order(item, order);
}

// What stands at a dotted key, or nothing.
const ConfigNode::Entry* find_entry(const ConfigNode& root, std::string_view dotted_key) {
  const ConfigNode* node = &root;
  const ConfigNode::Entry* found = nullptr;
  while (node) {
    const std::size_t dot = std::min(dotted_key.find('.'), dotted_key.size());
    const auto entry = std::find_if(node->entries.begin(), node->entries.end(), [&](const auto& e) {
      return e.key == dotted_key.substr(0, dot);
    });
    if (entry == node->entries.end()) return nullptr;
    found = &*entry;
    if (dot == dotted_key.size()) return found;
    dotted_key.remove_prefix(dot + 1);
    node = &entry->value;
  }
  return nullptr;
}

std::vector<std::string> split_key(const std::string& dotted_key) {
  std::vector<std::string> keys{""};
  for (const char c : dotted_key) {
    if (c == '.') {
      keys.emplace_back();
    } else {
      keys.back() += c;
    }
  }
  return keys;
}

// The unit that a name's last word stands for; empty: none.
std::string_view unit_of_word(std::string_view word) {
  static constexpr std::array<std::pair<std::string_view, std::string_view>, 42> kUnits{{
      {"mps3", "m/s^3"},
      {"mps2", "m/s^2"},
      {"mps", "m/s"},
      {"radps3", "rad/s^3"},
      {"radps2", "rad/s^2"},
      {"radps", "rad/s"},
      {"radpm", "rad/m"},
      {"degps", "deg/s"},
      {"dps", "deg/s"},
      {"rad", "rad"},
      {"deg", "deg"},
      {"mm", "mm"},
      {"m3", "m^3"},
      {"m2", "m^2"},
      {"m", "m"},
      {"us", "us"},
      {"ms", "ms"},
      {"ns", "ns"},
      {"s", "s"},
      {"hz", "Hz"},
      {"px", "px"},
      {"mb", "MB"},
      {"kg", "kg"},
      {"kgm2", "kg m^2"},
      {"kgpm3", "kg/m^3"},
      {"nm", "N m"},
      {"n", "N"},
      {"wh", "Wh"},
      {"ah", "Ah"},
      {"w", "W"},
      {"v", "V"},
      {"a", "A"},
      {"ohm", "ohm"},
      {"pa", "Pa"},
      {"gauss", "G"},
      {"percent", "%"},
      {"fraction", "1"},
      {"ratio", "1"},
      {"share", "1"},
      {"probability", "1"},
      {"charge", "1"},
      {"reflectivity", "1"},
  }};
  const auto found =
      std::find_if(kUnits.begin(), kUnits.end(), [&](const auto& u) { return u.first == word; });
  return found == kUnits.end() ? std::string_view() : found->second;
}

// The unit of what a noise is a noise of: 'gyro' in clipped_gyro_noise_density.
std::string quantity_unit(const std::vector<std::string_view>& words) {
  const auto has = [&](std::string_view word) {
    return std::find(words.begin(), words.end(), word) != words.end();
  };
  if (has("scale")) return "1";
  if (has("gyro")) return "rad/s";
  if (has("accel")) return "m/s^2";
  if (has("magnetometer")) return "G";
  return has("range") ? "m" : "";
}

// Of 'x_noise_density', white noise per root of bandwidth, and 'x_walk_density', the same of the
// derivative. What else is called a density has no unit that its name would tell.
std::string density_unit(const std::vector<std::string_view>& words) {
  const std::string_view kind = words[words.size() - 2];
  const std::string unit = quantity_unit(words);
  if (unit.empty() || (kind != "noise" && kind != "walk")) return "";
  if (kind == "noise") return unit + "/sqrt(Hz)";
  return (unit == "m/s^2" ? "m/s^3" : unit == "rad/s" ? "rad/s^2" : unit + "/s") + "/sqrt(Hz)";
}

}  // namespace

const ConfigNode* ConfigNode::find(std::string_view key) const {
  for (const Entry& entry : entries) {
    if (entry.key == key) return &entry.value;
  }
  return nullptr;
}

ConfigError::ConfigError(const std::string& message) : std::runtime_error(printable(message)) {}

ConfigNode parse_yaml(const std::string& text, const std::string& name) {
  ConfigNode node = config_detail::read_yaml(text, name, config_detail::Positions::kLines);
  if (node.kind == ConfigNode::Kind::kNull) {  // an empty text
    node.kind = ConfigNode::Kind::kMap;
    node.where = name + ":1";
  }
  if (node.kind != ConfigNode::Kind::kMap) {
    config_detail::fail(name + ":1", "the file holds " + shown(node) + ", expected keys");
  }
  return node;
}

ConfigNode load_yaml(const std::filesystem::path& file) {
  const std::string name = file.string();
  std::error_code ignored;
  const auto status = std::filesystem::status(file, ignored);
  if (std::filesystem::is_directory(status)) {
    config_detail::fail(name + ":1", "is a directory, expected a YAML file");
  }
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
    config_detail::fail(name + ":1", "is a pipe, a socket or a device, expected a YAML file");
  }
  std::ifstream stream(file, std::ios::binary);
  std::string text(config_detail::kLongestYaml + 1, '\0');  // one more than it takes says too long
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (!stream && !stream.eof()) {
    config_detail::fail(name + ":1", "cannot be read, expected a YAML file");
  }
  text.resize(static_cast<std::size_t>(stream.gcount()));
  if (text.find_first_not_of(" \t\r\n") == std::string::npos) {
    config_detail::fail(name + ":1", "the file is empty, expected keys ('{}' for none)");
  }
  return parse_yaml(text, name);
}

void set_value(ConfigNode& root, const std::string& dotted_key, const std::string& where,
               ConfigNode value) {
  const int order = ++root.order;
  set_order(value, order);
  ConfigNode* node = &root;
  std::string* leaf_where = nullptr;
  for (const std::string& key : split_key(dotted_key)) {
    if (key.empty()) config_detail::fail(where, "a key of '" + dotted_key + "' is empty");
    const bool section =
        node->kind == ConfigNode::Kind::kMap || node->kind == ConfigNode::Kind::kNull;
    if (!section) {
      config_detail::fail(where, "goes into " + shown(*node) + " of " + node->where +
                                     ", expected a map of keys there");
    }
    node->kind = ConfigNode::Kind::kMap;
    auto entry = std::find_if(node->entries.begin(), node->entries.end(),
                              [&](const auto& e) { return e.key == key; });
    if (entry == node->entries.end()) {
      node->entries.push_back({key, where, {}});
      entry = std::prev(node->entries.end());
      entry->value.where = where;
      entry->value.order = order;
    }
    node = &entry->value;
    leaf_where = &entry->where;
  }
  *node = std::move(value);
  *leaf_where = where;
}

void apply_override(ConfigNode& root, const std::string& assignment) {
  const auto equals = assignment.find('=');
  if (equals == std::string::npos || equals == 0) {
    config_detail::fail(std::string(kOverride) + " " + shortened(assignment), "expected key=value");
  }
  const std::string key = assignment.substr(0, equals);
  const std::string where = std::string(kOverride) + " " + shortened(key);
  ConfigNode value = config_detail::read_yaml(assignment.substr(equals + 1), where,
                                              config_detail::Positions::kName);
  if (value.where.empty()) value.where = where;  // where nothing stands behind the sign
  set_value(root, key, where, value);
}

std::string last_given(const ConfigNode& section) {
  const ConfigNode* newest = &section;
  const auto visit = [&newest](const auto& self, const ConfigNode& node) -> void {
    if (node.order > newest->order) newest = &node;
    for (const auto& entry : node.entries) self(self, entry.value);
    for (const auto& item : node.items) self(self, item);
  };
  for (const auto& entry : section.entries) visit(visit, entry.value);
  return newest->where;
}

std::string write_yaml(const std::vector<ParameterInfo>& parameters) {
  std::string text;
  std::vector<std::string> open;  // the sections that the previous line stood in
  for (const ParameterInfo& parameter : parameters) {
    std::vector<std::string> path;
    std::istringstream keys(parameter.key);
    for (std::string key; std::getline(keys, key, '.');) path.push_back(key);
    const std::string leaf = path.back();
    path.pop_back();
    std::size_t common = 0;
    while (common < std::min(path.size(), open.size()) && path[common] == open[common]) ++common;
    for (std::size_t depth = common; depth < path.size(); ++depth) {
      text += std::string(2 * depth, ' ') + path[depth] + ":\n";
    }
    text += std::string(2 * path.size(), ' ') + leaf + ": " + parameter.value + "\n";
    open = std::move(path);
  }
  return text;
}

namespace config_detail {

void fail(const std::string& where, const std::string& message) {
  throw ConfigError(where + ": " + message);
}

void expect_kind(const ConfigNode& node, std::string_view key, ConfigNode::Kind kind,
                 std::string_view expected) {
  if (node.kind != kind) wrong_type(node, key, expected);
}

void expect_length(const ConfigNode& node, std::string_view key, std::size_t length) {
  const std::string expected = "a list of " + std::to_string(length) + " numbers";
  expect_kind(node, key, ConfigNode::Kind::kSequence, expected);
  if (node.items.size() != length) {
    fail(node.where, "'" + std::string(key) + "' has " + std::to_string(node.items.size()) +
                         " items, expected " + expected);
  }
}

const ConfigNode* find_dotted(const ConfigNode& root, std::string_view dotted_key) {
  const ConfigNode::Entry* entry = find_entry(root, dotted_key);
  return entry ? &entry->value : nullptr;
}

void expect_name(const ConfigNode::Entry& entry) {
  constexpr std::size_t kLongest = 40;
  const bool plain = std::all_of(entry.key.begin(), entry.key.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  });
  if (plain && !entry.key.empty() && entry.key.size() <= kLongest) return;
  fail(entry.where, "the name '" + shortened(entry.key) +
                        "', expected at most 40 letters, digits and underscores");
}

void parse_scalar(const ConfigNode& node, std::string_view key, bool& out) {
  constexpr std::string_view kExpected = "true or false";
  expect_kind(node, key, ConfigNode::Kind::kScalar, kExpected);
  if (node.scalar != "true" && node.scalar != "false") wrong_type(node, key, kExpected);
  out = node.scalar == "true";
}

void parse_scalar(const ConfigNode& node, std::string_view key, int& out) {
  expect_kind(node, key, ConfigNode::Kind::kScalar, "an integer");
  const auto value = parse_int(node.scalar);
  if (!value) wrong_type(node, key, integer_expected<int>(node.scalar, "an integer"));
  out = *value;
}

void parse_scalar(const ConfigNode& node, std::string_view key, std::uint64_t& out) {
  constexpr std::string_view kExpected = "an integer that is not negative";
  expect_kind(node, key, ConfigNode::Kind::kScalar, kExpected);
  const auto value = parse_uint64(node.scalar);
  if (!value) wrong_type(node, key, integer_expected<std::uint64_t>(node.scalar, kExpected));
  out = *value;
}

void parse_scalar(const ConfigNode& node, std::string_view key, double& out) {
  constexpr std::string_view kExpected = "a finite number";
  expect_kind(node, key, ConfigNode::Kind::kScalar, kExpected);
  const auto value = parse_double(node.scalar);
  if (!value) wrong_type(node, key, kExpected);
  check_magnitude(node, key, *value);
  out = *value;
}

void parse_scalar(const ConfigNode& node, std::string_view key, std::string& out) {
  expect_kind(node, key, ConfigNode::Kind::kScalar, "a text");
  if (printable(node.scalar) != node.scalar) wrong_type(node, key, "a text that can be printed");
  out = node.scalar;
}

std::size_t parse_choice(const ConfigNode& node, std::string_view key,
                         const std::vector<std::string_view>& names) {
  std::string expected = "one of";
  for (const std::string_view name : names) expected += " " + std::string(name);
  expect_kind(node, key, ConfigNode::Kind::kScalar, expected);
  const auto found = std::find(names.begin(), names.end(), node.scalar);
  if (found == names.end()) wrong_type(node, key, expected);
  return static_cast<std::size_t>(found - names.begin());
}

void reject_unknown(const ConfigNode& node, const std::vector<std::string>& known) {
  for (const ConfigNode::Entry& entry : node.entries) {
    if (std::find(known.begin(), known.end(), entry.key) != known.end()) continue;
    std::string message = "unknown key '" + shortened(entry.key) + "'";
    if (!known.empty()) {
      message += "; did you mean '" + nearest(entry.key, known) + "'?";
    }
    fail(entry.where, message);
  }
}

std::string locate_rule(const ConfigNode& node, std::string_view rule) {
  static constexpr std::string_view kOfKeys = "abcdefghijklmnopqrstuvwxyz0123456789_.";
  const ConfigNode::Entry* blamed = nullptr;
  for (std::size_t at = 0; at < rule.size();) {
    const std::size_t begin = std::min(rule.find_first_of(kOfKeys, at), rule.size());
    at = std::min(rule.find_first_not_of(kOfKeys, begin), rule.size());
    const ConfigNode::Entry* entry = find_entry(node, rule.substr(begin, at - begin));
    if (entry && (!blamed || entry->value.order > blamed->value.order)) blamed = entry;
  }
  return blamed ? blamed->where : node.where;
}

std::string format_scalar(bool value) { return value ? "true" : "false"; }
std::string format_scalar(int value) { return std::to_string(value); }
std::string format_scalar(std::uint64_t value) { return std::to_string(value); }

std::string format_scalar(double value) {
  // The shortest text that reads back to the same bits.
  std::array<char, 32> buffer{};
  const auto result = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  return {buffer.data(), result.ptr};
}

std::string format_scalar(const std::string& value) {
  std::string quoted = "\"";
  for (const char c : value) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return quoted + "\"";
}

std::string unit_of(std::string_view name) {
  std::vector<std::string_view> words;
  for (std::string_view rest = name; !rest.empty();) {
    words.push_back(rest.substr(0, rest.find('_')));
    rest.remove_prefix(std::min(rest.size(), words.back().size() + 1));
  }
  if (words.size() < 2) return "";  // 'cells', 'n': a name, no suffix
  if (words.back() == "density") return density_unit(words);
  const std::string unit(unit_of_word(words.back()));
  if (unit.empty() || words.size() < 3 || words[words.size() - 2] != "per") return unit;
  const std::string_view counted = words[words.size() - 3];
  std::string numerator(unit_of_word(counted));
  if (counted == "std" || counted == "noise") numerator = quantity_unit(words);
  return (numerator.empty() ? "1" : numerator) + "/" + unit;
}

}  // namespace config_detail
}  // namespace arex
