#include "exploration/candidate_filter.h"

#include <algorithm>

namespace arex {

void apply_map_filters(std::vector<Candidate>& candidates, const ExplorationSpace& space,
                       const CandidateFilterConfig& config) {
  for (Candidate& c : candidates) {
    if (c.verdict != Verdict::kKept) continue;
    if (space.clearance(space.map().cell_of(c.point)) < config.obstacle_distance_m) {
      c.verdict = Verdict::kNearObstacle;
    } else if (c.information_m2 < config.min_gain_m2) {
      c.verdict = Verdict::kLittleGain;
    }
  }
}

void apply_direction_filter(std::vector<Candidate>& candidates,
                            const CandidateFilterConfig& config) {
  const auto is_kept = [](const Candidate& c) { return c.verdict == Verdict::kKept; };
  const auto is_off = [&](const Candidate& c) {
    return c.angle_rad && *c.angle_rad > config.max_angle_rad;
  };
  const bool leaves_some = std::any_of(candidates.begin(), candidates.end(),
                                       [&](const auto& c) { return is_kept(c) && !is_off(c); });
  if (!leaves_some) return;
  for (Candidate& c : candidates) {
    if (is_kept(c) && is_off(c)) c.verdict = Verdict::kOffDirection;
  }
}

}  // namespace arex
