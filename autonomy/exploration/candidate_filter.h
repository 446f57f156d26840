#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "exploration/candidate.h"
#include "exploration/exploration_space.h"

namespace arex {

/// Whether case C goes with the direction term or stands for itself.
enum class CaseC { kDirected, kAlways, kNever };
inline constexpr std::array<std::string_view, 3> kCaseCNames{"directed", "always", "never"};
constexpr const std::array<std::string_view, 3>& enum_names(CaseC) { return kCaseCNames; }

struct CandidateFilterConfig {
  double obstacle_distance_m = 0.4;  ///< case A
  double min_gain_m2 = 0.3;  ///< case B; as exploration.stop.min_area_m2 (rrt_exploration: 0.2)
  CaseC case_c = CaseC::kDirected;
  double max_angle_rad = 2.1;  ///< case C: 120 deg; the paper prints no value

  void fields(auto& f) {
    f("obstacle_distance_m", obstacle_distance_m, "case A: nearer to an obstacle is dropped");
    f("min_gain_m2", min_gain_m2, "case B: less unknown area is dropped");
    f("case_c", case_c, "case C applies where the revenue is direction-aware, always, or never");
    f("max_angle_rad", max_angle_rad,
      "case C: further from the exploration direction is dropped, unless that leaves none; the "
      "paper prints no width");
    f.check(obstacle_distance_m >= 0, "obstacle_distance_m >= 0");
    f.check(min_gain_m2 >= 0, "min_gain_m2 >= 0");
    f.check(max_angle_rad >= 0, "max_angle_rad >= 0");
  }
};

/// Cases A and B of the paper's figure, by what the map says about the candidate.
void apply_map_filters(std::vector<Candidate>& candidates, const ExplorationSpace& space,
                       const CandidateFilterConfig& config);

/// Case C of the paper's figure, by the candidates' A; does nothing if it would leave none.
void apply_direction_filter(std::vector<Candidate>& candidates,
                            const CandidateFilterConfig& config);

}  // namespace arex
