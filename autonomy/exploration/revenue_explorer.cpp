#include "exploration/revenue_explorer.h"

namespace arex {

RevenueExplorer::RevenueExplorer(const ExplorerConfig& config, double resolution_m,
                                 std::uint64_t seed)
    : FrontierExplorer(config, resolution_m), detector_(config.detector, seed) {}

void RevenueExplorer::choose(Decision& decision, const ExplorationSpace& space,
                             const ExplorerInput& input) {
  static constexpr std::array<std::string_view, 3> kNames{"trees", "exhaustive", "forgiving"};
  for (const auto source : {Source::kTrees, Source::kExhaustive, Source::kForgiving}) {
    decision.source = kNames[static_cast<std::size_t>(source)];
    decision.candidates = assess(source, space, input);
    if (any_worthwhile(decision.candidates)) return select(decision);
    if (!config().stop.exhaustive) return;
  }
}

std::vector<Candidate> RevenueExplorer::assess(Source source, const ExplorationSpace& space,
                                               const ExplorerInput& input) const {
  std::vector<FrontierPoint> points;
  if (source == Source::kTrees) {
    points = detector_.points();
  } else {
    for (const Frontier& frontier : find_frontiers(space)) {
      points.insert(points.end(), frontier.points.begin(), frontier.points.end());
    }
  }
  auto candidates = candidates_at(points, space, input.now, source == Source::kForgiving);
  filter(candidates, space);
  for (Candidate& c : candidates) {
    if (c.verdict != Verdict::kKept) continue;
    c.distance_m = config().revenue.distance == DistanceKind::kEuclidean
                       ? (c.point - input.p_OB.head<2>()).norm()
                       : path_length(c, space);
    c.angle_rad = direction_angle(history_, c.point);
    evaluate_revenue(c, config().revenue);
  }
  return candidates;
}

void RevenueExplorer::select(Decision& decision) {
  const bool directed = config().revenue.direction_aware;
  const CaseC case_c = config().filter.case_c;
  if (directed) decision.undirected_winner = best_undirected(decision.candidates);
  if (case_c == CaseC::kAlways || (case_c == CaseC::kDirected && directed)) {
    apply_direction_filter(decision.candidates, config().filter);
  }
  decision.winner = best_candidate(decision.candidates);
  if (decision.winner) history_.push(decision.candidates[*decision.winner].point);
}

}  // namespace arex
