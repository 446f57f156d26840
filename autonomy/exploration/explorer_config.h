#pragma once

#include "exploration/blacklist.h"
#include "exploration/candidate_filter.h"
#include "exploration/frontier_detector.h"
#include "exploration/revenue.h"
#include "exploration/stop_criteria.h"
#include "exploration/viewpoint.h"

namespace arex {

/// What every explorer heeds, and what those that ship can be told.
struct ExplorerConfig {
  RevenueConfig revenue;  ///< its keys stand directly under `exploration`
  ExplorationBounds bounds;
  SpaceConfig space;
  FrontierDetectorConfig detector;
  CandidateFilterConfig filter;
  BlacklistConfig blacklist;
  ViewpointConfig viewpoint;
  StopConfig stop;
  ConsumptionConfig consumption;
  double flight_height_m = 1.5;
  bool follow_ground = false;
  bool reevaluate = true;
  bool legs_as_flown = false;

  void fields(auto& f) {
    revenue.fields(f);
    f("bounds", bounds, "the area to explore");
    f("space", space, "where the vehicle can go in the known");
    f("detector", detector, "frontier detector");
    f("filter", filter, "cases A, B and C of the paper's figure");
    f("blacklist", blacklist, "targets that failed");
    f("viewpoint", viewpoint, "from where a frontier is to be seen");
    f("stop", stop, "stop criteria");
    f("consumption", consumption, "battery and power as believed");
    f("flight_height_m", flight_height_m, "height of the goals");
    f("follow_ground", follow_ground,
      "flight_height_m counts from the mapped ground under a goal; false: from O's origin");
    f("reevaluate", reevaluate, "drop a target whose unknown area was seen from afar");
    f("legs_as_flown", legs_as_flown,
      "a target dropped on the way counts in T_{t-1} as where the vehicle was; false: as printed");
  }
};

/// Where the vehicle flies over a place.
[[nodiscard]] Vec3 at_flight_height(const ExplorerConfig& config, const Vec2& place,
                                    const OccupancyMap2D& map);

}  // namespace arex
