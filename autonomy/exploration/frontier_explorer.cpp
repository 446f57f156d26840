#include "exploration/frontier_explorer.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace arex {

Vec3 at_flight_height(const ExplorerConfig& config, const Vec2& place, const OccupancyMap2D& map) {
  // Ground is known wherever a column is known free, which all that is flown to is.
  const double ground = config.follow_ground ? map.ground.at(place) : 0.0;
  return {place.x(), place.y(), config.flight_height_m + (std::isfinite(ground) ? ground : 0.0)};
}

FrontierExplorer::FrontierExplorer(const ExplorerConfig& config, double resolution_m)
    : config_(config), viewpoints_(config.viewpoint, resolution_m), blacklist_(config.blacklist) {}

Decision FrontierExplorer::decide(const OccupancyMap2D& map, const ExplorerInput& input) {
  Decision decision;
  decision.stamp = input.now;
  decision.sequence = sequence_++;
  const ExplorationSpace space(map, config_.bounds, config_.space, input.p_OB.head<2>(),
                               input.flown_since);
  observe(space);
  balance(decision, space, input);
  decision.previous_end = settle_target(space, input);
  if (decision.energy.must_stop()) {
    decision.kind = DecisionKind::kStop;
    decision.stop_reason = StopReason::kBattery;
    target_.reset();
  } else if (target_) {
    decision.kind = DecisionKind::kKeepTarget;
    set_goal(decision, map);
  } else if (!space.has_start() && space.reaches_flown()) {
    decision.kind = DecisionKind::kWait;
  } else if (way_back_O_ && input.progress == TargetProgress::kUnderWay && !space.reaches_flown()) {
    decision.kind = DecisionKind::kKeepTarget;
    decision.goal_O = *way_back_O_;
  } else {
    if (way_back_O_ && input.progress == TargetProgress::kUnreachable) ++lost_ways_back_;
    way_back_O_.reset();
    go_on(decision, space, input);
  }
  return decision;
}

bool FrontierExplorer::little_is_left(const Decision& decision,
                                      const ExplorationSpace& space) const {
  const double enough = config_.stop.left_fraction * space.reachable_area();
  if (enough == 0 || !space.reaches_flown() || space.unknown_left(enough) >= enough) return false;
  // That no vehicle fits through to it may be the map's error: what fills the disc of f_I is worth
  // a look, and in however large a world.
  const double disc =
      M_PI * config_.space.information_radius_m * config_.space.information_radius_m;
  return std::none_of(decision.candidates.begin(), decision.candidates.end(), [&](const auto& c) {
    return c.verdict == Verdict::kKept && space.unknown_pocket(c.point, disc) >= disc;
  });
}

void FrontierExplorer::balance(Decision& decision, const ExplorationSpace& space,
                               const ExplorerInput& input) const {
  const double straight = (input.home_O - input.p_OB).head<2>().norm();
  const auto home = space.nearest_reachable(input.home_O.head<2>());
  // What lies between home and the known-free space is taken straight.
  decision.home_distance_m =
      home ? space.travel_distance(*home) +
                 (space.map().centre_of(*home) - input.home_O.head<2>()).norm()
           : config_.stop.detour_factor * straight;
  decision.home_distance_m = std::max(decision.home_distance_m, straight);
  decision.energy = balance_energy(input.energy, decision.home_distance_m, config_.stop);
}

TargetEnd FrontierExplorer::settle_target(const ExplorationSpace& space,
                                          const ExplorerInput& input) {
  if (!target_) return TargetEnd::kNone;
  const Vec2 point = target_->point;
  const auto end = [&](TargetEnd how) {
    target_.reset();
    return how;
  };
  switch (input.progress) {
    case TargetProgress::kUnreachable:
      blacklist_.strike(point, input.now);
      return end(TargetEnd::kUnreachable);
    case TargetProgress::kReached:
      if (!space.is_frontier(space.map().cell_of(point))) return end(TargetEnd::kReached);
      blacklist_.strike(point, input.now);
      return end(TargetEnd::kStillUnknown);
    case TargetProgress::kUnderWay:
      break;
  }
  if (config_.reevaluate && !is_worthwhile(space, point)) {
    note_dropped(input.p_OB);
    return end(TargetEnd::kSeen);
  }
  if (space.has_start() && !space.is_reachable(space.map().cell_of(target_->viewpoint))) {
    const auto other = viewpoints_.find(space, point, target_->viewpoint);
    if (!other) {
      note_dropped(input.p_OB);
      return end(TargetEnd::kCutOff);
    }
    target_->viewpoint = *other;
  }
  return TargetEnd::kNone;
}

