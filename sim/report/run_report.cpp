#include "report/run_report.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>

#include "files/files.h"
#include "report/evaluation_report.h"
#include "report/map_picture.h"
#include "report/page.h"
#include "report/payload.h"
#include "scoring/figures.h"

namespace arex::sim {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t kMaxEvents = 2000;     // rows of the page's table
constexpr std::size_t kMaxDecisions = 1000;  // likewise

/// Reads a summary whose sections may be null.
class Summary {
 public:
  explicit Summary(ordered_json json) : json_(std::move(json)) {}

  [[nodiscard]] std::string text(const std::string& key) const {
    const ordered_json* value = find(key);
    if (!value || value->is_null()) return {};
    return value->is_string() ? value->get<std::string>() : value->dump();
  }
  /// Every figure that it may hold.
  [[nodiscard]] std::vector<FigureInfo> figures() const { return figures_in(json_); }
  /// A figure as people read it; empty if it has no value.
  [[nodiscard]] std::string shown(const FigureInfo& figure) const {
    const ordered_json* value = find(figure.key);
    if (!value || value->is_null()) return {};
    if (value->is_array()) return std::to_string(value->size());
    return value->is_number_float() ? number_with_unit(value->get<double>(), figure.unit)
                                    : with_unit(text(figure.key), figure.unit);
  }

