#pragma once

#include <CLI/CLI.hpp>
#include <limits>
#include <optional>
#include <string>
#include <type_traits>

#include "config/config.h"
#include "config/text.h"

namespace arex::app {

namespace number_option_detail {

inline std::optional<int> parse(const std::string& text, int) { return parse_int(text); }
inline std::optional<std::uint64_t> parse(const std::string& text, std::uint64_t) {
  return parse_uint64(text);
}
inline std::optional<double> parse(const std::string& text, double) { return parse_double(text); }

}  // namespace number_option_detail

/// What an option's number may be, both ends included.
template <class T>
struct Range {
  T least = std::numeric_limits<T>::lowest();
  T most = std::numeric_limits<T>::max();
};

/// An option that takes a number: int, std::uint64_t or double, read as the same number in a
/// scenario is. CLI11's own conversion takes 010 for eight, and saturates.
/// @param value what to set, a Number or an optional one
template <class Number, class Value>
CLI::Option* add_number(CLI::App& command, const std::string& name, Value& value,
                        const Range<Number>& range, const std::string& meaning) {
  const auto read = [&value, name, range](const std::string& text) {
    const auto number = number_option_detail::parse(text, Number{});
    if (!number || *number < range.least || *number > range.most) {
      std::string expected = std::is_same_v<Number, double> ? "a number" : "an integer";
      expected += " from " + config_detail::format_scalar(range.least) + " to " +
                  config_detail::format_scalar(range.most);
      throw CLI::ValidationError(name, "is '" + shortened(text) + "', expected " + expected);
    }
    value = *number;
  };
  CLI::Option* option = command.add_option_function<std::string>(name, read, meaning);
  option->type_name(std::is_same_v<Number, double> ? "NUMBER" : "INTEGER");
  if constexpr (std::is_same_v<Number, Value>) {
    option->default_str(config_detail::format_scalar(value));
  }
  return option;
}

}  // namespace arex::app
