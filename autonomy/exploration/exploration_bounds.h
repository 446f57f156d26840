#pragma once

#include <string>
#include <vector>

#include "math/types.h"

namespace arex {

/// The area to explore, in O: a box, and inside it a polygon where one is given. The one answer to
/// where the mission explores: explorer, frontier search and coverage all ask contains().
struct ExplorationBounds {
  Vec2 low_m{-25, -20};  ///< paper, Scene 1: 25 m ahead and behind, 20 m to either side
  Vec2 high_m{25, 20};
  std::vector<Vec2> polygon_m;  ///< corners in order; empty: the whole box

  /// The part of a line of constant y that lies inside: what many points of one row ask.
  struct Row {
    double low_x = 0, high_x = -1;  ///< of the box; empty where the row misses it
    bool has_polygon = false;
    std::vector<double> crossings;  ///< x where the polygon is entered and left, ascending
    [[nodiscard]] bool contains(double x) const;
  };
  [[nodiscard]] Row row(double y) const;
  [[nodiscard]] bool contains(const Vec2& p) const { return row(p.y()).contains(p.x()); }
  /// Inside, or outside by no more than this along each axis of the box and from the polygon's rim.
  [[nodiscard]] bool is_near(const Vec2& p, double margin_m) const;

  /// The smallest box that holds the area. @pre area_m2() > 0
  [[nodiscard]] Eigen::AlignedBox2d extent() const;
  [[nodiscard]] double area_m2() const;
  /// Whether no two sides of the polygon meet but neighbours at their common corner.
  [[nodiscard]] bool is_simple() const;

  void fields(auto& f) {
    f("low_m", low_m, "lower corner of the exploration bounds in O (paper, Scene 1)");
    f("high_m", high_m, "upper corner of the exploration bounds in O (paper, Scene 1)");
    f("polygon_m", polygon_m, "corners of a polygon that narrows the box; empty: the whole box");
    f.check((low_m.array() < high_m.array()).all(), "low_m < high_m");
    const std::size_t corners = polygon_m.size();
    const bool fair = corners == 0 || (corners >= 3 && corners <= 1000);
    f.check(fair, "polygon_m has 3 to 1000 corners");
    f.check(!fair || is_simple(), "polygon_m whose sides neither cross, touch nor have no length");
    constexpr double kLeastArea_m2 = 1.0;  // what a vehicle of 0.6 m turns on
    f.check(area_m2() >= kLeastArea_m2,
            "polygon_m that leaves 1 m^2 or more between low_m and high_m");
  }

 private:
  /// The polygon cut to the box, corners in order; the box itself without a polygon.
  [[nodiscard]] std::vector<Vec2> clipped() const;
};

}  // namespace arex
