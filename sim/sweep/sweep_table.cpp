#include "sweep/sweep_table.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "run/summary.h"
#include "scoring/figures.h"

namespace arex::sim {
namespace {

using nlohmann::ordered_json;
using Fields = std::vector<std::pair<std::string, std::string>>;

/// The columns of rows that do not all have the same ones.
class Columns {
 public:
  /// A new key goes behind the one that stands before it in its row.
  void add(const Fields& fields) {
    std::size_t at = 0;
    for (const auto& [key, text] : fields) {
      const auto found = std::find(keys_.begin(), keys_.end(), key);
      if (found != keys_.end()) {
        at = static_cast<std::size_t>(found - keys_.begin()) + 1;
      } else {
        keys_.insert(keys_.begin() + static_cast<std::ptrdiff_t>(at++), key);
      }
    }
  }
  /// Without the empty sections that other rows spell out.
  [[nodiscard]] std::vector<std::string> keys() const {
    std::vector<std::string> keys;
    for (const std::string& key : keys_) {
      const auto inside = [&](const std::string& k) { return k.starts_with(key + "."); };
      if (std::none_of(keys_.begin(), keys_.end(), inside)) keys.push_back(key);
    }
    return keys;
  }

 private:
  std::vector<std::string> keys_;
};

std::string joined(const std::vector<std::string>& cells) {
  std::string line;
  for (std::size_t i = 0; i < cells.size(); ++i) line += (i ? "," : "") + csv_cell(cells[i]);
  return line + "\n";
}

/// A table whose rows come with named cells behind fixed ones.
class RowTable {
 public:
  /// @param expected columns that are there whatever the rows hold
  RowTable(std::vector<std::string> head, const Fields& expected) : head_(std::move(head)) {
    columns_.add(expected);
  }

  void add(std::vector<std::string> cells, Fields fields) {
    columns_.add(fields);
    rows_.push_back({std::move(cells), std::move(fields)});
  }
  [[nodiscard]] std::string text() const {
    const std::vector<std::string> keys = columns_.keys();
    std::vector<std::string> line = head_;
    line.insert(line.end(), keys.begin(), keys.end());
    std::string text = joined(line);
    for (const Row& row : rows_) {
      line = row.cells;
      for (const std::string& key : keys) {
        const auto field = std::find_if(row.fields.begin(), row.fields.end(),
                                        [&](const auto& f) { return f.first == key; });
        line.push_back(field == row.fields.end() ? "" : field->second);
      }
      text += joined(line);
    }
    return text;
  }

 private:
  struct Row {
    std::vector<std::string> cells;
    Fields fields;
  };
  std::vector<std::string> head_;
  Columns columns_;
  std::vector<Row> rows_;
};

// What identifies a run, in the order of the head.
std::vector<std::string> identity(const SweepPlan& plan, const PlannedRun& run,
                                  const std::filesystem::path& folder) {
  std::vector<std::string> cells{folder.string(), run.scenario};
  if (plan.has_variants) cells.push_back(run.variant);
  cells.insert(cells.end(), run.values.begin(), run.values.end());
  cells.push_back(std::to_string(run.seed));
  if (plan.repeats > 1) cells.push_back(std::to_string(run.repeat));
  return cells;
}

std::vector<std::string> identity_head(const SweepPlan& plan) {
  std::vector<std::string> head{"run", "scenario"};
  if (plan.has_variants) head.emplace_back("variant");
  head.insert(head.end(), plan.keys.begin(), plan.keys.end());
  head.emplace_back("seed");
  if (plan.repeats > 1) head.emplace_back("repeat");
  return head;
}

// The part of a summary that a table keeps: what stands in `identity` is left out.
Fields part_of(const Fields& fields, bool host) {
  Fields part;
  for (const auto& field : fields) {
    if (field.first == "scenario" || field.first == "seed") continue;
    if (depends_on_host(field.first) == host) part.push_back(field);
  }
  return part;
}

// Every figure's column, so that a table's columns do not depend on what its runs measured.
Fields empty_fields() {
  Fields fields;
  for (const FigureInfo& figure : figure_list()) {
    if (!figure.is_named()) fields.emplace_back(figure.column(), "");
  }
  return fields;
}

}  // namespace

SweepTables sweep_tables(const SweepPlan& plan, const SweepFolder& folder) {
  std::vector<std::string> head = identity_head(plan);
  RowTable host(head, part_of(empty_fields(), true));
  head.insert(head.end(), {"failure", "detail"});
  RowTable results(head, part_of(empty_fields(), false));
  for (const PlannedRun& run : plan.runs) {
    const auto summary = folder.summary(run.id);
    const RunState state = summary ? RunState{Failure::kNone, ""} : folder.state(run.id);
    const bool whole = state.failure == Failure::kNone || state.failure == Failure::kMissing;
    std::vector<std::string> cells =
        identity(plan, run, whole ? SweepFolder::finished(run.id) : SweepFolder::failed(run.id));
    const Fields fields = summary ? flatten(*summary) : Fields{};
    Fields clocks = summary ? flatten(folder.host(run.id)) : Fields{};
    for (auto& field : part_of(fields, true)) clocks.push_back(std::move(field));
    host.add(cells, std::move(clocks));
    cells.emplace_back(kFailureNames[static_cast<std::size_t>(state.failure)]);
    cells.push_back(state.detail);
    results.add(std::move(cells), part_of(fields, false));
  }
  return {results.text(), host.text()};
}

}  // namespace arex::sim
