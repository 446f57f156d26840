#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "config/config.h"

namespace arex::sim {

/// A condition on a run's summary: `coverage.area_fraction>=0.95`, `outcome==succeeded`.
struct Requirement {
  enum class Relation { kAtLeast, kAtMost, kEqual, kUnequal, kMore, kLess };
  std::string text;  ///< as it was given
  std::string key;   ///< dotted; a list's length is `targets.count`
  Relation relation = Relation::kEqual;
  std::string value;
};

/// @throws ConfigError for what is no condition, a field that is none of figure_list(), or a value
/// that such a field cannot have.
Requirement parse_requirement(const std::string& text);

/// Why it is not met, in one line; empty if it is. A field that the summary has no value for meets
/// nothing.
std::string violation(const Requirement& requirement, const nlohmann::ordered_json& summary);

/// The run as a JUnit test suite: the mission is a test, and so is every requirement.
std::string junit_xml(const nlohmann::ordered_json& summary,
                      const std::vector<Requirement>& requirements);

}  // namespace arex::sim
