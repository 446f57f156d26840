#include "exploration/revenue.h"

#include <cmath>

namespace arex {

std::optional<double> direction_angle(const TargetHistory& history, const Vec2& point) {
  if (!history.last || !history.before_last) return std::nullopt;
  const Vec2 before = *history.last - *history.before_last;
  const Vec2 next = point - *history.last;
  if (before.isZero() || next.isZero()) return std::nullopt;
  const double cross = before.x() * next.y() - before.y() * next.x();
  return std::abs(std::atan2(cross, before.dot(next)));
}

void evaluate_revenue(Candidate& candidate, const RevenueConfig& config) {
  const double hysteresis =
      candidate.distance_m <= config.hysteresis_radius_m ? config.hysteresis_gain : 1.0;
  candidate.direction =
      candidate.angle_rad ? std::exp(config.weight_direction * *candidate.angle_rad) : 1.0;
  candidate.revenue = config.weight_information * hysteresis * candidate.information_m2 -
                      config.weight_distance * candidate.distance_m;
  if (config.direction_aware) candidate.revenue -= candidate.direction;
}

namespace {

template <class Revenue>
std::optional<std::size_t> best_by(std::span<const Candidate> candidates, const Revenue& revenue) {
  std::optional<std::size_t> best;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (candidates[i].verdict != Verdict::kKept) continue;
    if (!best || revenue(candidates[i]) > revenue(candidates[*best])) best = i;
  }
  return best;
}

}  // namespace

std::optional<std::size_t> best_candidate(std::span<const Candidate> candidates) {
  return best_by(candidates, [](const Candidate& c) { return c.revenue; });
}

std::optional<std::size_t> best_undirected(std::span<const Candidate> candidates) {
  return best_by(candidates, [](const Candidate& c) { return c.revenue + c.direction; });
}

}  // namespace arex
