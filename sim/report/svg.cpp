#include "report/svg.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "run/markup.h"

namespace arex::sim {
namespace {

constexpr std::size_t kMostBuckets = 400;  // of a curve: each keeps its least and its largest value

// A chart's drawing, in its own units: about as wide as a phone, so that its text is read there.
constexpr double kWidth = 480, kHeight = 240;
constexpr double kLeft = 52, kRight = 16, kTop = 10, kBottom = 38;

/// Round values from 0 on.
struct Axis {
  double step = 1;
  int steps = 1;
  [[nodiscard]] double end() const { return steps * step; }
};

Axis axis_to(double greatest, int most_steps) {
  if (!(greatest > 0) || !std::isfinite(greatest)) return {};
  const double decade = std::pow(10, std::floor(std::log10(greatest / most_steps)));
  for (const double factor : {1., 2., 5., 10.}) {
    const double step = factor * decade;
    if (greatest <= most_steps * step) return {step, static_cast<int>(std::ceil(greatest / step))};
  }
  return {};
}

double greatest_of(const std::vector<Curve>& curves, std::vector<double> Curve::*which) {
  double greatest = 0;
  for (const Curve& curve : curves) {
    for (const double value : curve.*which) greatest = std::max(greatest, value);
  }
  return greatest;
}

// Indices of what is drawn, in order.
std::vector<std::size_t> thinned(const std::vector<double>& values) {
  std::vector<std::size_t> kept;
  const std::size_t buckets = std::min(kMostBuckets, values.size());
  for (std::size_t i = 0; i < buckets; ++i) {
    const auto begin = values.begin() + static_cast<std::ptrdiff_t>(i * values.size() / buckets);
    const auto end =
        values.begin() + static_cast<std::ptrdiff_t>((i + 1) * values.size() / buckets);
    const auto [low, high] = std::minmax_element(begin, end);
    const auto [first, second] = std::minmax(low, high);
    kept.push_back(static_cast<std::size_t>(first - values.begin()));
    if (second != first) kept.push_back(static_cast<std::size_t>(second - values.begin()));
  }
  return kept;
}

std::string line(double x0, double y0, double x1, double y1) {
  return fmt::format("<path class=\"grid\" d=\"M{:.1f} {:.1f}L{:.1f} {:.1f}\"/>", x0, y0, x1, y1);
}

std::string label(double x, double y, const char* anchor, const std::string& text) {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">", x, y, anchor) +
         escape_markup(text) + "</text>\n";
}

}  // namespace

std::string svg_scale_bar(const Eigen::AlignedBox2d& box, double unit) {
  const double width = box.sizes().x();
  double length = 0.1;
  for (const double candidate : {0.2, 0.5, 1., 2., 5., 10., 20., 50., 100., 200., 500.}) {
    if (candidate < 0.3 * width) length = candidate;
  }
  const double x = box.min().x() + 1.5 * unit;
  const double y = -box.min().y() - 1.5 * unit;
  return fmt::format("<path class=\"scale\" d=\"M{:.2f} {:.2f}v{:.2f}h{:.2f}v{:.2f}\"/>", x,
                     y - 0.6 * unit, 0.6 * unit, length, -0.6 * unit) +
         fmt::format("<text x=\"{:.2f}\" y=\"{:.2f}\" font-size=\"{:.2f}\">{:g} m</text>\n",
                     x + 0.4 * unit, y - 0.5 * unit, 1.6 * unit, length);
}

std::string svg_ends(const Vec2& start, const Vec2& end, double unit) {
  return fmt::format("<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"{:.2f}\" class=\"start\">", start.x(),
                     -start.y(), 0.9 * unit) +
         "<title>start</title></circle>\n" +
         fmt::format(
             "<path class=\"end\" d=\"M{:.2f} {:.2f}l{:.2f} {:.2f}m0 {:.2f}l{:.2f} {:.2f}\">",
             end.x() - 0.8 * unit, -end.y() - 0.8 * unit, 1.6 * unit, 1.6 * unit, -1.6 * unit,
             -1.6 * unit, 1.6 * unit) +
         "<title>end</title></path>\n";
}

std::string svg_line_class(std::size_t n) {
  return "line-" + std::to_string(n % kLineColours + 1) + (n < kLineColours ? "" : " again");
}

std::string key_html(const std::vector<std::string>& labels) {
  std::string html;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    html +=
        "<span><i class=\"" + svg_line_class(i) + "\"></i>" + escape_markup(labels[i]) + "</span>";
  }
  return html;
}

std::string chart_html(const std::string& title, const std::string& x_label,
                       const std::string& y_label, const std::vector<Curve>& curves) {
  const Axis x = axis_to(greatest_of(curves, &Curve::x), 6);
  const Axis y = axis_to(greatest_of(curves, &Curve::y), 5);
  const auto across = [&](double value) {
    return kLeft + value / x.end() * (kWidth - kLeft - kRight);
  };
  const auto up = [&](double value) {
    return kHeight - kBottom - value / y.end() * (kHeight - kBottom - kTop);
  };
  std::string svg = fmt::format("<svg class=\"curves\" role=\"img\" viewBox=\"0 0 {:g} {:g}\" ",
                                kWidth, kHeight) +
                    "aria-label=\"" + escape_markup(title) + "\">\n";
  for (int i = 0; i <= x.steps; ++i) {
    const double at = across(i * x.step);
    svg += line(at, kTop, at, kHeight - kBottom);
    svg += label(at, kHeight - kBottom + 15, "middle", fmt::format("{:g}", i * x.step));
  }
  for (int i = 0; i <= y.steps; ++i) {
    const double at = up(i * y.step);
    svg += line(kLeft, at, kWidth - kRight, at);
    svg += label(kLeft - 6, at + 4, "end", fmt::format("{:g}", i * y.step));
  }
  for (std::size_t n = 0; n < curves.size(); ++n) {
    const Curve& curve = curves[n];
    std::string points;
    for (const std::size_t i : thinned(curve.y)) {
      points += fmt::format("{:.1f},{:.1f} ", across(curve.x[i]), up(curve.y[i]));
    }
    svg += "<polyline class=\"" + svg_line_class(n) + "\" points=\"" + points + "\"><title>" +
           escape_markup(curve.label) + "</title></polyline>\n";
  }
  svg += label((kLeft + kWidth - kRight) / 2, kHeight - 6, "middle", x_label);
  return "<figure class=\"chart\">\n<h3>" + escape_markup(title + ", " + y_label) + "</h3>\n" +
         svg + "</svg>\n</figure>\n";
}

}  // namespace arex::sim
