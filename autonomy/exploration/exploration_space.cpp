#include "exploration/exploration_space.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "mapping/distance_transform.h"
#include "mapping/line_walk.h"

namespace arex {
namespace {

// Straight and diagonal steps in integers: 99/70 is the square root of 2 to 4 digits, and integer
// costs make a whole priority queue of a ring of buckets.
constexpr std::uint32_t kStraight = 70, kDiagonal = 99;

}  // namespace

ExplorationSpace::ExplorationSpace(const OccupancyMap2D& map, const ExplorationBounds& bounds,
                                   const SpaceConfig& config, const Vec2& robot,
                                   std::span<const std::uint32_t> flown_since)
    : map_(map), bounds_(bounds), config_(config) {
  classify();
  measure_clearance();
  for (const std::uint32_t cell : map_.flown) flags_[cell] |= kPassable;
  for (const std::uint32_t cell : flown_since) flags_[cell] |= kPassable;
  travel_.assign(flags_.size(), kFar);
  find_start(robot);
  if (map_.contains(map_.cell_of(robot))) flood(robot);
}

void ExplorationSpace::classify() {
  const auto width = static_cast<std::size_t>(map_.width);
  flags_.assign(map_.cells.size(), 0);
  unknown_count_.assign((width + 1) * static_cast<std::size_t>(map_.height), 0);
  for (int y = 0; y < map_.height; ++y) {
    const Vec2 row = map_.centre_of({0, y});
    const ExplorationBounds::Row inside_row = bounds_.row(row.y());
    const std::size_t base = static_cast<std::size_t>(y) * width;
    std::int32_t* count = unknown_count_.data() + static_cast<std::size_t>(y) * (width + 1);
    for (std::size_t x = 0; x < width; ++x) {
      const double at = row.x() + map_.resolution * static_cast<double>(x);
      const bool inside = inside_row.contains(at);
      const std::int8_t state = map_.cells[base + x];
      std::uint8_t flags = inside ? kInside : std::uint8_t{0};
      if (state == OccupancyMap2D::kFree) flags |= kFree;
      if (state == OccupancyMap2D::kUnknown && inside) flags |= kUnknown;
      flags_[base + x] = flags;
      count[x + 1] = count[x] + ((flags & kUnknown) != 0 ? 1 : 0);
    }
  }
}

/// The cells that the vehicle's centre may pass.
void ExplorationSpace::measure_clearance() {
  clearance_ = squared_distances(map_.width, map_.height, [&](std::size_t i) {
    return map_.cells[i] == OccupancyMap2D::kOccupied;
  });
  for (std::size_t i = 0; i < flags_.size(); ++i) {
    if ((flags_[i] & kFree) != 0 && is_clear(i)) flags_[i] |= kClear | kPassable;
  }
}

bool ExplorationSpace::is_clear(std::size_t cell) const {
  const double radius_cells = config_.travel_radius_m / map_.resolution;
  return clearance_[cell] >= radius_cells * radius_cells - 1e-6;
}

template <class Accepts>
std::optional<Eigen::Vector2i> ExplorationSpace::nearest_cell(const Vec2& p,
                                                              Accepts&& accepts) const {
  const Eigen::Vector2i centre = map_.cell_of(p);
  if (map_.contains(centre) && accepts(centre)) return centre;
  const int reach = static_cast<int>(std::ceil(config_.start_reach_m / map_.resolution));
  std::optional<Eigen::Vector2i> nearest;
  double best = config_.start_reach_m;
  for (int dy = -reach; dy <= reach; ++dy) {
    for (int dx = -reach; dx <= reach; ++dx) {
      const Eigen::Vector2i cell = centre + Eigen::Vector2i(dx, dy);
      if (!map_.contains(cell) || !accepts(cell)) continue;
      const double distance = (map_.centre_of(cell) - p).norm();
      if (distance >= best) continue;
      bool blocked = false;
      walk_line(map_, p, map_.centre_of(cell), [&](const Eigen::Vector2i& c) {
        blocked = map_.at(c) == OccupancyMap2D::kOccupied && c != centre;
        return !blocked;
      });
      if (blocked) continue;
      best = distance;
      nearest = cell;
    }
  }
  return nearest;
}

void ExplorationSpace::find_start(const Vec2& robot) {
  start_ = robot;
  const auto cell = nearest_cell(
      robot, [&](const Eigen::Vector2i& c) { return (flags_[map_.index(c)] & kClear) != 0; });
  if (!cell || *cell == map_.cell_of(robot)) return;
  start_ = map_.centre_of(*cell);
  walk_line(map_, robot, start_, [&](const Eigen::Vector2i& c) {
    if (map_.contains(c)) flags_[map_.index(c)] |= kPassable;
    return true;
  });
}

std::optional<Eigen::Vector2i> ExplorationSpace::nearest_reachable(const Vec2& p) const {
  return nearest_cell(p, [&](const Eigen::Vector2i& c) { return is_reachable(c); });
}

void ExplorationSpace::flood(const Vec2& robot) {
  constexpr std::size_t kRing = kDiagonal + 1;
  std::array<std::vector<std::uint32_t>, kRing> buckets;
  const int width = map_.width;
  const std::size_t first = map_.index(map_.cell_of(robot));
  if ((flags_[first] & kPassable) == 0) return;
  travel_[first] = 0;
  buckets[0].push_back(static_cast<std::uint32_t>(first));
  std::uint32_t cost = 0;
  std::size_t open = 1;
  const std::array<int, 4> dx{1, 0, -1, 0}, dy{0, 1, 0, -1};
  for (; open > 0; ++cost) {
    std::vector<std::uint32_t>& bucket = buckets[cost % kRing];
    for (std::size_t k = 0; k < bucket.size(); ++k) {  // steps are longer than 0: it does not grow
      --open;
      const std::uint32_t i = bucket[k];
      if (travel_[i] != cost) continue;
      has_start_ |= (flags_[i] & kClear) != 0;
      const int x = static_cast<int>(i) % width, y = static_cast<int>(i) / width;
      const auto relax = [&](std::size_t to, std::uint32_t step) {
        if (cost + step >= travel_[to]) return;
        travel_[to] = cost + step;
        buckets[(cost + step) % kRing].push_back(static_cast<std::uint32_t>(to));
        ++open;
      };
      std::array<bool, 4> side{};
      const auto neighbour = [&](int ax, int ay) {
        return static_cast<std::size_t>(y + ay) * static_cast<std::size_t>(width) +
               static_cast<std::size_t>(x + ax);
      };
      for (std::size_t s = 0; s < 4; ++s) {
        if (!map_.contains({x + dx[s], y + dy[s]})) continue;
        const std::size_t to = neighbour(dx[s], dy[s]);
        side[s] = (flags_[to] & kPassable) != 0;
        if (side[s]) relax(to, kStraight);
      }
      for (std::size_t s = 0; s < 4; ++s) {
        const std::size_t t = (s + 1) % 4;
        if (!side[s] || !side[t]) continue;
        const std::size_t to = neighbour(dx[s] + dx[t], dy[s] + dy[t]);
        if ((flags_[to] & kPassable) != 0) relax(to, kDiagonal);
      }
    }
    bucket.clear();
  }
}

bool ExplorationSpace::reaches_flown() const {
  return std::all_of(map_.flown.begin(), map_.flown.end(),
                     [&](std::uint32_t cell) { return travel_[cell] != kFar; });
}

bool ExplorationSpace::is_frontier(const Eigen::Vector2i& cell) const {
  return is_unknown(cell) &&
         (is_free({cell.x() - 1, cell.y()}) || is_free({cell.x() + 1, cell.y()}) ||
          is_free({cell.x(), cell.y() - 1}) || is_free({cell.x(), cell.y() + 1}));
}

double ExplorationSpace::clearance(const Eigen::Vector2i& cell) const {
  if (!map_.contains(cell)) return 0;
  const std::int32_t squared = clearance_[map_.index(cell)];
  if (squared == kNoObstacle) return std::numeric_limits<double>::infinity();
  return map_.resolution * std::sqrt(static_cast<double>(squared));
}

double ExplorationSpace::travel_distance(const Eigen::Vector2i& cell) const {
  if (!is_reachable(cell)) return kUnreachable;
  return map_.resolution * travel_[map_.index(cell)] / kStraight;
}

double ExplorationSpace::unknown_area(const Vec2& p) const {
  const double radius = config_.information_radius_m;
  const Vec2 low = (p - map_.origin - Vec2::Constant(radius)) / map_.resolution;
  const Vec2 high = (p - map_.origin + Vec2::Constant(radius)) / map_.resolution;
  const int y_first = std::max(0, static_cast<int>(std::floor(low.y())));
  const int y_last = std::min(map_.height - 1, static_cast<int>(std::floor(high.y())));
  std::int64_t count = 0;
  for (int y = y_first; y <= y_last; ++y) {
    const double dy = map_.centre_of({0, y}).y() - p.y();
    const double half2 = radius * radius - dy * dy + 1e-9;
    if (half2 < 0) continue;
    // Cells whose centres lie between these two, in cell units.
    const double half = std::sqrt(half2) / map_.resolution;
    const double middle = (p.x() - map_.origin.x()) / map_.resolution - 0.5;
    const int x_first = std::max(0, static_cast<int>(std::ceil(middle - half)));
    const int x_end = std::min(map_.width, static_cast<int>(std::floor(middle + half)) + 1);
    if (x_first >= x_end) continue;
    const std::int32_t* row =
        unknown_count_.data() +
        static_cast<std::size_t>(y) * (static_cast<std::size_t>(map_.width) + 1);
    count += row[x_end] - row[x_first];
  }
  return static_cast<double>(count) * map_.resolution * map_.resolution;
}

template <class Accepts>
double ExplorationSpace::flood_unknown(std::vector<Eigen::Vector2i> open, double enough_m2,
                                       Accepts&& accepts) const {
  const std::array<Eigen::Vector2i, 4> sides{Eigen::Vector2i{1, 0}, {-1, 0}, {0, 1}, {0, -1}};
  std::vector<bool> met(flags_.size());
  for (const Eigen::Vector2i& cell : open) met[map_.index(cell)] = true;
  double unknown_m2 = 0;
  while (!open.empty() && unknown_m2 < enough_m2) {
    const Eigen::Vector2i cell = open.back();
    open.pop_back();
    if (is_unknown(cell)) unknown_m2 += map_.resolution * map_.resolution;
    for (const Eigen::Vector2i& side : sides) {
      const Eigen::Vector2i next = cell + side;
      if (!map_.contains(next) || met[map_.index(next)] || !accepts(next)) continue;
      met[map_.index(next)] = true;
      open.push_back(next);
    }
  }
  return unknown_m2;
}

double ExplorationSpace::unknown_left(double enough_m2) const {
  std::vector<Eigen::Vector2i> reachable;
  for (int y = 0; y < map_.height; ++y) {
    for (int x = 0; x < map_.width; ++x) {
      if (travel_[map_.index({x, y})] != kFar) reachable.emplace_back(x, y);
    }
  }
  // Ways may lead outside the bounds.
  return flood_unknown(std::move(reachable), enough_m2,
                       [&](const Eigen::Vector2i& cell) { return is_clear(map_.index(cell)); });
}

double ExplorationSpace::unknown_pocket(const Vec2& p, double enough_m2) const {
  const Eigen::Vector2i cell = map_.cell_of(p);
  if (!is_unknown(cell)) return 0;
  return flood_unknown({cell}, enough_m2,
                       [&](const Eigen::Vector2i& next) { return is_unknown(next); });
}

double ExplorationSpace::reachable_area() const {
  std::int64_t count = 0;
  for (std::size_t i = 0; i < flags_.size(); ++i) {
    count += travel_[i] != kFar && (flags_[i] & kInside) != 0 ? 1 : 0;
  }
  return static_cast<double>(count) * map_.resolution * map_.resolution;
}

bool ExplorationSpace::sees(const Vec2& from, const Eigen::Vector2i& target) const {
  bool clear = true;
  walk_line(map_, from, map_.centre_of(target), [&](const Eigen::Vector2i& cell) {
    if (cell == target) return false;
    clear = is_free(cell);
    return clear;
  });
  return clear;
}

}  // namespace arex
