#include "run/requirement.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>

#include "run/markup.h"
#include "scoring/figures.h"

namespace arex::sim {
namespace {

using nlohmann::ordered_json;
using Relation = Requirement::Relation;

// Two characters before one: '>=' begins with '>'.
constexpr std::array<std::pair<std::string_view, Relation>, 6> kRelations{{
    {">=", Relation::kAtLeast},
    {"<=", Relation::kAtMost},
    {"==", Relation::kEqual},
    {"!=", Relation::kUnequal},
    {">", Relation::kMore},
    {"<", Relation::kLess},
}};

template <class T>
std::optional<T> parse(const std::string& text) {
  T value{};
  const char* end = text.data() + text.size();
  const auto result = std::from_chars(text.data(), end, value);
  if (result.ec != std::errc() || result.ptr != end) return std::nullopt;
  return value;
}

std::optional<double> number(const std::string& text) {
  const auto value = parse<double>(text);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

std::string trimmed(const std::string& text) {
  const auto begin = text.find_first_not_of(' ');
  if (begin == std::string::npos) return "";
  return text.substr(begin, text.find_last_not_of(' ') - begin + 1);
}

// Null where the summary has no such field or no value for it.
ordered_json field_at(const ordered_json& summary, std::string_view key) {
  const ordered_json* node = &summary;
  while (!key.empty()) {
    const std::string name(key.substr(0, key.find('.')));
    key.remove_prefix(std::min(key.size(), name.size() + 1));
    if (node->is_array() && name == "count" && key.empty()) return node->size();
    if (!node->is_object() || !node->contains(name)) return nullptr;
    node = &(*node)[name];
  }
  return *node;
}

template <class T>
bool holds(T value, Relation relation, T bound) {
  switch (relation) {
    case Relation::kAtLeast:
      return value >= bound;
    case Relation::kAtMost:
      return value <= bound;
    case Relation::kEqual:
      return value == bound;
    case Relation::kUnequal:
      return value != bound;
    case Relation::kMore:
      return value > bound;
    default:
      return value < bound;
  }
}

// Seeds and counts are compared as what they are: beyond 2^53 a double is another number.
bool number_holds(const ordered_json& field, const Requirement& requirement) {
  const auto whole = parse<std::uint64_t>(requirement.value);
  if (whole && field.is_number_unsigned()) {
    return holds(field.get<std::uint64_t>(), requirement.relation, *whole);
  }
  return holds(field.get<double>(), requirement.relation, number(requirement.value).value());
}

const FigureInfo& figure_of(const Requirement& requirement, const std::string& where) {
  if (const FigureInfo* figure = find_figure(requirement.key)) return *figure;
  std::vector<std::string> known;
  for (const FigureInfo& figure : figure_list()) known.push_back(figure.column());
  ConfigNode node;
  node.entries.push_back({requirement.key, where, {}});
  config_detail::reject_unknown(node, known);
  return *find_figure(requirement.key);
}

std::string test_case(const std::string& suite, const std::string& name, const std::string& time,
                      const std::string& failure) {
  std::string text = "    <testcase classname=\"" + escape_markup(suite) + "\" name=\"" +
                     escape_markup(name) + "\" time=\"" + time + "\"";
  if (failure.empty()) return text + "/>\n";
  return text + ">\n      <failure message=\"" + escape_markup(failure) + "\"/>\n    </testcase>\n";
}

}  // namespace

Requirement parse_requirement(const std::string& text) {
  const std::string where = "--require " + text;
  Requirement requirement;
  requirement.text = text;
  const auto at = text.find_first_of("<>=!");
  for (const auto& [sign, relation] : kRelations) {
    if (at == std::string::npos || text.compare(at, sign.size(), sign) != 0) continue;
    requirement.relation = relation;
    requirement.key = trimmed(text.substr(0, at));
    requirement.value = trimmed(text.substr(at + sign.size()));
    break;
  }
  if (requirement.key.empty() || requirement.value.empty()) {
    config_detail::fail(where, "expected FIELD>=VALUE, or one of > <= < == !=");
  }
  if (figure_of(requirement, where).kind != FigureInfo::Kind::kText) {
    if (!number(requirement.value)) {
      config_detail::fail(where, "'" + requirement.value + "' is not a number, expected one");
    }
  } else if (requirement.relation != Relation::kEqual &&
             requirement.relation != Relation::kUnequal) {
    config_detail::fail(where, "'" + requirement.key + "' is a text, expected == or !=");
  }
  return requirement;
}

std::string violation(const Requirement& requirement, const ordered_json& summary) {
  const ordered_json field = field_at(summary, requirement.key);
  if (field.is_null()) return requirement.key + " has no value in this run";
  bool met = false;
  if (field.is_string()) {
    const bool same = field.get<std::string>() == requirement.value;
    met = same == (requirement.relation == Relation::kEqual);
  } else {
    met = number_holds(field, requirement);
  }
  if (met) return "";
  return requirement.key + " is " + (field.is_string() ? field.get<std::string>() : field.dump());
}

std::string junit_xml(const ordered_json& summary, const std::vector<Requirement>& requirements) {
  const std::string suite =
      "arex." + summary["scenario"].get<std::string>() + ".seed" + summary["seed"].dump();
  const std::string outcome = summary["outcome"].get<std::string>();
  const std::string time = summary["wall_time_s"].dump();
  int failures = 0;
  std::string cases;
  const auto add = [&](const std::string& name, const std::string& seconds,
                       const std::string& failure) {
    if (!failure.empty()) ++failures;
    cases += test_case(suite, name, seconds, failure);
  };
  add("mission", time,
      outcome == "succeeded" ? "" : outcome + ": " + summary["reason"].get<std::string>());
  for (const Requirement& requirement : requirements) {
    add(requirement.text, "0", violation(requirement, summary));
  }
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites>\n  <testsuite name=\"" +
         escape_markup(suite) + "\" tests=\"" + std::to_string(requirements.size() + 1) +
         "\" failures=\"" + std::to_string(failures) + "\" errors=\"0\" time=\"" + time + "\">\n" +
         cases + "  </testsuite>\n</testsuites>\n";
}

}  // namespace arex::sim
