#include "blame/blame_report.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <vector>

#include "report/map_picture.h"
#include "report/page.h"
#include "report/run_record.h"
#include "report/svg.h"
#include "run/markup.h"

namespace arex::sim {
namespace {

constexpr std::size_t kCloudPoints = 100'000;  // of a map that stands in for a 2D map

std::string row_html(const FlightEnd& flight, const std::string& name, std::string_view effect) {
  const char* mood = flight.succeeded() ? " class=\"better\"" : "";
  std::string html = "<tr>";
  for (const std::string& text : {name, flight.text}) {
    html += "<td class=\"text\">" + escape_markup(text) + "</td>";
  }
  html += fmt::format("<td{}>{}</td><td{}>", mood, words(std::string(effect)), mood) +
          escape_markup(words(flight.outcome)) + "</td>";
  html += fmt::format("<td>{:.1f}</td>", flight.sim_time_s);
  return html + "<td class=\"text\">" + escape_markup(flight.reason) + "</td></tr>\n";
}

std::string table_html(const Blame& blame) {
  std::string html =
      "<section>\n<h2>Flights</h2>\n<div class=\"scroll whole\"><table class=\"data\">\n<thead><tr>"
      "<th class=\"text\">truth in</th><th class=\"text\">replaced by</th><th>failure</th>"
      "<th>outcome</th>"
      "<th>time, s</th><th class=\"text\">why</th></tr></thead>\n<tbody>\n";
  html += row_html(blame.failed, "as flown", "");
  for (const FlightEnd& flight : blame.flights) {
    html += row_html(flight, words(flight.name), effect_text(blame, flight));
  }
  return html +
         "</tbody>\n</table></div>\n<p class=\"note\">Each flight has the same world and the same "
         "seed. Where truth in several single places ends the failure, it is laid to the first "
         "along the flow of data: sensors, odometry, maps, tracking. Gone: the flight fails "
         "otherwise, later; cut short: earlier, which proves nothing. Its folder, beside this "
         "page, is a run like any other.</p>\n</section>\n";
}

// One colour each, of the style sheet.
std::string colour_of(std::size_t flight) {
  return fmt::format("var(--line-{})", 1 + flight % kLineColours);
}

std::string paths_html(const Blame& blame, const std::filesystem::path& folder) {
  const RunRecord failed = read_run(blame.run, kCloudPoints);
  std::vector<std::vector<TimedPose>> truths;
  for (const FlightEnd& flight : blame.flights) {
    truths.push_back(read_tum(folder / flight.name / "truth.tum"));
  }
  if (failed.truth.empty()) return {};
  std::vector<DrawnPath> paths{{&failed.truth, "var(--bad)", "as flown"}};
  std::vector<std::string> labels;
  for (std::size_t i = 0; i < truths.size(); ++i) {
    const FlightEnd& flight = blame.flights[i];
    labels.push_back(words(flight.name) + ": " + words(flight.outcome));
    if (!truths[i].empty()) paths.push_back({&truths[i], colour_of(i), labels.back()});
  }
  return "<section>\n<h2>Paths</h2>\n<figure>\n" + overlaid_paths_svg(failed, paths) +
         "<figcaption class=\"map-key\"><span><i style=\"border-color:var(--bad)\"></i>as "
         "flown</span>" +
         key_html(labels) +
         "</figcaption>\n</figure>\n<p class=\"note\">True paths over the map of the failed run; a "
         "disc where each ends.</p>\n</section>\n";
}

}  // namespace

std::string blame_report_html(const Blame& blame, const std::filesystem::path& folder) {
  std::string html = "<h1>" + escape_markup(blame.scenario) + ": who failed?</h1>\n<p><code>" +
                     escape_markup(blame.run) + "</code>, seed " + std::to_string(blame.seed) +
                     "</p>\n<p><b>" + escape_markup(blame.verdict.text) + "</b></p>\n";
  html += table_html(blame);
  html += paths_html(blame, folder);
  html += "<section>\n<h2>In full</h2>\n<details><summary>blame.json</summary><pre>" +
          escape_markup(blame_json(blame).dump(2)) + "</pre></details>\n</section>\n";
  return report_page("AREX blame: " + blame.scenario, html);
}

}  // namespace arex::sim
