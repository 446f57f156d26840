#include "config/config.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <numeric>
#include <sstream>

namespace arex {
namespace {

constexpr std::string_view kOverride = "--set";

std::string position(const std::string& name, const YAML::Mark& mark) {
  return name + ":" + std::to_string(mark.is_null() ? 1 : mark.line + 1);
}

ConfigNode convert(const YAML::Node& yaml, const std::string& name) {
  ConfigNode node;
  node.where = position(name, yaml.Mark());
  if (yaml.IsScalar()) {
    node.kind = ConfigNode::Kind::kScalar;
    node.scalar = yaml.Scalar();
  } else if (yaml.IsSequence()) {
    node.kind = ConfigNode::Kind::kSequence;
    for (const auto& item : yaml) node.items.push_back(convert(item, name));
  } else if (yaml.IsMap()) {
    node.kind = ConfigNode::Kind::kMap;
    for (const auto& pair : yaml) {
      const std::string where = position(name, pair.first.Mark());
      if (!pair.first.IsScalar()) config_detail::fail(where, "a key must be a plain word");
      const std::string& key = pair.first.Scalar();
      if (node.find(key)) {
        config_detail::fail(where, "duplicate key '" + key + "', expected each key once");
      }
      node.entries.push_back({key, where, convert(pair.second, name)});
      // yaml-cpp places an absent value on the next line.
      if (pair.second.IsNull()) node.entries.back().value.where = where;
    }
  }
  return node;
}

// Levenshtein distance, for 'did you mean'.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = std::exchange(row[j], std::min({row[j] + 1, row[j - 1] + 1, substituted}));
    }
  }
  return row.back();
}

// A key that continues or shortens another is what people mean even when the distance is large:
// 'inflation' for 'inflation_m'.
std::size_t unlikeness(std::string_view given, std::string_view known) {
  const bool prefix = known.starts_with(given) || given.starts_with(known);
  return edit_distance(given, known) / (prefix ? 4 : 1);
}

std::string shown(const ConfigNode& node) {
  switch (node.kind) {
    case ConfigNode::Kind::kScalar:
      return "'" + node.scalar + "'";
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

template <class T>
bool parse_number(const std::string& text, T& out) {
  const char* first = text.data();
  const char* last = first + text.size();
  if (text.size() > 1 && *first == '+') ++first;
  const auto result = std::from_chars(first, last, out);
  return result.ec == std::errc() && result.ptr == last;
}

}  // namespace

const ConfigNode* ConfigNode::find(std::string_view key) const {
  for (const Entry& entry : entries) {
    if (entry.key == key) return &entry.value;
  }
  return nullptr;
}

ConfigNode parse_yaml(const std::string& text, const std::string& name) {
  try {
    const YAML::Node yaml = YAML::Load(text);
    ConfigNode node = convert(yaml, name);
    if (node.kind == ConfigNode::Kind::kNull) node.kind = ConfigNode::Kind::kMap;  // empty file
    if (node.kind != ConfigNode::Kind::kMap) {
      config_detail::fail(name + ":1", "the file holds " + shown(node) + ", expected keys");
    }
    return node;
  } catch (const YAML::Exception& error) {
    config_detail::fail(position(name, error.mark), "not valid YAML: " + error.msg);
  }
}

ConfigNode load_yaml(const std::filesystem::path& file) {
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored)) {
    config_detail::fail(file.string() + ":1", "is a directory, expected a YAML file");
  }
  std::ifstream stream(file);
  if (!stream) {
    config_detail::fail(file.string() + ":1", "cannot be read, expected a YAML file");
  }
  std::ostringstream text;
  text << stream.rdbuf();
  return parse_yaml(text.str(), file.string());
}

void set_value(ConfigNode& root, const std::string& dotted_key, const std::string& where,
               ConfigNode value) {
  ConfigNode* node = &root;
  std::string* leaf_where = nullptr;
  std::istringstream keys(dotted_key);
  for (std::string key; std::getline(keys, key, '.');) {
    node->kind = ConfigNode::Kind::kMap;
    auto entry = std::find_if(node->entries.begin(), node->entries.end(),
                              [&](const auto& e) { return e.key == key; });
    if (entry == node->entries.end()) {
      node->entries.push_back({key, where, {}});
      entry = std::prev(node->entries.end());
      entry->value.where = where;
    }
    node = &entry->value;
    leaf_where = &entry->where;
  }
  *node = std::move(value);
  if (leaf_where) *leaf_where = where;
}

