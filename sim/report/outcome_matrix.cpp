#include "report/outcome_matrix.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "report/page.h"
#include "run/markup.h"

namespace arex::sim {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// A variant's name says what goes wrong; the keys that it sets would say it again, at length.
std::vector<std::string> titles_of(const ResultTable& results) {
  std::vector<std::string> titles = configuration_titles(results);
  for (std::size_t i = 0; i < titles.size(); ++i) {
    const std::string variant = results.table.text(i, "variant");
    if (variant.empty()) continue;
    const std::string scenario = results.table.text(i, "scenario");
    titles[i] = scenario.empty() ? variant : scenario + ": " + variant;
  }
  return titles;
}

int& count_for(OutcomeRow& row, const std::string& outcome) {
  if (outcome == "succeeded") return row.continued;
  if (outcome == "stuck") return row.landed;
  if (outcome == "collided") return row.collided;
  if (outcome == "lost") return row.lost;
  return outcome.empty() ? row.broken : row.timed_out;
}

/// A typed event without its numbers, which differ from run to run.
std::string type_of(const std::string& told) {
  const std::size_t kind = told.find(": ");
  const std::size_t detail = kind == std::string::npos ? kind : told.find(": ", kind + 2);
  std::string type = told.substr(0, detail);
  const std::size_t digits = type.find_first_of("0123456789");
  const bool measures = type.starts_with("vibration") && digits != std::string::npos;
  return measures ? "vibration" : type;
}

std::string list_of(const std::map<std::string, int>& told) {
  std::vector<std::pair<std::string, int>> most(told.begin(), told.end());
  std::stable_sort(most.begin(), most.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });
  std::string text;
  for (const auto& [type, count] : most) {
    text += (text.empty() ? "" : ", ") + type + " (" + std::to_string(count) + ")";
  }
  return text;
}

}  // namespace

std::vector<OutcomeRow> outcome_matrix(const ResultTable& results) {
  const Table& table = results.table;
  const std::vector<std::string> titles = titles_of(results);
  const std::vector<double> after_s = table.numbers("faults.told_after_s");
  std::vector<OutcomeRow> rows;
  std::vector<std::map<std::string, int>> told;
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    auto row = std::find_if(rows.begin(), rows.end(),
                            [&](const OutcomeRow& r) { return r.title == titles[i]; });
    if (row == rows.end()) {
      row = rows.insert(rows.end(), OutcomeRow{});
      row->title = titles[i];
      row->told_after_s = kNone;
      told.emplace_back();
    }
    const std::string outcome = table.text(i, "outcome"), event = table.text(i, "faults.told");
    ++count_for(*row, outcome);
    if (outcome.empty()) continue;
    row->untold += outcome == "collided" && event.empty();
    ++told[static_cast<std::size_t>(row - rows.begin())]
          [event.empty() ? "nothing" : type_of(event)];
    row->told_after_s = std::fmax(row->told_after_s, after_s[i]);
  }
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i].told = list_of(told[i]);
  return rows;
}

std::string outcomes_html(const ResultTable& results) {
  const Table& table = results.table;
  bool any = false;
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    any = any || !table.text(i, "faults.told").empty();
  }
  if (!any) return {};
  static constexpr std::array kHeads{"continued", "landed",    "collided",
                                     "lost",      "timed out", "broken"};
  std::string html =
      "<section id=\"outcomes\">\n<h2>What became of the faults</h2>\n<div class=\"scroll\">"
      "<table class=\"data\">\n<thead><tr><th class=\"word\">fault</th>";
  for (const char* head : kHeads) html += "<th>" + std::string(head) + "</th>";
  html +=
      "<th class=\"text\">told first</th><th>within, s</th><th>collided untold</th></tr></thead>\n"
      "<tbody>\n";
  for (const OutcomeRow& row : outcome_matrix(results)) {
    html += "<tr><td class=\"word\">" + escape_markup(row.title) + "</td>";
    for (const int count :
         {row.continued, row.landed, row.collided, row.lost, row.timed_out, row.broken}) {
      html += "<td>" + (count == 0 ? std::string("·") : std::to_string(count)) + "</td>";
    }
    html += "<td class=\"text\">" + escape_markup(row.told) + "</td><td>" +
            (std::isnan(row.told_after_s) ? std::string() : number_text(row.told_after_s, 3)) +
            "</td><td>" + std::to_string(row.untold) + "</td></tr>\n";
  }
  return html + "</tbody>\n</table></div>\n</section>\n";
}

}  // namespace arex::sim
