#include "report/result_table.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "config/config.h"
#include "report/run_record.h"

namespace arex::sim {
namespace {

using nlohmann::ordered_json;
using Cells = std::vector<std::pair<std::string, std::string>>;

constexpr std::size_t kMaxDifferingKeys = 8;  // more: other scenarios, which are named instead

/// One run on its way into the table.
struct ResultRow {
  Cells keys;
  Cells rest;  ///< seed, failure, detail and the summary
  std::filesystem::path folder;
};

std::string dotted(const std::string& key, const std::string& name) {
  std::string text = key;
  if (!text.empty()) text += '.';
  return text += name;
}

// A list counts by its length, as in sweep.csv.
void flatten_json(const ordered_json& value, const std::string& key, Cells& cells) {
  if (value.is_object()) {
    for (const auto& [name, child] : value.items()) {
      flatten_json(child, dotted(key, name), cells);
    }
  } else if (value.is_array()) {
    cells.emplace_back(key + ".count", std::to_string(value.size()));
  } else if (!value.is_null()) {
    cells.emplace_back(key, value.is_string() ? value.get<std::string>() : value.dump());
  }
}

void flatten_yaml(const ConfigNode& node, const std::string& key, Cells& cells) {
  switch (node.kind) {
    case ConfigNode::Kind::kMap:
      for (const ConfigNode::Entry& entry : node.entries) {
        flatten_yaml(entry.value, dotted(key, entry.key), cells);
      }
      return;
    case ConfigNode::Kind::kSequence: {
      Cells items;
      for (const ConfigNode& item : node.items) flatten_yaml(item, "", items);
      std::string text;
      for (const auto& [name, value] : items) {
        text += text.empty() ? "" : " ";
        if (!name.empty()) text += name + "=";
        text += value;
      }
      cells.emplace_back(key, text);
      return;
    }
    case ConfigNode::Kind::kNull:
    case ConfigNode::Kind::kScalar:
      cells.emplace_back(key, node.scalar);
  }
}

// Rows of a sweep: run,scenario[,variant],KEYS...,seed[,repeat],failure,detail,SUMMARY...
std::vector<ResultRow> sweep_rows(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / "sweep.csv";
  if (!std::filesystem::exists(file)) {
    throw ConfigError(file.string() +
                      ":1: is not there yet, expected a sweep that has ended; arex "
                      "sweep writes it");
  }
  const Table table = read_table(file);
  const auto run = table.column("run");
  const auto seed = table.column("seed");
  if (!run || !seed) {
    throw ConfigError(file.string() + ":1: expected the columns run and seed of arex sweep");
  }
  std::vector<ResultRow> rows;
  for (const auto& cells : table.rows) {
    ResultRow row;
    row.folder = folder / cells[*run];
    // What is left of a run that broke stands beside.
    const std::filesystem::path failed = row.folder.string() + ".failed";
    if (!std::filesystem::exists(row.folder) && std::filesystem::exists(failed))
      row.folder = failed;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      if (i == *run) continue;
      (i < *seed ? row.keys : row.rest).emplace_back(table.columns[i], cells[i]);
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

ResultRow run_row(const std::filesystem::path& folder) {
  ResultRow row;
  row.folder = folder;
  const auto summary = read_summary(folder);
  Cells figures;
  std::string scenario = folder.filename().string();
  std::string seed;
  if (summary) flatten_json(*summary, "", figures);
  Cells rest;
  for (auto& [key, value] : figures) {
    if (key == "scenario") {
      scenario = value;
    } else if (key == "seed") {
      seed = value;
    } else {
      rest.emplace_back(key, value);
    }
  }
  row.keys.emplace_back("scenario", scenario);
  row.rest = {{"seed", seed}, {"failure", summary ? "" : "unfinished"}, {"detail", ""}};
  row.rest.insert(row.rest.end(), rest.begin(), rest.end());
  return row;
}

// The keys of resolved.yaml in which runs differ; none if they differ in too many.
void add_differing_keys(std::vector<ResultRow>& rows) {
  std::vector<std::map<std::string, std::string>> values;
  std::vector<std::string> keys;
  for (const ResultRow& row : rows) {
    const Cells cells = resolved_keys(row.folder);
    for (const auto& [key, value] : cells) {
      if (std::find(keys.begin(), keys.end(), key) == keys.end()) keys.push_back(key);
    }
    values.emplace_back(cells.begin(), cells.end());
  }
  std::erase_if(keys, [&](const std::string& key) {
    const auto same = [&](auto& of_run) {
      const auto found = of_run.find(key);
      return found != of_run.end() && values.front().contains(key) &&
             found->second == values.front().at(key);
    };
    return key == "seed" || std::all_of(values.begin(), values.end(), same);
  });
  if (keys.size() > kMaxDifferingKeys) return;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (const std::string& key : keys) rows[i].keys.emplace_back(key, values[i][key]);
  }
}

// The last parts of dotted keys, or all of a key whose last part another one has as well.
std::vector<std::string> names_of(const std::vector<std::string>& keys) {
  std::map<std::string, int> counts;
  const auto last = [](const std::string& key) { return key.substr(key.rfind('.') + 1); };
  for (const std::string& key : keys) ++counts[last(key)];
  std::vector<std::string> names;
  names.reserve(keys.size());
  for (const std::string& key : keys) names.push_back(counts[last(key)] > 1 ? key : last(key));
  return names;
}

bool varies(const Table& table, const std::string& key) {
  for (std::size_t i = 1; i < table.rows.size(); ++i) {
    if (table.text(i, key) != table.text(0, key)) return true;
  }
  return false;
}

// Columns in the order of their first appearance.
void add_columns(const Cells& cells, std::vector<std::string>& columns,
                 std::set<std::string>& known) {
  for (const auto& [name, value] : cells) {
    if (known.insert(name).second) columns.push_back(name);
  }
}

}  // namespace

bool is_sweep_folder(const std::filesystem::path& folder) {
  return std::filesystem::exists(folder / "sweep.csv") ||
         std::filesystem::exists(folder / "sweep.json");
}

ResultTable read_results(const std::vector<std::filesystem::path>& folders) {
  std::vector<ResultRow> rows;
  std::vector<ResultRow> runs;
  const auto sweeps = std::count_if(folders.begin(), folders.end(), is_sweep_folder);
  for (const std::filesystem::path& folder : folders) {
    if (is_sweep_folder(folder)) {
      for (ResultRow& row : sweep_rows(folder)) {
        if (sweeps > 1) row.keys.insert(row.keys.begin(), {"sweep", folder.filename().string()});
        rows.push_back(std::move(row));
      }
    } else if (is_run_folder(folder)) {
      runs.push_back(run_row(folder));
    } else {
      throw ConfigError(folder.string() + ":1: expected a run folder or the folder of a sweep");
    }
  }
  if (!runs.empty()) add_differing_keys(runs);
  rows.insert(rows.end(), runs.begin(), runs.end());

  ResultTable results;
  std::set<std::string> known;
  add_columns({{"seed", ""}, {"failure", ""}, {"detail", ""}}, results.table.columns, known);
  results.table.columns.clear();
  for (const ResultRow& row : rows) add_columns(row.keys, results.keys, known);
  results.table.columns = results.keys;
  results.table.columns.insert(results.table.columns.end(), {"seed", "failure", "detail"});
  for (const ResultRow& row : rows) add_columns(row.rest, results.table.columns, known);
  for (const ResultRow& row : rows) {
    std::map<std::string, std::string> cells(row.keys.begin(), row.keys.end());
    cells.insert(row.rest.begin(), row.rest.end());
    std::vector<std::string> line;
    for (const std::string& column : results.table.columns) {
      const auto found = cells.find(column);
      line.push_back(found == cells.end() ? "" : found->second);
    }
    results.table.rows.push_back(std::move(line));
    results.folders.push_back(row.folder);
  }
  return results;
}

std::vector<std::pair<std::string, std::string>> resolved_keys(const std::filesystem::path& run) {
  Cells cells;
  const std::filesystem::path file = run / "resolved.yaml";
  if (const auto yaml = read_bytes(file)) flatten_yaml(parse_yaml(*yaml, file.string()), "", cells);
  return cells;
}

std::vector<std::string> configuration_titles(const ResultTable& results) {
  const Table& table = results.table;
  std::vector<std::string> titles(table.rows.size());
  const std::vector<std::string> names = names_of(results.keys);
  for (std::size_t k = 0; k < results.keys.size(); ++k) {
    const std::string& key = results.keys[k];
    if (!varies(table, key)) continue;
    // These have values that are words of their own.
    const bool bare = key == "scenario" || key == "variant" || key == "sweep";
    for (std::size_t i = 0; i < titles.size(); ++i) {
      const std::string value = table.text(i, key);
      if (bare && value.empty()) continue;
      if (!titles[i].empty()) titles[i] += ", ";
      titles[i] += bare ? value : names[k] + " " + (value.empty() ? "–" : value);
    }
  }
  return titles;
}

std::vector<std::string> run_titles(const ResultTable& results) {
  std::vector<std::string> titles = configuration_titles(results);
  std::map<std::string, std::size_t> counts;
  for (std::size_t i = 0; i < titles.size(); ++i) {
    const std::string seed = results.table.text(i, "seed");
    if (!seed.empty()) titles[i] += (titles[i].empty() ? "seed " : ", seed ") + seed;
    ++counts[titles[i]];
  }
  for (std::size_t i = 0; i < titles.size(); ++i) {
    if (!titles[i].empty() && counts[titles[i]] == 1) continue;
    titles[i] += (titles[i].empty() ? "" : ", ") + results.folders[i].filename().string();
  }
  return titles;
}

std::string run_title(const ResultTable& results, std::size_t row) {
  return run_titles(results)[row];
}

std::string title_in_sweep(const std::filesystem::path& run_folder) {
  const std::filesystem::path sweep = run_folder.parent_path().parent_path();
  if (!std::filesystem::exists(sweep / "sweep.csv")) return {};
  const ResultTable results = read_results({sweep});
  const auto found = std::find(results.folders.begin(), results.folders.end(), run_folder);
  if (found == results.folders.end()) return {};
  return run_title(results, static_cast<std::size_t>(found - results.folders.begin()));
}

}  // namespace arex::sim
