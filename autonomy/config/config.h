#pragma once

#include <concepts>
#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "math/types.h"

/// Strict configuration: YAML <-> struct. A config struct lists its fields once, in
///
///     void fields(auto& f) {
///       f("inflation_m", inflation_m, "obstacle expansion, each axis (paper, III-A)");
///       f.check(inflation_m >= 0, "inflation_m >= 0");
///     }
///
/// and reading, writing, `arex params` and `--set` all come from that list. The default member
/// initialiser is the only home of the number. Field types: bool, int, std::uint64_t, double,
/// std::string, Vec2, Vec3, enums with an `enum_names` overload, std::vector of any of these,
/// nested config structs, std::map of those by a name that the user gives, and sections whose keys
/// depend on what they say (OpenSection). Units are the name's suffix (_m, _mps, _rad, _hz, ...).
namespace arex {

/// Bad input. what() is one printable line, `FILE:LINE: what is wrong, what is expected`.
class ConfigError : public std::runtime_error {
 public:
  explicit ConfigError(const std::string& message);
};

/// A parsed YAML value that remembers where it stands.
struct ConfigNode {
  enum class Kind { kNull, kScalar, kMap, kSequence };
  struct Entry;
  Kind kind = Kind::kNull;
  std::string where;  ///< "FILE:LINE", or "--set key"
  int order = 0;      ///< 0: the file says it; else which override, counted at the root
  std::string scalar;
  std::vector<Entry> entries;     ///< of a map, in the file's order
  std::vector<ConfigNode> items;  ///< of a sequence

  [[nodiscard]] const ConfigNode* find(std::string_view key) const;
};
struct ConfigNode::Entry {
  std::string key;
  std::string where;
  ConfigNode value;
};

/// Reads a file. @throws ConfigError for what is no file, what holds nothing, and for what
/// parse_yaml refuses.
ConfigNode load_yaml(const std::filesystem::path& file);
/// The same from text; `name` stands for the file in messages. One document of UTF-8, bounded in
/// length, depth and number of values; aliases are followed, tags and merge keys are refused.
ConfigNode parse_yaml(const std::string& text, const std::string& name);
/// Puts `value` at a dotted key, over what stands there; messages will name `where`.
/// @throws ConfigError if something else than a section stands on the way.
void set_value(ConfigNode& root, const std::string& dotted_key, const std::string& where,
               ConfigNode value);
/// Applies one `--set a.b=value` over what the file says. @throws ConfigError if it has no '='.
void apply_override(ConfigNode& root, const std::string& assignment);

/// Where the newest value of a section was given: the last override in it, or else the section.
std::string last_given(const ConfigNode& section);

/// One parameter, as `arex params` prints it.
struct ParameterInfo {
  std::string key;  ///< dotted
  std::string value;
  std::string unit;  ///< from the name's suffix; empty if it has none
  std::string meaning;
};

template <class T>
concept ConfigEnum = std::is_enum_v<T> && requires(T t) {
  enum_names(t).size();
};

/// A section that reads and lists itself, because its keys depend on its name or a type in it.
template <class T>
concept OpenSection = requires(T section, const T& listed, const ConfigNode& node) {
  section.read(std::string_view(), node);  // name and content; throws ConfigError
  { listed.parameters() } -> std::same_as<std::vector<ParameterInfo>>;
};

namespace config_detail {

[[noreturn]] void fail(const std::string& where, const std::string& message);
void parse_scalar(const ConfigNode& node, std::string_view key, bool& out);
void parse_scalar(const ConfigNode& node, std::string_view key, int& out);
void parse_scalar(const ConfigNode& node, std::string_view key, std::uint64_t& out);
void parse_scalar(const ConfigNode& node, std::string_view key, double& out);
void parse_scalar(const ConfigNode& node, std::string_view key, std::string& out);
std::size_t parse_choice(const ConfigNode& node, std::string_view key,
                         const std::vector<std::string_view>& names);
void expect_kind(const ConfigNode& node, std::string_view key, ConfigNode::Kind kind,
                 std::string_view expected);
void expect_length(const ConfigNode& node, std::string_view key, std::size_t length);
/// A name that the user gives: letters, digits and _, at most 40, so that files and dotted keys can
/// be made of it.
void expect_name(const ConfigNode::Entry& entry);
/// Throws for the first key of `node` that is not in `known`, naming the nearest known one.
void reject_unknown(const ConfigNode& node, const std::vector<std::string>& known);
/// Where the value that a broken rule speaks of was given: of the keys that the rule names (dotted
/// from here) the one that an override gave last, or else the first.
std::string locate_rule(const ConfigNode& node, std::string_view rule);

/// What stands at a dotted key; null if nothing does.
const ConfigNode* find_dotted(const ConfigNode& root, std::string_view dotted_key);

std::string format_scalar(bool value);
std::string format_scalar(int value);
std::string format_scalar(std::uint64_t value);
std::string format_scalar(double value);
std::string format_scalar(const std::string& value);
std::string unit_of(std::string_view name);

template <class T>
inline constexpr bool kIsVector = false;
template <class T>
inline constexpr bool kIsVector<std::vector<T>> = true;
template <class T>
inline constexpr bool kIsMap = false;
template <class T>
inline constexpr bool kIsMap<std::map<std::string, T>> = true;
template <class T>
inline constexpr bool kIsEigen = std::is_same_v<T, Vec2> || std::is_same_v<T, Vec3>;
template <class T>
inline constexpr bool kIsScalar =
    std::is_same_v<T, bool> || std::is_same_v<T, int> || std::is_same_v<T, std::uint64_t> ||
    std::is_same_v<T, double> || std::is_same_v<T, std::string>;

template <class T>
void read_value(const ConfigNode& node, std::string_view key, T& value);

/// The `f` of fields() that reads a struct from a map.
class Reader {
 public:
  explicit Reader(const ConfigNode& node) : node_(node) {}

