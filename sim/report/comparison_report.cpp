#include "report/comparison_report.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "report/outcome_matrix.h"
#include "report/overlay.h"
#include "report/page.h"
#include "report/payload.h"
#include "scoring/figures.h"

namespace arex::sim {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t kMaxCells = 250'000;  // of the page's table: about 3 MB
constexpr std::size_t kMaxLinks = 12;       // to the runs of one cause
constexpr std::size_t kMaxPlainRows = 500;  // of the table that needs no script

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
    const auto name = figure->name_in(column);
    figures[column] = {{"label", (name ? figure->named(*name) : *figure).label},
                       {"unit", unit_text(figure->unit)},
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

std::string link_html(const std::filesystem::path& run, const std::filesystem::path& directory,
                      const std::string& title) {
  const std::string link = link_to(run, directory);
  if (link.empty()) return escape_markup(title);
  return "<a href=\"" + escape_markup(link) + "\">" + escape_markup(title) + "</a>";
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
  const std::vector<std::string> titles = run_titles(results);
  html +=
      "<div class=\"scroll\"><table class=\"data\">\n<thead><tr><th class=\"word\">cause</th>"
      "<th>runs</th><th class=\"text\">told as</th><th class=\"text\">which</th></tr></thead>\n"
      "<tbody>\n";
  for (const auto& [cause, reasons] : causes) {
    for (const auto& [reason, rows] : reasons) {
      html += "<tr><td class=\"word\">" + escape_markup(words(cause)) + "</td><td>" +
              std::to_string(rows.size()) + "</td><td class=\"text\">" + escape_markup(reason) +
              "</td><td class=\"text\">";
      for (std::size_t i = 0; i < std::min(rows.size(), kMaxLinks); ++i) {
        html += i > 0 ? "; " : "";
        html += link_html(results.folders[rows[i]], directory, titles[rows[i]]);
      }
      if (rows.size() > kMaxLinks) html += "; …";
      html += "</td></tr>\n";
    }
  }
  return html + "</tbody>\n</table></div>\n</section>\n";
}

// The main figures of each run, which the viewer replaces by a table that sorts.
std::string runs_html(const ResultTable& results, const std::filesystem::path& directory) {
  const Table& table = results.table;
  if (table.rows.empty()) return {};
  std::vector<std::pair<std::size_t, const FigureInfo*>> columns;
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    const FigureInfo* figure = find_figure(table.columns[c]);
    const auto measured = [c](const auto& row) { return !row[c].empty(); };
    if (!figure || !figure->main) continue;
    if (std::any_of(table.rows.begin(), table.rows.end(), measured)) columns.push_back({c, figure});
  }
  std::string html =
      "<h2>Runs</h2>\n<div class=\"scroll\"><table class=\"data\">\n<thead><tr>"
      "<th class=\"word\">run</th>";
  for (const auto& [column, figure] : columns) {
    const bool text = figure->kind == FigureInfo::Kind::kText;
    const std::string unit = figure->unit == "1" ? "%" : unit_text(figure->unit);
    html += (text ? "<th class=\"word\">" : "<th>") + escape_markup(figure->label) +
            (unit.empty() ? "" : ", " + unit) + "</th>";
  }
  html += "</tr></thead>\n<tbody>\n";
  const std::vector<std::string> titles = run_titles(results);
  for (std::size_t i = 0; i < std::min(table.rows.size(), kMaxPlainRows); ++i) {
    html +=
        "<tr><td class=\"word\">" + link_html(results.folders[i], directory, titles[i]) + "</td>";
    for (const auto& [column, figure] : columns) {
      const std::string& cell = table.rows[i][column];
      const auto number = parse_number(cell);
      if (figure->kind == FigureInfo::Kind::kText || !number) {
        html += "<td class=\"word\">" + escape_markup(words(cell)) + "</td>";
      } else {
        html += "<td>" + number_text((figure->unit == "1" ? 100 : 1) * *number, 4) + "</td>";
      }
    }
    html += "</tr>\n";
  }
  html += "</tbody>\n</table></div>\n";
  if (table.rows.size() > kMaxPlainRows) {
    html += "<p class=\"note\">The first " + std::to_string(kMaxPlainRows) + " of " +
            std::to_string(table.rows.size()) + ".</p>\n";
  }
  return html;
}

std::string comparison_header_html(const ResultTable& results, const std::string& title) {
  const Table& table = results.table;
  std::map<std::string, std::size_t> counts;
  std::set<std::string> seeds;
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    const std::string cause = cause_of(table, i);
    ++counts[cause.empty() ? "succeeded" : cause];
    if (const std::string seed = table.text(i, "seed"); !seed.empty()) seeds.insert(seed);
  }
  std::vector<KeyFigure> figures{{"runs", std::to_string(table.rows.size()), ""},
                                 {"seeds", std::to_string(seeds.size()), ""}};
  const std::size_t successes = counts["succeeded"];
  counts.erase("succeeded");
  std::size_t flown = successes;
  for (const auto& [cause, count] : counts) flown += was_flown(cause) ? count : 0;
  figures.push_back({"succeeded", std::to_string(successes), share_text(successes, flown)});
  for (const auto& [cause, count] : counts)
    figures.push_back({words(cause), std::to_string(count), ""});
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
  names.reserve(columns.size());
  for (const std::size_t column : columns) names.push_back(table.columns[column]);
  ordered_json rows = ordered_json::array();
  ordered_json links = ordered_json::array();
  ordered_json runs = ordered_json::array();
  const std::vector<std::string> titles = run_titles(results);
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
          {"rows", rows},         {"titles", titles},
          {"runs", runs},         {"links", links}};
}

std::string comparison_report_html(const ResultTable& results, const std::string& title,
                                   const std::filesystem::path& directory) {
  const Overlay overlay = overlay_of(results);
  ordered_json payload = comparison_payload(results, directory);
  payload["overlay"] = overlay_json(overlay);
  std::string html = comparison_header_html(results, title);
  html +=
      "<noscript><p class=\"notice\">Curves, heat map and statistics need JavaScript; the rest of "
      "this page does not.</p></noscript>\n";
  html += "<section id=\"figures\"></section>\n<section id=\"coverage\"></section>\n";
  html += overlaid_paths_html(results, overlay);
  html += outcomes_html(results);
  html += failures_html(results, directory);
  html += "<section id=\"side\"></section>\n";
  html += "<section id=\"runs\">" + runs_html(results, directory) + "</section>\n";
  return report_page("AREX: " + title, html, payload);
}

}  // namespace arex::sim
