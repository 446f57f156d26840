#include "report/comparison_report.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "report/page.h"
#include "report/payload.h"
#include "scoring/figures.h"

namespace arex::sim {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t kMaxCells = 250'000;  // of the page's table: about 3 MB
constexpr std::size_t kMaxLinks = 12;       // to the runs of one cause

// Columns of words, whatever digits stand in them: a seed read as a number loses its last ones.
bool is_text(const std::string& column) {
  const FigureInfo* figure = find_figure(column);
  if (figure) return figure->kind == FigureInfo::Kind::kText || column == "seed";
  return column == "scenario" || column == "variant" || column == "sweep" || column == "failure" ||
         column == "detail" || column.ends_with(".seed");
}

ordered_json cell_json(const std::string& column, const std::string& cell) {
  if (cell.empty()) return nullptr;
  const auto number = is_text(column) ? std::nullopt : parse_number(cell);
  return number ? ordered_json(*number) : ordered_json(cell);
}

// What scripts/report/src/payload.ts calls FigureInfo.
ordered_json figures_json(const std::vector<std::string>& columns) {
  ordered_json figures = ordered_json::object();
  for (const std::string& column : columns) {
    const FigureInfo* figure = find_figure(column);
    if (!figure) continue;
    const int better = figure->better == Better::kMore   ? 1
                       : figure->better == Better::kLess ? -1
                                                         : 0;
    figures[column] = {{"label", figure->label},
                       {"unit", figure->unit},
                       {"better", better},
                       {"main", figure->main}};
  }
  return figures;
}

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
  if (outcome.empty()) return "without outcome";
  return outcome == "succeeded" ? "" : outcome;
}

// What was not flown to an end of its own is neither a success nor a failure; as in results.ts.
bool was_flown(const std::string& cause) {
  return cause != "missing" && cause != "refused" && cause != "unfinished" &&
         cause != "interrupted";
}

// How many of how many, with Wilson's 95 % interval of the share; of fewer than three runs it would
// say next to nothing.
std::string share_text(std::size_t part, std::size_t whole) {
  if (whole == 0) return "none was flown";
  const std::string counted = "of " + std::to_string(whole) + " flown";
  if (whole < 3) return counted;
  constexpr double kZ = 1.95996;
  const auto n = static_cast<double>(whole);
  const double p = static_cast<double>(part) / n;
  const double scale = 1 / (1 + kZ * kZ / n);
  const double middle = scale * (p + kZ * kZ / (2 * n));
  const double half = scale * kZ * std::sqrt(p * (1 - p) / n + kZ * kZ / (4 * n * n));
  const auto percent = [](double share) { return number_text(std::round(100 * share)); };
  return counted + ": " + percent_text(p) + ", 95 % interval " + percent(middle - half) + " to " +
         percent(middle + half) + " %";
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
  if (table.rows.empty()) return html + "<p>No run was flown.</p>\n</section>\n";
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
        const std::string name = escape_markup(run_title(results, rows[i]));
        html += i > 0 ? "; " : "";
        html += link.empty() ? name : "<a href=\"" + escape_markup(link) + "\">" + name + "</a>";
      }
      if (rows.size() > kMaxLinks) html += "; …";
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
    if (const std::string seed = table.text(i, "seed"); !seed.empty()) seeds.insert(seed);
  }
  std::vector<KeyFigure> figures{{"Runs", std::to_string(table.rows.size()), ""},
                                 {"Seeds", std::to_string(seeds.size()), ""}};
  const std::size_t successes = counts["succeeded"];
  counts.erase("succeeded");
  std::size_t flown = successes;
  for (const auto& [cause, count] : counts) flown += was_flown(cause) ? count : 0;
  figures.push_back({"succeeded", std::to_string(successes), share_text(successes, flown)});
  for (const auto& [cause, count] : counts) figures.push_back({cause, std::to_string(count), ""});
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
    const FigureInfo* figure = find_figure(table.columns[i]);
    const bool is_main = figure && figure->main;
    if (whole || is_key || is_main) columns.push_back(i);
  }
  std::vector<std::string> names;
  for (const std::size_t column : columns) names.push_back(table.columns[column]);
  ordered_json rows = ordered_json::array();
  ordered_json links = ordered_json::array();
  ordered_json runs = ordered_json::array();
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    ordered_json row = ordered_json::array();
    for (const std::size_t column : columns) {
      row.push_back(cell_json(table.columns[column], table.rows[i][column]));
    }
    rows.push_back(std::move(row));
    runs.push_back(results.folders[i].filename().string());
    links.push_back(link_to(results.folders[i], directory));
  }
  return {{"kind", "sweep"},      {"figures", figures_json(names)},
          {"keys", results.keys}, {"columns", names},
          {"rows", rows},         {"runs", runs},
          {"links", links}};
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