bool FrontierExplorer::is_worthwhile(const ExplorationSpace& space, const Vec2& point) const {
  if (space.unknown_area(point) < config_.filter.min_gain_m2) return false;
  // The unknown behind a wall stays unknown for ever: only what borders free space counts.
  const OccupancyMap2D& map = space.map();
  const Eigen::Vector2i centre = map.cell_of(point);
  const int reach = static_cast<int>(space.information_radius_m() / map.resolution);
  for (int dy = -reach; dy <= reach; ++dy) {
    for (int dx = -reach; dx <= reach; ++dx) {
      const Eigen::Vector2i cell = centre + Eigen::Vector2i(dx, dy);
      if (dx * dx + dy * dy <= reach * reach && space.is_frontier(cell) &&
          space.clearance(cell) >= config_.filter.obstacle_distance_m) {
        return true;
      }
    }
  }
  return false;
}

void FrontierExplorer::go_on(Decision& decision, const ExplorationSpace& space,
                             const ExplorerInput& input) {
  choose(decision, space, input);
  if (!decision.winner) {
    const bool ends = !config_.stop.exhaustive || !go_back(decision, space, input);
    const bool any = std::any_of(decision.candidates.begin(), decision.candidates.end(),
                                 [](const auto& c) { return c.verdict == Verdict::kKept; });
    if (ends) stop(decision, space, any ? StopReason::kLittleLeft : StopReason::kNoCandidates);
    return;
  }
  if (little_is_left(decision, space)) return stop(decision, space, StopReason::kLittleLeft);
  lost_ways_back_ = 0;
  const Candidate& winner = decision.candidates[*decision.winner];
  target_ = Target{winner.point, winner.viewpoint};
  decision.kind = DecisionKind::kNewTarget;
  set_goal(decision, space.map());
}

bool FrontierExplorer::go_back(Decision& decision, const ExplorationSpace& space,
                               const ExplorerInput& input) {
  constexpr int kTries = 3;
  const OccupancyMap2D& map = space.map();
  if (space.reaches_flown() || lost_ways_back_ >= kTries) return false;
  const auto width = static_cast<std::uint32_t>(map.width);
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < map.flown.size(); ++k) {
    const Eigen::Vector2i cell(static_cast<int>(map.flown[k] % width),
                               static_cast<int>(map.flown[k] / width));
    const double distance = (map.centre_of(cell) - input.p_OB.head<2>()).norm();
    if (space.is_reachable(cell) || distance >= nearest) continue;
    nearest = distance;
    way_back_O_ = Vec3(map.centre_of(cell).x(), map.centre_of(cell).y(), map.flown_height_m[k]);
  }
  decision.kind = DecisionKind::kGoBack;
  decision.goal_O = *way_back_O_;
  return true;
}

void FrontierExplorer::stop(Decision& decision, const ExplorationSpace& space, StopReason reason) {
  decision.kind = DecisionKind::kStop;
  decision.stop_reason = reason;
  decision.open_frontier_m2 = 0;
  for (const Frontier& frontier : find_frontiers(space)) {
    decision.open_frontier_m2 = std::max(*decision.open_frontier_m2, frontier.unknown_area_m2);
  }
}

void FrontierExplorer::set_goal(Decision& decision, const OccupancyMap2D& map) const {
  decision.target = target_->point;
  decision.goal_O = at_flight_height(config_, target_->viewpoint, map);
}

std::vector<Candidate> FrontierExplorer::candidates_at(std::span<const FrontierPoint> points,
                                                       const ExplorationSpace& space, Stamp now,
                                                       bool forgiving) const {
  std::vector<Candidate> candidates;
  for (const FrontierPoint& p : points) {
    Candidate& c = candidates.emplace_back();
    c.point = p.point;
    c.seen_from = p.seen_from;
    c.information_m2 = space.unknown_area(p.point);
    const bool barred = forgiving ? blacklist_.gave_up(p.point) : blacklist_.bars(p.point, now);
    if (barred) c.verdict = Verdict::kBlacklisted;
  }
  return candidates;
}

void FrontierExplorer::filter(std::vector<Candidate>& candidates,
                              const ExplorationSpace& space) const {
  apply_map_filters(candidates, space, config_.filter);
  for (Candidate& c : candidates) {
    if (c.verdict != Verdict::kKept) continue;
    if (const auto viewpoint = viewpoints_.find(space, c.point, c.seen_from)) {
      c.viewpoint = *viewpoint;
    } else {
      c.verdict = Verdict::kNoViewpoint;
    }
  }
}

double FrontierExplorer::path_length(const Candidate& candidate, const ExplorationSpace& space) {
  return space.travel_distance(space.map().cell_of(candidate.viewpoint)) +
         (candidate.point - candidate.viewpoint).norm();
}

bool FrontierExplorer::any_worthwhile(std::span<const Candidate> candidates) const {
  return std::any_of(candidates.begin(), candidates.end(), [&](const Candidate& c) {
    return c.verdict == Verdict::kKept && c.information_m2 >= config_.stop.min_area_m2;
  });
}

}  // namespace arex
