#include "report/table.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>
#include <sstream>

namespace arex::sim {

std::optional<std::size_t> Table::column(std::string_view name) const {
  const auto found = std::find(columns.begin(), columns.end(), name);
  if (found == columns.end()) return std::nullopt;
  return static_cast<std::size_t>(found - columns.begin());
}

std::vector<double> Table::numbers(std::string_view name) const {
  const auto index = column(name);
  std::vector<double> values(rows.size(), std::numeric_limits<double>::quiet_NaN());
  for (std::size_t i = 0; index && i < rows.size(); ++i) {
    values[i] = parse_number(rows[i][*index]).value_or(values[i]);
  }
  return values;
}

std::string Table::text(std::size_t row, std::string_view name) const {
  const auto index = column(name);
  return index ? rows[row][*index] : std::string();
}

Table parse_table(std::string_view text) {
  Table table;
  std::vector<std::string> row(1);
  bool quoted = false;
  const auto end_row = [&] {
    if (table.columns.empty()) {
      table.columns = std::move(row);
    } else if (row.size() == table.columns.size()) {
      table.rows.push_back(std::move(row));
    }
    row.assign(1, {});
  };
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (quoted) {
      if (c != '"') {
        row.back() += c;
      } else if (i + 1 < text.size() && text[i + 1] == '"') {
        row.back() += text[++i];
      } else {
        quoted = false;
      }
    } else if (c == '"') {
      quoted = true;
    } else if (c == ',') {
      row.emplace_back();
    } else if (c == '\n') {
      end_row();
    } else if (c != '\r') {
      row.back() += c;
    }
  }
  return table;  // a row without its line's end was being written
}

Table read_table(const std::filesystem::path& file) {
  const auto bytes = read_bytes(file);
  return bytes ? parse_table(*bytes) : Table();
}

std::optional<double> parse_number(std::string_view cell) {
  double value = 0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (error != std::errc() || end != cell.data() + cell.size() || !std::isfinite(value)) {
    return std::nullopt;
  }
  return value;
}

std::optional<std::string> read_bytes(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream || std::filesystem::is_directory(file)) return std::nullopt;
  std::ostringstream bytes;
  bytes << stream.rdbuf();
  return std::move(bytes).str();
}

}  // namespace arex::sim
