#include "exploration/viewpoint.h"

#include <algorithm>

namespace arex {

ViewpointFinder::ViewpointFinder(const ViewpointConfig& config, double resolution_m)
    : config_(config) {
  const int reach = static_cast<int>(config.max_distance_m / resolution_m);
  for (int y = -reach; y <= reach; ++y) {
    for (int x = -reach; x <= reach; ++x) {
      if (x * x + y * y <= reach * reach) offsets_.emplace_back(x, y);
    }
  }
  std::stable_sort(offsets_.begin(), offsets_.end(),
                   [](const auto& a, const auto& b) { return a.squaredNorm() < b.squaredNorm(); });
  while (first_standing_off_ < offsets_.size() &&
         resolution_m * offsets_[first_standing_off_].cast<double>().norm() < config.standoff_m) {
    ++first_standing_off_;
  }
}

std::optional<Vec2> ViewpointFinder::find(const ExplorationSpace& space, const Vec2& point,
                                          const Vec2& seen_from) const {
  const OccupancyMap2D& map = space.map();
  const Eigen::Vector2i target = map.cell_of(point);
  const auto search = [&](std::size_t first, double clearance) -> std::optional<Vec2> {
    for (std::size_t i = first; i < offsets_.size(); ++i) {
      const Eigen::Vector2i cell = target + offsets_[i];
      if (!space.is_reachable(cell) || space.clearance(cell) < clearance) continue;
      if (space.sees(map.centre_of(cell), target)) return map.centre_of(cell);
    }
    return std::nullopt;
  };
  if (const auto best = search(first_standing_off_, config_.clearance_m)) return best;
  if (const auto near = search(0, 0)) return near;
  const Eigen::Vector2i cell = map.cell_of(seen_from);
  if (space.is_reachable(cell) && space.sees(seen_from, target)) return seen_from;
  return std::nullopt;
}

}  // namespace arex