 private:
  static std::string with_unit(const std::string& number, const std::string& unit) {
    return unit.empty() ? number : number + " " + unit_text(unit);
  }
  static std::string number_with_unit(double value, const std::string& unit) {
    if (unit == "1") return percent_text(value);
    if (unit == "m" && std::abs(value) < 0.1) return number_text(1000 * value, 3) + " mm";
    if (unit == "s") return number_text(std::round(10 * value) / 10, 9) + " s";
    // Three digits, but all of those before the point.
    const bool large = std::abs(value) >= 1000;
    return with_unit(large ? number_text(std::round(value), 15) : number_text(value, 3), unit);
  }
  [[nodiscard]] const ordered_json* find(const std::string& key) const {
    std::string pointer = "/" + key;
    std::replace(pointer.begin(), pointer.end(), '.', '/');
    const ordered_json::json_pointer path(pointer);
    return json_.contains(path) ? &json_.at(path) : nullptr;
  }
  ordered_json json_;
};

std::vector<KeyFigure> key_figures(const Summary& summary) {
  std::vector<KeyFigure> figures;
  for (const FigureInfo& figure : summary.figures()) {
    const bool in_heading = figure.key == "outcome" || figure.key == "reason";
    if (!figure.main || in_heading) continue;
    std::string value = summary.shown(figure);
    if (figure.kind == FigureInfo::Kind::kText) value = words(value);
    if (!value.empty()) figures.push_back({figure.label, value, ""});
  }
  return figures;
}

std::string every_figure_html(const Summary& summary) {
  std::string html =
      "<details id=\"every-figure\"><summary>Every figure</summary>\n<div class=\"scroll\">"
      "<table class=\"data\">\n<thead><tr><th class=\"word\">figure</th><th>value</th>"
      "<th class=\"word\">in summary.json</th><th class=\"text\">meaning</th></tr></thead>\n"
      "<tbody>\n";
  for (const FigureInfo& figure : summary.figures()) {
    const std::string value = summary.shown(figure);
    html += "<tr><td class=\"word\">" + escape_markup(figure.label) + "</td><td>" +
            (value.empty() ? "–" : escape_markup(value)) + "</td><td class=\"word\"><code>" +
            escape_markup(figure.column()) + "</code></td><td class=\"text\">" +
            escape_markup(figure.meaning) + "</td></tr>\n";
  }
  return html + "</tbody>\n</table></div></details>\n";
}

std::string name_of(const RunRecord& run) {
  const Summary summary(run.summary ? *run.summary : ordered_json::object());
  const std::string scenario = summary.text("scenario");
  if (scenario.empty()) {
    const std::filesystem::path& folder = run.folder;
    return folder.has_filename() ? folder.filename().string()
                                 : folder.parent_path().filename().string();
  }
  // A title begins with the scenario where that was varied.
  if (run.title.starts_with(scenario + ",") || run.title == scenario) return run.title;
  return scenario + ", " + (run.title.empty() ? "seed " + summary.text("seed") : run.title);
}

std::string run_header_html(const RunRecord& run) {
  const Summary summary(run.summary ? *run.summary : ordered_json::object());
  const std::string outcome = run.summary ? summary.text("outcome") : "unfinished";
  const std::string name = name_of(run);
  std::string html = "<h1>" + escape_markup(name) + " <span class=\"badge " +
                     escape_markup(outcome) + "\">" + escape_markup(words(outcome)) +
                     "</span></h1>\n";
  if (!run.summary) {
    html +=
        "<p class=\"notice\">This run is unfinished: the folder has no summary.json. "
        "What it recorded until then is shown.</p>\n";
    return html;
  }
  html += "<p>" + escape_markup(summary.text("reason"));
  const std::string source = summary.text("odometry.source");
  if (!source.empty()) html += ". Odometry: " + escape_markup(source);
  const std::string hash = summary.text("trajectory_hash");
  if (!hash.empty()) html += ". Trajectory <code>" + escape_markup(hash) + "</code>";
  const std::string version = summary.text("build.version");
  if (!version.empty()) html += ", build " + escape_markup(version);
  html += "</p>\n";
  return html + key_figures_html(key_figures(summary));
}

std::string map_html(const RunRecord& run) {
  const std::string svg = map_picture_svg(run);
  if (svg.empty()) return {};
  return "<section>\n<h2>Path over the map</h2>\n<figure>\n" + svg +
         "<figcaption class=\"map-key\">"
         "<span><i style=\"border-color:var(--estimate)\"></i>estimated path</span>"
         "<span><i style=\"border-color:var(--truth);border-top-style:dashed\"></i>true path</span>"
         "<span><i class=\"ring\"></i>start</span><span style=\"color:var(--bad)\">× end</span>"
         "<span><i class=\"dot\" style=\"background:var(--target)\"></i>target</span>"
         "<span><i class=\"dot\" style=\"background:var(--good)\"></i>target reached</span>" +
         std::string(run.decisions.rows.empty()
                         ? ""
                         : "<span><i class=\"dot\" style=\"background:var(--candidate)\"></i>"
                           "candidate</span>") +
         (run.map ? "" : "<span>No 2D map was recorded: the cloud seen from above.</span>") +
         "</figcaption>\n</figure>\n</section>\n";
}

// What the mapped cloud shows, and how right that is.
std::string semantics_html(const RunRecord& run) {
  constexpr std::size_t kMostBytes = 20'000'000;
  constexpr std::string_view kSignature = "\x89PNG\r\n";
  const auto png = read_bytes(run.folder / "semantic.png");
  if (!png || !png->starts_with(kSignature) || png->size() > kMostBytes) return {};
  const Summary summary(run.summary ? *run.summary : ordered_json::object());
  const Table objects = read_table(run.folder / "objects.csv");
  std::string rows;
  for (const char* name : {"trunk", "pillar", "car", "wall", "ramp", "door"}) {
    std::size_t named = 0;
    for (std::size_t i = 0; i < objects.rows.size(); ++i) named += objects.text(i, "class") == name;
    std::string cells;
    bool scored = false;
    for (const char* figure : {"precision", "recall", "f1", "position_median_m", "size_median_m"}) {
      const FigureInfo* info = find_figure("semantic." + std::string(name) + "." + figure);
      const std::string value = info ? summary.shown(*info) : "";
      scored |= !value.empty();
      cells += "<td>" + (value.empty() ? "–" : escape_markup(value)) + "</td>";
    }
    if (named == 0 && !scored) continue;
    rows += "<tr><td class=\"word\">" + std::string(name) + "</td><td>" + std::to_string(named) +
            "</td>" + cells + "</tr>\n";
  }
  const std::span bytes(reinterpret_cast<const std::uint8_t*>(png->data()), png->size());
  return "<section id=\"semantics\">\n<h2>Semantic map</h2>\n<figure><img style=\"max-width:100%\" "
         "alt=\"Semantic map from above\" src=\"data:image/png;base64," +
         base64(bytes) +
         "\"></figure>\n<div class=\"scroll\"><table class=\"data\">\n<thead><tr>"
         "<th class=\"word\">class</th><th>named</th><th>precision</th><th>recall</th><th>F1</th>"
         "<th>position error, median</th><th>size error, median</th></tr></thead>\n<tbody>\n" +
         rows + "</tbody>\n</table></div>\n</section>\n";
}

std::string timing_html(const Table& timing) {
  const auto totals = timing.numbers("total_s");
  if (totals.empty()) return {};
  double most = 0;
  for (const double total : totals) most = std::max(most, std::isfinite(total) ? total : 0);
  std::string html =
      "<section>\n<h2>Where the host's time went</h2>\n<div class=\"scroll\"><table class=\"data "
      "timing\">\n<thead><tr><th class=\"word\">module</th><th>calls</th><th>median, ms</th>"
      "<th>p99, ms</th><th>total, s</th><th></th></tr></thead>\n<tbody>\n";
  for (std::size_t i = 0; i < timing.rows.size(); ++i) {
    html += "<tr><td class=\"word\">" + escape_markup(timing.text(i, "module")) + "</td>";
    for (const char* name : {"calls", "median_ms", "p99_ms", "total_s"}) {
      html += "<td>" + escape_markup(timing.text(i, name)) + "</td>";
    }
    const double share = most > 0 && std::isfinite(totals[i]) ? totals[i] / most : 0;
    html += "<td class=\"wide\"><span class=\"bar\" style=\"width:" +
            number_text(std::round(1000 * share) / 10, 4) + "%\"></span></td></tr>\n";
  }
  return html + "</tbody>\n</table></div>\n</section>\n";
}

// A row a decision that chose a target or stopped: how many candidates, and the winner's terms.
std::string decisions_html(const Table& decisions) {
  std::string rows;
  std::size_t count = 0;
  for (std::size_t begin = 0, end = 0; begin < decisions.rows.size(); begin = end) {
    const std::string number = decisions.text(begin, "decision");
    std::size_t kept = 0;
    std::optional<std::size_t> winner;
    for (end = begin; end < decisions.rows.size() && decisions.text(end, "decision") == number;
         ++end) {
      if (decisions.text(end, "verdict") == "kept") ++kept;
      if (decisions.text(end, "winner") == "1") winner = end;
    }
    const std::string kind = decisions.text(begin, "kind");
    if (kind == "keep_target" || ++count > kMaxDecisions) continue;
    const std::string time = escape_markup(decisions.text(begin, "time_s"));
    const std::string stop = decisions.text(begin, "stop_reason");
    const bool some = !decisions.text(begin, "candidate").empty();
    rows.append("<tr data-t=\"").append(time).append("\"><td>").append(time);
    rows.append("</td><td class=\"word\">").append(escape_markup(kind));
    if (kind == "stop") rows.append(": ").append(escape_markup(stop));
    rows.append("</td><td>").append(some ? std::to_string(end - begin) : "0");
    rows.append("</td><td>").append(std::to_string(kept)).append("</td>");
    for (const char* name : {"information_m2", "distance_m", "angle_rad", "revenue"}) {
      rows += "<td>";
      if (winner) rows += escape_markup(decisions.text(*winner, name));
      rows += "</td>";
    }
    rows += "</tr>\n";
  }
  if (rows.empty()) return {};
  return "<section id=\"decisions\">\n<h2>Decisions</h2>\n<div class=\"scroll\"><table "
         "class=\"data\">\n<thead><tr><th>time, s</th><th class=\"word\">kind</th>"
         "<th>candidates</th><th>kept</th><th>information, m²</th><th>distance, m</th>"
         "<th>angle, rad</th><th>revenue</th></tr></thead>\n<tbody>\n" +
         rows + "</tbody>\n</table></div>\n</section>\n";
}

std::string events_html(const Table& events) {
  if (events.rows.empty()) return {};
  std::map<std::string, std::size_t> kinds;
  for (std::size_t i = 0; i < events.rows.size(); ++i) ++kinds[events.text(i, "kind")];
  std::string html = "<section id=\"events\">\n<h2>Events</h2>\n<ul class=\"chips\">";
  for (const auto& [kind, count] : kinds) {
    html += "<li>" + escape_markup(kind) + " " + std::to_string(count) + "</li>";
  }
  html +=
      "</ul>\n<div class=\"scroll\"><table class=\"data\">\n<thead><tr><th>time, s</th>"
      "<th class=\"word\">kind</th><th class=\"text\">detail</th></tr></thead>\n<tbody>\n";
  for (std::size_t i = 0; i < std::min(events.rows.size(), kMaxEvents); ++i) {
    const std::string time = escape_markup(events.text(i, "time_s"));
    html.append("<tr data-t=\"").append(time).append("\"><td>").append(time);
    html.append("</td><td class=\"word\">").append(escape_markup(events.text(i, "kind")));
    html.append("</td><td class=\"text\">").append(escape_markup(events.text(i, "detail")));
    html += "</td></tr>\n";
  }
  html += "</tbody>\n</table></div>\n";
  if (events.rows.size() > kMaxEvents) {
    html += "<p class=\"note\">The first " + std::to_string(kMaxEvents) + " of " +
            std::to_string(events.rows.size()) + "; the rest stands in events.csv.</p>\n";
  }
  return html + "</section>\n";
}

std::string details_html(const RunRecord& run) {
  std::string html = "<section>\n<h2>In full</h2>\n";
  if (run.summary) {
    html += every_figure_html(Summary(*run.summary));
    html += "<details><summary>summary.json</summary><pre>" + escape_markup(run.summary->dump(2)) +
            "</pre></details>\n";
  }
  if (!run.resolved_yaml.empty()) {
    html += "<details><summary>resolved.yaml</summary><pre>" + escape_markup(run.resolved_yaml) +
            "</pre></details>\n";
  }
  if (!run.missing.empty()) {
    html += "<p class=\"note\">Not in the run folder:";
    for (const std::string& name : run.missing) html += " " + escape_markup(name);
    html += "</p>\n";
  }
  return html + "</section>\n";
}

}  // namespace

std::string run_report_html(const RunRecord& run) {
  std::string html = run_header_html(run);
  html +=
      "<noscript><p class=\"notice\">The replay and the charts need JavaScript; the rest of "
      "this page does not.</p></noscript>\n";
  html += "<section id=\"replay\"></section>\n";
  html += map_html(run);
  html += odometries_html(run.folder);
  html += semantics_html(run);
  html += "<section id=\"against-time\"></section>\n";
  html +=
      "<div class=\"columns\">\n" + timing_html(run.timing) + events_html(run.events) + "</div>\n";
  html += decisions_html(run.decisions);
  html += details_html(run);
  return report_page("AREX: " + name_of(run), html, run_payload(run));
}

bool write_run_report(const std::filesystem::path& folder, const std::string& title) {
  RunRecord run = read_run(folder, kMaxReportPoints);
  run.title = title;
  write_atomically(folder / "report.html", run_report_html(run));
  return run.summary.has_value();
}

}  // namespace arex::sim
