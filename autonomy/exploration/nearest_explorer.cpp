#include "exploration/nearest_explorer.h"

#include <limits>

namespace arex {

void NearestExplorer::choose(Decision& decision, const ExplorationSpace& space,
                             const ExplorerInput& input) {
  std::vector<FrontierPoint> points;
  for (const Frontier& frontier : find_frontiers(space)) {
    points.insert(points.end(), frontier.points.begin(), frontier.points.end());
  }
  decision.source = "frontiers";
  for (const bool forgiving : {false, true}) {
    decision.candidates = candidates_at(points, space, input.now, forgiving);
    filter(decision.candidates, space);
    for (Candidate& c : decision.candidates) {
      if (c.verdict != Verdict::kKept) continue;
      c.distance_m = path_length(c, space);
      // What is too small for a flight is no rival, but it says that little is left.
      const bool worthwhile = c.information_m2 >= config().stop.min_area_m2;
      c.revenue = worthwhile ? -c.distance_m : -std::numeric_limits<double>::infinity();
    }
    if (!any_worthwhile(decision.candidates)) continue;
    decision.winner = best_candidate(decision.candidates);
    return;
  }
}

}  // namespace arex