  void operator()(std::string_view name, auto& value, std::string_view /*meaning*/) {
    known_.emplace_back(name);
    if (const ConfigNode* child = node_.find(name)) read_value(*child, name, value);
  }
  void check(bool holds, std::string_view rule) {
    if (!holds && broken_.empty()) broken_ = rule;
  }
  /// @throws ConfigError for an unknown key, then for the first broken rule.
  void finish() const {
    reject_unknown(node_, known_);
    if (!broken_.empty()) fail(locate_rule(node_, broken_), "out of range: expected " + broken_);
  }

 private:
  const ConfigNode& node_;
  std::vector<std::string> known_;
  std::string broken_;
};

template <class T>
void read_value(const ConfigNode& node, std::string_view key, T& value) {
  if constexpr (kIsScalar<T>) {
    parse_scalar(node, key, value);
  } else if constexpr (ConfigEnum<T>) {
    const auto& names = enum_names(value);
    value = static_cast<T>(parse_choice(node, key, {names.begin(), names.end()}));
  } else if constexpr (kIsEigen<T>) {
    expect_length(node, key, static_cast<std::size_t>(value.size()));
    for (Eigen::Index i = 0; i < value.size(); ++i) {
      parse_scalar(node.items[static_cast<std::size_t>(i)], key, value[i]);
    }
  } else if constexpr (kIsVector<T>) {
    expect_kind(node, key, ConfigNode::Kind::kSequence, "a list [..]");
    value.clear();
    for (const ConfigNode& item : node.items) read_value(item, key, value.emplace_back());
  } else if constexpr (kIsMap<T>) {
    expect_kind(node, key, ConfigNode::Kind::kMap, "a map of sections by name");
    for (const ConfigNode::Entry& entry : node.entries) {
      expect_name(entry);
      read_value(entry.value, entry.key, value[entry.key]);
    }
  } else if constexpr (OpenSection<T>) {
    expect_kind(node, key, ConfigNode::Kind::kMap, "a map of keys");
    value.read(key, node);
  } else {
    expect_kind(node, key, ConfigNode::Kind::kMap, "a map of keys");
    Reader reader(node);
    value.fields(reader);
    reader.finish();
  }
}

template <class T>
std::string format_value(const T& value);

/// The `f` of fields() that writes a struct as a flow map, for structs inside lists.
struct FlowWriter {
  std::string text;
  void operator()(std::string_view name, auto& field, std::string_view /*meaning*/) {
    text += (text.empty() ? "" : ", ") + std::string(name) + ": " + format_value(field);
  }
  void check(bool, std::string_view) {}
};

template <class T>
std::string format_value(const T& value) {
  if constexpr (kIsScalar<T>) {
    return format_scalar(value);
  } else if constexpr (ConfigEnum<T>) {
    return std::string(enum_names(value)[static_cast<std::size_t>(value)]);
  } else if constexpr (kIsEigen<T>) {
    std::string text = "[";
    for (Eigen::Index i = 0; i < value.size(); ++i) {
      text += (i ? ", " : "") + format_scalar(value[i]);
    }
    return text + "]";
  } else if constexpr (kIsVector<T>) {
    std::string text = "[";
    for (const auto& item : value) text += (text.size() > 1 ? ", " : "") + format_value(item);
    return text + "]";
  } else {
    FlowWriter writer;
    T copy = value;
    copy.fields(writer);
    return "{" + writer.text + "}";
  }
}

/// The names that an enum may have, as the meaning of a parameter lists them.
template <class T>
std::string choices(const T& value) {
  std::string text;
  if constexpr (ConfigEnum<T>) {
    for (const std::string_view name : enum_names(value)) {
      text += (text.empty() ? " (" : "|") + std::string(name);
    }
    text += ")";
  }
  return text;
}

/// The `f` of fields() that lists every leaf with its dotted key, and where asked every section.
class Lister {
 public:
  Lister(std::string prefix, std::vector<ParameterInfo>& out, bool sections)
      : prefix_(std::move(prefix)), out_(out), sections_(sections) {}