void apply_override(ConfigNode& root, const std::string& assignment) {
  const auto equals = assignment.find('=');
  if (equals == std::string::npos || equals == 0) {
    config_detail::fail(std::string(kOverride) + " " + assignment, "expected key=value");
  }
  const std::string path = assignment.substr(0, equals);
  const std::string where = std::string(kOverride) + " " + path;
  ConfigNode value;
  try {
    value = convert(YAML::Load(assignment.substr(equals + 1)), where);
  } catch (const YAML::Exception& error) {
    config_detail::fail(where, "not valid YAML: " + error.msg);
  }
  // Inside an override every position is the override itself.
  const auto relabel = [&](auto&& self, ConfigNode& n) -> void {
    n.where = where;
    for (auto& entry : n.entries) entry.where = where, self(self, entry.value);
    for (auto& item : n.items) self(self, item);
  };
  relabel(relabel, value);
  set_value(root, path, where, std::move(value));
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

void parse_scalar(const ConfigNode& node, std::string_view key, bool& out) {
  constexpr std::string_view kExpected = "true or false";
  expect_kind(node, key, ConfigNode::Kind::kScalar, kExpected);
  if (node.scalar != "true" && node.scalar != "false") wrong_type(node, key, kExpected);
  out = node.scalar == "true";
}

void parse_scalar(const ConfigNode& node, std::string_view key, int& out) {
  expect_kind(node, key, ConfigNode::Kind::kScalar, "an integer");
  if (!parse_number(node.scalar, out)) wrong_type(node, key, "an integer");
}

void parse_scalar(const ConfigNode& node, std::string_view key, std::uint64_t& out) {
  constexpr std::string_view kExpected = "an integer that is not negative";
  expect_kind(node, key, ConfigNode::Kind::kScalar, kExpected);
  if (!parse_number(node.scalar, out)) wrong_type(node, key, kExpected);
}

void parse_scalar(const ConfigNode& node, std::string_view key, double& out) {
  constexpr std::string_view kExpected = "a finite number";
  expect_kind(node, key, ConfigNode::Kind::kScalar, kExpected);
  if (!parse_number(node.scalar, out) || !std::isfinite(out)) wrong_type(node, key, kExpected);
}

void parse_scalar(const ConfigNode& node, std::string_view key, std::string& out) {
  expect_kind(node, key, ConfigNode::Kind::kScalar, "a text");
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
    std::string message = "unknown key '" + entry.key + "'";
    if (!known.empty()) {
      const auto nearest =
          std::min_element(known.begin(), known.end(), [&](const auto& a, const auto& b) {
            return unlikeness(entry.key, a) < unlikeness(entry.key, b);
          });
      message += "; did you mean '" + *nearest + "'?";
    }
    fail(entry.where, message);
  }
}

std::string locate_rule(const ConfigNode& node, std::string_view rule) {
  const ConfigNode::Entry* first = nullptr;
  std::size_t first_at = std::string_view::npos;
  for (const ConfigNode::Entry& entry : node.entries) {
    const std::size_t at = rule.find(entry.key);
    if (at < first_at) first = &entry, first_at = at;
  }
  return first ? first->where : node.where;
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
  static constexpr std::array<std::pair<std::string_view, std::string_view>, 31> kUnits{{
      {"_mps3", "m/s^3"},  {"_mps2", "m/s^2"},  {"_mps", "m/s"},    {"_radps2", "rad/s^2"},
      {"_radps", "rad/s"}, {"_degps", "deg/s"}, {"_rad", "rad"},    {"_deg", "deg"},
      {"_mm", "mm"},       {"_m3", "m^3"},      {"_m2", "m^2"},     {"_per_m", "1/m"},
      {"_m", "m"},         {"_ms", "ms"},       {"_ns", "ns"},      {"_s", "s"},
      {"_hz", "Hz"},       {"_px", "px"},       {"_kg", "kg"},      {"_nm", "N m"},
      {"_n", "N"},         {"_wh", "Wh"},       {"_ah", "Ah"},      {"_w", "W"},
      {"_v", "V"},         {"_a", "A"},         {"_ohm", "ohm"},    {"_pa", "Pa"},
      {"_gauss", "G"},     {"_kgm2", "kg m^2"}, {"_fraction", "1"},
  }};
  for (const auto& [suffix, unit] : kUnits) {
    if (name.ends_with(suffix)) return std::string(unit);
  }
  return "";
}

}  // namespace config_detail
}  // namespace arex
