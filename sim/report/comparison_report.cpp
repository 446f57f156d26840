#include "report/comparison_report.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "report/page.h"
#include "report/payload.h"

namespace arex::sim {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t kMaxCells = 250'000;  // of the page's table: about 3 MB
constexpr std::size_t kMaxLinks = 12;       // to the runs of one cause

// Kept when a table is too large to be kept whole.
constexpr const char* kMainFigures[] = {
    "outcome",         "reason",         "sim_time_s",          "distance_m",
    "coverage.t95_s",  "collisions",     "coverage.t90_s",      "coverage.area_fraction",
    "clearance.min_m", "map.median_m",   "odometry.ate_rmse_m", "coverage.surface_fraction",
    "battery.used_wh", "map.p95_m",      "planner.failures",    "odometry.yaw_error_max_deg",
    "tracking.rmse_m", "planner.p99_ms", "odometry.ate_max_m",  "odometry.lost_s"};

std::string link_to(const std::filesystem::path& run, const std::filesystem::path& directory) {
  if (!std::filesystem::exists(run)) return {};
  const std::filesystem::path page = run / "report.html";
  const bool reported = std::filesystem::exists(page);
  const std::filesystem::path relative =
      std::filesystem::absolute(reported ? page : run)
          .lexically_normal()
          .lexically_relative(std::filesystem::absolute(directory).lexically_normal());
  // A browser must not take a name for a scheme or a query.
  std::string link = "./";
  for (const char c : relative.generic_string()) {
    if (c == '%' || c == '?' || c == '#' || c == ' ') {
      static constexpr char kHex[] = "0123456789ABCDEF";
      link += {'%', kHex[c >> 4 & 15], kHex[c & 15]};
    } else {
      link += c;
    }
  }
  return reported ? link : link + "/";
}

// Why a run is no success: how it broke, or how its mission ended. Empty for a success.
std::string cause_of(const Table& table, std::size_t row) {
  const std::string failure = table.text(row, "failure");
  if (!failure.empty()) return failure;
  const std::string outcome = table.text(row, "outcome");
  return outcome == "succeeded" ? "" : outcome;
}

std::string failures_html(const ResultTable& results, const std::filesystem::path& directory) {
  const Table& table = results.table;
  // By typed cause; within it the reasons as the runs told them.
  std::map<std::string, std::map<std::string, std::vector<std::size_t>>> causes;
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    const std::string cause = cause_of(table, i);
    if (cause.empty()) continue;
    const std::string detail = table.text(i, "detail");
    causes[cause][detail.empty() ? table.text(i, "reason") : detail].push_back(i);
  }
  std::string html = "<section>\n<h2>Failures by cause</h2>\n";
  if (causes.empty()) return html + "<p>None: every run succeeded.</p>\n</section>\n";
  html +=
      "<div class=\"scroll\"><table class=\"data\">\n<thead><tr><th class=\"word\">cause</th>"
      "<th>runs</th><th class=\"text\">told as</th><th class=\"text\">which</th></tr></thead>\n"
      "<tbody>\n";
  for (const auto& [cause, reasons] : causes) {
    for (const auto& [reason, rows] : reasons) {
      html += "<tr><td class=\"word\">" + escape_markup(cause) + "</td><td>" +
              std::to_string(rows.size()) + "</td><td class=\"text\">" + escape_markup(reason) +
              "</td><td class=\"text\">";
      for (std::size_t i = 0; i < std::min(rows.size(), kMaxLinks); ++i) {
        const std::filesystem::path& folder = results.folders[rows[i]];
        const std::string link = link_to(folder, directory);
        const std::string name = escape_markup(folder.filename().string());
        html +=
            link.empty() ? name + " " : "<a href=\"" + escape_markup(link) + "\">" + name + "</a> ";
      }
      if (rows.size() > kMaxLinks) html += "…";
      html += "</td></tr>\n";
    }
  }
  return html + "</tbody>\n</table></div>\n</section>\n";
}

std::string header_html(const ResultTable& results, const std::string& title) {
  const Table& table = results.table;
  std::map<std::string, std::size_t> counts;
  std::set<std::string> seeds;
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    const std::string cause = cause_of(table, i);
    ++counts[cause.empty() ? "succeeded" : cause];
    seeds.insert(table.text(i, "seed"));
  }
  std::vector<KeyFigure> figures{{"Runs", std::to_string(table.rows.size()), ""},
                                 {"Seeds", std::to_string(seeds.size()), ""}};
  for (const auto& [cause, count] : counts) {
    figures.push_back({cause, std::to_string(count), ""});
  }
  std::string html = "<h1>" + escape_markup(title) + "</h1>\n";
  std::string varied;
  for (const std::string& key : results.keys) {
    std::set<std::string> values;
    for (std::size_t i = 0; i < table.rows.size(); ++i) values.insert(table.text(i, key));
    if (values.size() < 2) continue;
    varied += (varied.empty() ? "<p>Varied: " : ", ");
    varied +=
        "<code>" + escape_markup(key) + "</code> (" + std::to_string(values.size()) + " values)";
  }
  if (!varied.empty()) html += varied + "</p>\n";
  return html + key_figures_html(figures);
}

}  // namespace

ordered_json comparison_payload(const ResultTable& results,
                                const std::filesystem::path& directory) {
  const Table& table = results.table;
  std::vector<std::size_t> columns;
  const bool whole = table.columns.size() * table.rows.size() <= kMaxCells;
  for (std::size_t i = 0; i < table.columns.size(); ++i) {
    const bool is_key = i < results.keys.size() + 2;  // seed and failure as well
    const bool is_main = std::find(std::begin(kMainFigures), std::end(kMainFigures),
                                   table.columns[i]) != std::end(kMainFigures);
    if (whole || is_key || is_main) columns.push_back(i);
  }
  ordered_json names = ordered_json::array();
  for (const std::size_t column : columns) names.push_back(table.columns[column]);
  ordered_json rows = ordered_json::array();
  ordered_json links = ordered_json::array();
  ordered_json runs = ordered_json::array();
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    ordered_json row = ordered_json::array();
    for (const std::size_t column : columns) {
      const std::string& cell = table.rows[i][column];
      // A seed is a name: JavaScript's numbers would round the large ones.
      const auto number = table.columns[column] == "seed" ? std::nullopt : parse_number(cell);
      if (number) {
        row.push_back(*number);
      } else if (cell.empty()) {
        row.push_back(nullptr);
      } else {
        row.push_back(cell);
      }
    }
    rows.push_back(std::move(row));
    runs.push_back(results.folders[i].filename().string());
    links.push_back(link_to(results.folders[i], directory));
  }
  return {{"kind", "sweep"}, {"keys", results.keys}, {"columns", names},
          {"rows", rows},    {"runs", runs},         {"links", links}};
}

std::string comparison_report_html(const ResultTable& results, const std::string& title,
                                   const std::filesystem::path& directory) {
  std::string html = header_html(results, title);
  html +=
      "<noscript><p class=\"notice\">Curves, heat map and the table of runs need JavaScript; "
      "the numbers are in sweep.csv.</p></noscript>\n";
  html += "<section id=\"figures\"></section>\n";
  html += failures_html(results, directory);
  html += "<section id=\"side\"></section>\n<section id=\"runs\"></section>\n";
  return report_page("AREX: " + title, html, comparison_payload(results, directory));
}

}  // namespace arex::sim
