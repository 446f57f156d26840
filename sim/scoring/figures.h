#pragma once

#include <concepts>
#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

/// The one list of what a run is scored by. A figure stands in it once; summary.json, --require,
/// sweep.csv, the reports and `arex help figures` read it from here.
namespace arex::sim {

/// Which way a figure is better, other things being equal.
enum class Better : std::uint8_t { kNeither, kMore, kLess };

/// Stands in a key for a name that the scenario gives: odometries.NAME.ate_rmse_m.
inline constexpr std::string_view kNamePart = "NAME";

struct FigureInfo {
  enum class Kind : std::uint8_t { kNumber, kText, kList };

  std::string key;      ///< dotted, as in summary.json
  std::string label;    ///< in words
  std::string unit;     ///< "1": a share; empty: a count or a text
  Better better;        ///< of two runs that both succeeded
  bool main;            ///< shown first, and kept where a table must be cut
  std::string meaning;  ///< and when it has no value
  Kind kind = Kind::kNumber;
  bool of_host = false;  ///< a time of the host: two runs of one scenario differ in it

  /// The name of its one cell in a table: a list counts by its length, `targets.count`.
  [[nodiscard]] std::string column() const;
  /// Whether its key holds kNamePart.
  [[nodiscard]] bool is_named() const;
  /// The name that a column gives it; nothing if the column is none of its.
  [[nodiscard]] std::optional<std::string> name_in(std::string_view column) const;
  /// The figure with this name in its key.
  [[nodiscard]] FigureInfo named(std::string_view name) const;
};

/// Every figure of summary.json in its order.
const std::vector<FigureInfo>& figure_list();

/// The same with each figure that is named once for every name that the summary gives it.
std::vector<FigureInfo> figures_in(const nlohmann::ordered_json& summary);

/// The figure of a table's column; null if there is none.
const FigureInfo* find_figure(std::string_view column);

/// One column of a file of the run folder or of a sweep, or one member of a list of summary.json.
struct ColumnInfo {
  std::string file;
  std::string name;
  std::string unit;
  std::string meaning;
};

/// The columns that are no figures of the summary, file by file in their order.
const std::vector<ColumnInfo>& column_list();

/// The first line of a CSV file of the run folder: names from column_list(), the line's end.
std::string csv_header(std::string_view file);

/// A number for a CSV cell; nothing where there was nothing to measure (not a number).
std::string csv_number(double value, int decimals);

/// The figures of one run. What nobody sets was not measured and is null.
class Figures {
 public:
  /// One member of a list: its named numbers.
  using Item = std::vector<std::pair<std::string, double>>;

  /// @param value not finite: not measured. @throws std::logic_error for a key that is not listed
  void set(std::string_view key, double value);
  void set(std::string_view key, const std::optional<double>& value);
  void set(std::string_view key, std::string_view text);
  void set(std::string_view key, const char* text) { set(key, std::string_view(text)); }
  void set(std::string_view key, std::integral auto count) {
    put(key, static_cast<std::uint64_t>(count));
  }
  /// A figure that is a list.
  void set(std::string_view key, std::vector<Item> items);

  /// summary.json: every key of the list. A section without any value is null itself.
  [[nodiscard]] nlohmann::ordered_json json() const;

 private:
  using Value = std::variant<double, std::uint64_t, std::string, std::vector<Item>>;
  void put(std::string_view key, Value value);
  static nlohmann::ordered_json json_of(const Value& value);

  std::map<std::string, Value, std::less<>> values_;
};

}  // namespace arex::sim
