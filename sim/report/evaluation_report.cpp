#include "report/evaluation_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "config/config.h"
#include "report/page.h"
#include "report/svg.h"
#include "run/markup.h"

namespace arex::sim {
namespace {

constexpr std::size_t kDrawnCorners = 3000;  // corners of a drawn path

std::string code(const std::string& text) { return "<code>" + escape_markup(text) + "</code>"; }

std::string evaluation_header_html(const Comparison& comparison) {
  const EvaluationOptions& options = comparison.options;
  const Trajectory& reference = comparison.reference;
  std::string html = "<h1>Trajectory error</h1>\n<p>Reference: " + code(reference.file) + ", " +
                     std::to_string(reference.poses.size()) +
                     " poses. Estimates: " + std::string(alignment_text(options.alignment));
  if (options.poses_to_align > 0) {
    html += " of their first " + std::to_string(options.poses_to_align) + " matched poses";
  }
  html += reference.has_time() ? "; poses belong together that are at most " +
                                     number_text(options.max_time_difference_s) + " s apart."
                               : "; poses belong together by their number.";
  return html + "</p>\n";
}

std::string figures_html(const Comparison& comparison) {
  std::string html =
      "<section>\n<h2>Figures</h2>\n<div class=\"scroll whole\"><table class=\"data\">\n"
      "<thead><tr><th class=\"text\">figure</th>";
  for (const ComparedEstimate& estimate : comparison.estimates) {
    html += "<th>" + escape_markup(estimate.name) + "</th>";
  }
  html += "</tr></thead>\n<tbody>\n";
  for (const ComparedFigure& figure : figures_of(comparison)) {
    const std::string unit = figure.unit.empty() ? "" : ", " + figure.unit;
    html += "<tr><td class=\"text\">" + escape_markup(figure.label + unit) + "</td>";
    for (std::size_t i = 0; i < figure.values.size(); ++i) {
      const std::string text = escape_markup(figure.text(i));
      html += figure.is_best(i) ? "<td class=\"better\"><b>" + text + "</b></td>"
                                : "<td>" + text + "</td>";
    }
    html += "</tr>\n";
  }
  html +=
      "</tbody>\n</table></div>\n<p class=\"note\">Definitions as in evo. RMSE: root of the mean "
      "square. Sub-paths of the relative error are measured along the ";
  html += comparison.options.pairs_from_reference ? "reference" : "estimate";
  html +=
      "; all: from every pose on to the one nearest that length, if within a tenth of it; "
      "consecutive: end to end.</p>\n</section>\n";
  return html;
}

std::string notes_html(const Comparison& comparison) {
  std::string rows;
  const auto add = [&](const std::string& file, const std::vector<std::string>& notes) {
    for (const std::string& note : notes) {
      rows += "<li>" + code(file) + ": " + escape_markup(note) + "</li>\n";
    }
  };
  add(comparison.reference.file, notes_of(comparison.reference));
  for (const ComparedEstimate& estimate : comparison.estimates) {
    add(estimate.trajectory.file, notes_of(estimate, comparison.options));
  }
  return rows.empty() ? "" : "<section>\n<h2>Notes</h2>\n<ul>\n" + rows + "</ul>\n</section>\n";
}

/// Tracks from above: a camera's z axis, KITTI's, points ahead and not up.
class TopView {
 public:
  explicit TopView(bool kitti) : up_(kitti ? 2 : 1) {}

  [[nodiscard]] Vec2 operator()(const Pose& X) const { return {X.p.x(), X.p[up_]}; }

  [[nodiscard]] std::string polyline(const std::vector<PosePair>& pairs, Pose PosePair::*which,
                                     const std::string& name) const {
    std::string points;
    const std::size_t step = pairs.size() / kDrawnCorners + 1;
    const auto add = [&](const PosePair& pair) {
      const Vec2 p = (*this)(pair.*which);
      points += fmt::format("{:.3f},{:.3f} ", p.x(), -p.y());
    };
    for (std::size_t i = 0; i < pairs.size(); i += step) add(pairs[i]);
    add(pairs.back());
    return "<polyline class=\"" + name + "\" points=\"" + points + "\"/>\n";
  }

