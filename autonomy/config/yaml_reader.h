#pragma once

#include <string>

#include "config/config.h"

namespace arex::config_detail {

/// How the nodes of a text say where they stand.
enum class Positions {
  kLines,  ///< "NAME:LINE"
  kName,   ///< "NAME": a value given on the command line
};

/// Reads one YAML document without trusting it: size, depth and number of values are bounded, so
/// that any text is read or refused within a second. Aliases are expanded. Refused are a second
/// document, an alias inside of what it names, merge keys, tags, duplicate keys, control characters
/// and what is no UTF-8.
/// @throws ConfigError at the place of what is refused.
ConfigNode read_yaml(const std::string& text, const std::string& name, Positions positions);

/// Longest text that read_yaml takes, bytes.
inline constexpr std::size_t kLongestYaml = std::size_t{1} << 20U;

}  // namespace arex::config_detail
