#include "clouds/cloud_fields.h"

#include <algorithm>
#include <charconv>
#include <limits>

#include "config/config.h"
#include "config/text.h"

namespace arex::cloud_fields {

void refuse(const std::string& what) { throw ConfigError(what); }

std::optional<double> parse_number(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error == std::errc::result_out_of_range) return std::numeric_limits<double>::quiet_NaN();
  if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return value;
}

std::size_t parse_count(std::string_view word, const std::string& name, std::size_t most) {
  std::size_t value = 0;
  const char* last = word.data() + word.size();
  const auto [end, error] = std::from_chars(word.data(), last, value);
  if (error != std::errc() || end != last || value > most) {
    refuse(name + " is '" + shortened(std::string(word), 40) + "', expected a whole number up to " +
           std::to_string(most));
  }
  return value;
}

void expect_padding(std::string_view rest, std::size_t points) {
  constexpr std::string_view kPadding(" \t\r\n\v\f\0", 7);
  if (rest.find_first_not_of(kPadding) == std::string_view::npos) return;
  refuse("goes on behind its " + std::to_string(points) + " points, expected its end");
}

std::string_view next_word(std::string_view& line) {
  constexpr std::string_view kBlank = " \t\r\v\f";
  line.remove_prefix(std::min(line.find_first_not_of(kBlank), line.size()));
  const std::string_view word = line.substr(0, line.find_first_of(kBlank));
  line.remove_prefix(word.size());
  return word;
}

std::string_view next_line(std::string_view& text) {
  const std::size_t end = text.find('\n');
  std::string_view line = text.substr(0, end);
  text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

}  // namespace arex::cloud_fields
