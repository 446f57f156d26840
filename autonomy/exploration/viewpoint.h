#pragma once

#include <optional>
#include <vector>

#include "exploration/exploration_space.h"

namespace arex {

struct ViewpointConfig {
  double clearance_margin_m = 0.15;
  double standoff_margin_m = 0.1;
  double clearance_m = 0.65;  ///< handed down: planning.inflation_m + clearance_margin_m
  double max_distance_m = 3.0;
  double standoff_m = 0.6;  ///< handed down: planning.inflation_m + standoff_margin_m

  void fields(auto& f) {
    f("clearance_margin_m", clearance_margin_m,
      "of a viewpoint from obstacles beyond planning.inflation_m, where one can be had");
    f("max_distance_m", max_distance_m, "of a viewpoint from what it is to see");
    f("standoff_margin_m", standoff_margin_m,
      "of a viewpoint from what it is to see beyond planning.inflation_m, where one can be had: "
      "keeps the inflated goal out of the unknown");
    f.check(clearance_margin_m >= 0 && clearance_margin_m <= 10, "0 <= clearance_margin_m <= 10");
    f.check(standoff_margin_m >= 0 && standoff_margin_m <= 10, "0 <= standoff_margin_m <= 10");
    f.check(max_distance_m > 0 && max_distance_m <= 50, "0 < max_distance_m <= 50");
  }
};

/// Chooses the reachable known-free point nearest to a frontier point from which a free line leads
/// there: at the standoff with the full clearance, else as near as the travel radius allows.
class ViewpointFinder {
 public:
  ViewpointFinder(const ViewpointConfig& config, double resolution_m);

  /// Centre of a cell; none if no reachable cell within the distance sees the point. `seen_from` is
  /// tried last: the detector knows that it sees the point.
  [[nodiscard]] std::optional<Vec2> find(const ExplorationSpace& space, const Vec2& point,
                                         const Vec2& seen_from) const;

 private:
  ViewpointConfig config_;
  std::vector<Eigen::Vector2i> offsets_;  ///< within the distance, nearest first
  std::size_t first_standing_off_ = 0;
};

}  // namespace arex
