#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "math/types.h"

/// Drawings that stand in a page as they are, without a script. Their colours are those of
/// scripts/report/src/style.css.
namespace arex::sim {

/// A bar of a round length, m, in the lower left corner of a map whose y axis points up.
/// @param unit what a mark measures
std::string svg_scale_bar(const Eigen::AlignedBox2d& box, double unit);

/// A ring at the start and a cross at the end of a path.
std::string svg_ends(const Vec2& start, const Vec2& end, double unit);

/// A line of a chart.
struct Curve {
  std::string label;
  std::vector<double> x, y;
};

inline constexpr std::size_t kLineColours = 6;  ///< --line-1 ... of the style sheet

/// The class of the nth of several lines, which gives it its colour.
std::string svg_line_class(std::size_t n);

/// A key of lines: their colours and labels, as a figure's caption has it.
std::string key_html(const std::vector<std::string>& labels);

/// A figure of curves above zero. Of long ones what is drawn keeps every peak.
std::string chart_html(const std::string& title, const std::string& x_label,
                       const std::string& y_label, const std::vector<Curve>& curves);

}  // namespace arex::sim