 private:
  Eigen::Index up_;
};

/// @param id of the picture within its page
std::string tracks_figure_html(const Comparison& comparison, const std::string& id) {
  const TopView view(!comparison.reference.has_time());
  Eigen::AlignedBox2d box;
  std::vector<std::string> names;
  for (const ComparedEstimate& estimate : comparison.estimates) {
    names.push_back(estimate.name);
    for (const PosePair& pair : estimate.evaluation.pairs) {
      box.extend(view(pair.X_WB));
      box.extend(view(pair.X_OB));
    }
  }
  const double unit = std::max(1.0, box.sizes().maxCoeff()) / 80;  // what a mark measures
  // The scale bar stands below.
  box = {box.min() - Vec2(2 * unit, 5 * unit), box.max() + Vec2::Constant(2 * unit)};
  std::string svg = fmt::format(
      "<svg id=\"{}\" class=\"map\" role=\"img\" aria-label=\"Tracks seen from above\" "
      "viewBox=\"{:.3f} {:.3f} {:.3f} {:.3f}\">\n",
      id, box.min().x(), -box.max().y(), box.sizes().x(), box.sizes().y());
  // The reference where any estimate knows it.
  const auto longest = std::max_element(
      comparison.estimates.begin(), comparison.estimates.end(), [](const auto& a, const auto& b) {
        return a.evaluation.pairs.size() < b.evaluation.pairs.size();
      });
  const std::vector<PosePair>& pairs = longest->evaluation.pairs;
  svg += view.polyline(pairs, &PosePair::X_WB, "truth");
  for (std::size_t i = 0; i < comparison.estimates.size(); ++i) {
    svg +=
        view.polyline(comparison.estimates[i].evaluation.pairs, &PosePair::X_OB, svg_line_class(i));
  }
  svg += svg_ends(view(pairs.front().X_WB), view(pairs.back().X_WB), unit);
  return "<figure>\n" + svg + svg_scale_bar(box, unit) + "</svg>\n<figcaption class=\"map-key\">" +
         key_html(names) +
         "<span><i style=\"border-color:var(--truth);border-top-style:dashed\"></i>reference</span>"
         "<span><i class=\"ring\"></i>start</span><span style=\"color:var(--bad)\">× end</span>"
         "</figcaption>\n</figure>\n";
}

std::string tracks_html(const Comparison& comparison) {
  return "<section>\n<h2>Seen from above</h2>\n" + tracks_figure_html(comparison, "path-map") +
         "</section>\n";
}

/// The same tracks up to where the reference has come that far.
Comparison begin_of(const Comparison& comparison, double distance_m) {
  Comparison begin = comparison;
  for (ComparedEstimate& estimate : begin.estimates) {
    Evaluation& e = estimate.evaluation;
    std::size_t count = 0;
    while (count < e.distance_m.size() && e.distance_m[count] <= distance_m) ++count;
    e.pairs.resize(std::max<std::size_t>(1, count));
  }
  return begin;
}

std::string charts_html(const Comparison& comparison) {
  using Errors = std::vector<double> Evaluation::*;
  const auto curves = [&](Errors errors, bool over_time) {
    std::vector<Curve> found;
    for (const ComparedEstimate& estimate : comparison.estimates) {
      const Evaluation& e = estimate.evaluation;
      Curve curve{estimate.name, e.distance_m, e.*errors};
      for (std::size_t i = 0; over_time && i < e.pairs.size(); ++i) {
        curve.x[i] = to_seconds(e.pairs[i].stamp) - comparison.reference.poses.front().time_s;
      }
      found.push_back(curve);
    }
    return found;
  };
  const std::string metres = "along the reference, m";
  const std::string seconds = "time since the reference's first pose, s";
  std::string html = "<section>\n<h2>Errors over time and distance</h2>\n<div class=\"charts\">\n";
  const auto add = [&](const std::string& title, const std::string& unit, Errors errors) {
    if (comparison.reference.has_time()) {
      html += chart_html(title, seconds, unit, curves(errors, true));
    }
    html += chart_html(title, metres, unit, curves(errors, false));
  };
  add("Position error", "m", &Evaluation::position_error_m);
  add("Rotation error", "deg", &Evaluation::rotation_error_deg);
  if (comparison.reference.has_time()) add("Yaw error", "deg", &Evaluation::yaw_error_deg);
  return html + "</div>\n</section>\n";
}

}  // namespace

std::string evaluation_report_html(const Comparison& comparison) {
  std::string html = evaluation_header_html(comparison);
  html += figures_html(comparison);
  html += notes_html(comparison);
  html += tracks_html(comparison);
  html += charts_html(comparison);
  html += "<section>\n<h2>In full</h2>\n<details><summary>evaluation.json</summary><pre>" +
          escape_markup(comparison_json(comparison).dump(2)) + "</pre></details>\n</section>\n";
  return report_page("AREX: trajectory error", html);
}

std::string odometries_html(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(folder, none)) {
    const std::string name = entry.path().filename().string();
    if (name.ends_with(".tum") && name != "truth.tum" && name != "estimate.tum") {
      files.push_back(entry.path());
    }
  }
  if (files.empty()) return {};
  std::sort(files.begin(), files.end());
  files.insert(files.begin(), folder / "estimate.tum");
  try {
    std::vector<Trajectory> estimates;
    for (const auto& file : files) estimates.push_back(read_trajectory(file));
    EvaluationOptions options;
    options.alignment = Alignment::kOrigin;
    const Comparison comparison =
        compare(read_trajectory(folder / "truth.tum"), std::move(estimates), options);
    constexpr double kBegin = 10;  // m
    return "<section id=\"odometries\">\n<h2>Odometries</h2>\n<p>(a) Begun together: the first "
           "10 m.</p>\n" +
           tracks_figure_html(begin_of(comparison, kBegin), "odometries-begin") +
           "<p>(b) The paths, aligned at the start.</p>\n" +
           tracks_figure_html(comparison, "odometries-paths") +
           "<p>(c) The errors.</p>\n</section>\n" + charts_html(comparison);
  } catch (const ConfigError&) {  // of a run cut short: nothing to compare yet
    return {};
  }
}

}  // namespace arex::sim
