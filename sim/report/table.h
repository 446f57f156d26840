#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace arex::sim {

/// A CSV file with a header: RFC 4180 quoting, cells as text. A last row cut short by a kill is
/// left out.
struct Table {
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;  ///< each as long as `columns`

  [[nodiscard]] std::optional<std::size_t> column(std::string_view name) const;
  /// Every row's number; not a number where the cell is empty or holds none, and in every row if
  /// there is no such column.
  [[nodiscard]] std::vector<double> numbers(std::string_view name) const;
  /// The cell, or nothing if there is no such column.
  [[nodiscard]] std::string text(std::size_t row, std::string_view name) const;
};

/// @return an empty table if the file is missing or empty.
Table read_table(const std::filesystem::path& file);
Table parse_table(std::string_view text);

/// The whole cell as a number; nothing else counts.
std::optional<double> parse_number(std::string_view cell);

/// A file's bytes; nothing if it cannot be read.
std::optional<std::string> read_bytes(const std::filesystem::path& file);

}  // namespace arex::sim