  template <class T>
  void operator()(std::string_view name, T& value, std::string_view meaning) {
    const std::string key = prefix_ + std::string(name);
    if constexpr (kIsScalar<T> || ConfigEnum<T> || kIsEigen<T> || kIsVector<T>) {
      out_.push_back(
          {key, format_value(value), unit_of(name), std::string(meaning) + choices(value)});
    } else if constexpr (kIsMap<T>) {
      if (value.empty()) {
        out_.push_back({key, "{}", "", std::string(meaning)});
        return;
      }
      if (sections_) out_.push_back({key, "", "", std::string(meaning)});
      Lister nested(key + ".", out_, sections_);
      for (auto& [given, section] : value) nested(given, section, "");
    } else if constexpr (OpenSection<T>) {
      if (sections_) out_.push_back({key, "", "", std::string(meaning)});
      for (ParameterInfo& leaf : value.parameters()) {
        if (leaf.value.empty() && !sections_) continue;
        leaf.key = key + "." + leaf.key;
        out_.push_back(std::move(leaf));
      }
    } else {
      if (sections_) out_.push_back({key, "", "", std::string(meaning)});
      Lister nested(key + ".", out_, sections_);
      value.fields(nested);
    }
  }
  void check(bool, std::string_view) {}

 private:
  std::string prefix_;
  std::vector<ParameterInfo>& out_;
  bool sections_;
};

}  // namespace config_detail

/// Fills `config` from a map; keys that are absent keep their defaults. @throws ConfigError.
template <class T>
void read_config(const ConfigNode& node, T& config) {
  config_detail::read_value(node, "the file", config);
}

/// Every leaf of a config struct in the order of its fields.
template <class T>
std::vector<ParameterInfo> list_parameters(T config) {
  std::vector<ParameterInfo> out;
  config_detail::Lister lister("", out, false);
  config.fields(lister);
  return out;
}

/// The same with an entry before the first leaf of each section, whose value is empty and whose
/// meaning is the section's.
template <class T>
std::vector<ParameterInfo> describe_parameters(T config) {
  std::vector<ParameterInfo> out;
  config_detail::Lister lister("", out, true);
  config.fields(lister);
  return out;
}

/// Only those that a section gives, validated.
template <class T>
std::vector<ParameterInfo> given_parameters(const ConfigNode& section) {
  T config;
  read_config(section, config);
  std::vector<ParameterInfo> given = list_parameters(config);
  std::erase_if(given, [&](const ParameterInfo& parameter) {
    return config_detail::find_dotted(section, parameter.key) == nullptr;
  });
  return given;
}

/// The block YAML of a list of parameters; reading it back gives the same bits.
std::string write_yaml(const std::vector<ParameterInfo>& parameters);

}  // namespace arex
