#include "planning/guide_path.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>

#include "mapping/distance_transform.h"

namespace arex {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kMargin = 20;            ///< cells searched around map, start and goal
constexpr std::size_t kMaxPull = 200;  ///< cells that one straight piece may replace
constexpr double kNoPassage = -1.0;
/// Ends of partial guides that differ by less in what is left to the target are equally near: a
/// wall of half a metre with the distance kept from its two sides.
constexpr double kSameNearness_m = 2.0;
constexpr double kRounding = 1e-6;
/// Extra cost of a metre where nothing but the inflation fits, in comfort weights: only where there
/// is no other way, or one many times as long.
constexpr double kTight = 4.0;
/// Between points of a path that follows the ground: less than a tile of the ground's heights.
constexpr double kLiftStep_m = 0.5;

/// The map grown by everything that the search may enter, as the cost of a metre in each cell. Its
/// outermost cells are blocked: every neighbour of a passable cell is in it.
class CostMap {
 public:
  CostMap(const OccupancyMap2D& map, const Vec2& from, const Vec2& to, const GuideConfig& config)
      : map_(map) {
    const Eigen::Vector2i a = map.cell_of(from), b = map.cell_of(to);
    const Eigen::Vector2i end(map.width - 1, map.height - 1);
    low_ = a.cwiseMin(b).cwiseMin(Eigen::Vector2i::Zero()).array() - kMargin;
    const Eigen::Vector2i high = (a.cwiseMax(b).cwiseMax(end)).array() + kMargin;
    size_ = high - low_ + Eigen::Vector2i::Ones();
    measure_distances();
    const double near = config.obstacle_distance_m;
    const double tight =
        near - config.margin_m;  // the inflation: what the explorer calls reachable
    cost_.resize(distance_.size());
    for (int y = 0; y < size_.y(); ++y) {
      for (int x = 0; x < size_.x(); ++x) {
        const Eigen::Vector2i cell = low_ + Eigen::Vector2i(x, y);
        const std::size_t i = index(cell);
        const double d = distance_[i] * map.resolution;
        const auto at_end = [&, centre = map.centre_of(cell)] {
          return (centre - from).norm() <= near || (centre - to).norm() <= near;
        };
        const bool at_edge = x == 0 || y == 0 || x == size_.x() - 1 || y == size_.y() - 1;
        if (at_edge || d <= 0 || (d < near && !at_end())) {
          const bool fits =
              !at_edge && d > 0 && d > tight - kRounding && map.at(cell) == OccupancyMap2D::kFree;
          cost_[i] = fits ? 1.0 + kTight * config.comfort_weight : kNoPassage;
          continue;
        }
        cost_[i] = 1.0;
        if (map.at(cell) == OccupancyMap2D::kUnknown) cost_[i] += config.unknown_weight;
        if (d < config.comfort_distance_m) {
          const double span = std::max(config.comfort_distance_m - near, 1e-9);
          cost_[i] += config.comfort_weight * std::min(1.0, (config.comfort_distance_m - d) / span);
        }
      }
    }
    const auto width = static_cast<std::uint32_t>(map.width);
    for (const std::uint32_t k : map.flown) {
      double& cost = cost_[index({static_cast<int>(k % width), static_cast<int>(k / width)})];
      if (cost == kNoPassage) cost = 1.0 + config.comfort_weight;
    }
  }

  [[nodiscard]] std::size_t count() const { return cost_.size(); }
  [[nodiscard]] bool contains(const Eigen::Vector2i& cell) const {
    return ((cell - low_).array() >= 0).all() && ((cell - low_).array() < size_.array()).all();
  }
  [[nodiscard]] std::size_t index(const Eigen::Vector2i& cell) const {
    return static_cast<std::size_t>(cell.y() - low_.y()) * static_cast<std::size_t>(size_.x()) +
           static_cast<std::size_t>(cell.x() - low_.x());
  }
  [[nodiscard]] Eigen::Vector2i cell(std::size_t index) const {
    const int i = static_cast<int>(index);
    return low_ + Eigen::Vector2i(i % size_.x(), i / size_.x());
  }
  [[nodiscard]] bool passable(const Eigen::Vector2i& cell) const {
    return contains(cell) && passable(index(cell));
  }
  [[nodiscard]] bool passable(std::size_t index) const { return cost_[index] != kNoPassage; }
  [[nodiscard]] double cost(std::size_t index) const { return cost_[index]; }
  /// From a cell's index to that of the cell one row further on.
  [[nodiscard]] std::ptrdiff_t row() const { return size_.x(); }

  /// Cost of the straight line between two points, infinite if it is blocked.
  [[nodiscard]] double line_cost(const Vec2& a, const Vec2& b) const {
    const double length = (b - a).norm();
    const int n = std::max(1, static_cast<int>(std::ceil(4 * length / map_.resolution)));
    double sum = 0;
    for (int i = 0; i <= n; ++i) {
      const Eigen::Vector2i cell = map_.cell_of(a + (b - a) * (static_cast<double>(i) / n));
      if (!passable(cell)) return kInfinity;
      sum += cost_[index(cell)];
    }
    return sum / (n + 1) * length;
  }

 private:
  /// Distances (cells) to the nearest occupied cell: the same as the explorer's, so that what one
  /// calls passable is passable for the other.
  void measure_distances() {
    std::vector<bool> occupied(static_cast<std::size_t>(size_.x()) *
                               static_cast<std::size_t>(size_.y()));
    for (int y = 0; y < map_.height; ++y) {
      for (int x = 0; x < map_.width; ++x) {
        occupied[index({x, y})] = map_.cells[map_.index({x, y})] == OccupancyMap2D::kOccupied;
      }
    }
    const auto squared =
        squared_distances(size_.x(), size_.y(), [&](std::size_t cell) { return occupied[cell]; });
    distance_.resize(squared.size());
    std::transform(squared.begin(), squared.end(), distance_.begin(), [](std::int32_t d2) {
      return d2 == kNoObstacle ? kInfinity : std::sqrt(static_cast<double>(d2));
    });
  }

  const OccupancyMap2D& map_;
  Eigen::Vector2i low_, size_;
  std::vector<double> distance_, cost_;
};

/// Straightens where the straight line costs no more than the path between its ends.
std::vector<Vec2> shortcut_path(const CostMap& costs, std::span<const Vec2> path) {
  std::vector<Vec2> kept{path.front()};
  std::size_t at = 0;
  while (at + 1 < path.size()) {
    std::size_t next = at + 1;
    double along = costs.line_cost(path[at], path[next]);
    for (std::size_t i = at + 2; i < std::min(path.size(), at + kMaxPull); ++i) {
      along += costs.line_cost(path[i - 1], path[i]);
      const double straight = costs.line_cost(path[at], path[i]);
      if (straight == kInfinity) break;
      if (straight <= along + 1e-9) next = i;
    }
    kept.push_back(path[next]);
    at = next;
  }
  return kept;
}

/// Of the cells reached from which no more than `enough_m` are left: from the one that costs least
/// to get to on, as near to the target as neighbours lead.
template <class Remaining>
std::size_t end_at_hand(const CostMap& costs, const std::vector<double>& cost,
                        const std::vector<bool>& closed, double enough_m,
                        const Remaining& remaining) {
  std::size_t end = 0;
  double least = kInfinity;
  for (std::size_t i = 0; i < closed.size(); ++i) {
    if (!closed[i] || cost[i] >= least || remaining(costs.cell(i)) > enough_m) continue;
    least = cost[i];
    end = i;
  }
  for (bool moved = true; moved;) {
    moved = false;
    const Eigen::Vector2i here = costs.cell(end);
    for (int k = 0; k < 9; ++k) {
      const Eigen::Vector2i there = here + Eigen::Vector2i(k / 3 - 1, k % 3 - 1);
      if (!costs.contains(there) || !closed[costs.index(there)] ||
          remaining(there) >= remaining(costs.cell(end))) {
        continue;
      }
      end = costs.index(there);
      moved = true;
    }
  }
  return end;
}

/// The point of a polyline nearest to p, and the piece of the polyline that holds it.
struct Foot {
  std::size_t piece = 0;
  Vec3 point = Vec3::Zero();
};

Foot project_on(std::span<const Vec3> path, const Vec3& p) {
  Foot best{0, path.front()};
  double best_distance = kInfinity;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const Vec3 d = path[i + 1] - path[i];
    const double u = std::clamp((p - path[i]).dot(d) / std::max(d.squaredNorm(), 1e-12), 0.0, 1.0);
    const Vec3 foot = path[i] + u * d;
    // Of equally near feet the later one: a path that returns is not flown twice.
    if ((foot - p).norm() <= best_distance) {
      best_distance = (foot - p).norm();
      best = {i, foot};
    }
  }
  return best;
}

}  // namespace

GuidePath plan_guide(const OccupancyMap2D& map, const Vec2& from, const Vec2& to,
                     const GuideConfig& config) {
  GuidePath result;
  if (config.mode == GuideMode::kStraight) {
    result.status = GuideStatus::kFound;
    result.points = {from, to};
    result.cost = (to - from).norm();
    return result;
  }
  const CostMap costs(map, from, to, config);
  const Eigen::Vector2i goal_cell = map.cell_of(to);
  const std::size_t source = costs.index(map.cell_of(from)), goal = costs.index(goal_cell);
  std::vector<double> cost(costs.count(), kInfinity);
  std::vector<std::int32_t> parent(costs.count(), -1);
  std::vector<bool> closed(costs.count(), false);
  const auto remaining = [&](const Eigen::Vector2i& cell) {
    const Eigen::Vector2i d = (cell - goal_cell).cwiseAbs();
    return map.resolution * (d.maxCoeff() + (M_SQRT2 - 1) * d.minCoeff());  // octile
  };
  using Entry = std::pair<double, std::size_t>;  // ties by index
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  cost[source] = 0;
  std::size_t nearest = source;
  double least = remaining(costs.cell(source));
  open.push({least, source});
  while (!open.empty() && result.expansions < config.max_expansions) {
    const std::size_t node = open.top().second;
    open.pop();
    if (closed[node]) continue;
    closed[node] = true;
    ++result.expansions;
    const Eigen::Vector2i cell = costs.cell(node);
    if (const double left = remaining(cell); left < least) {
      least = left;
      nearest = node;
    }
    if (node == goal) break;
    const auto beside = [&](std::ptrdiff_t offset) {
      return static_cast<std::size_t>(static_cast<std::ptrdiff_t>(node) + offset);
    };
    for (int k = 0; k < 9; ++k) {
      const Eigen::Vector2i step(k / 3 - 1, k % 3 - 1);
      const std::size_t there = beside(step.y() * costs.row() + step.x());
      if (k == 4 || closed[there] || !costs.passable(there)) continue;
      const bool diagonal = step.x() != 0 && step.y() != 0;
      // The start's own cell may be blocked; it is only left, never passed by.
      if (diagonal &&
          (!costs.passable(beside(step.x())) || !costs.passable(beside(step.y() * costs.row())))) {
        continue;
      }
      const double length = map.resolution * (diagonal ? M_SQRT2 : 1.0);
      const double here = std::max(1.0, costs.cost(node));
      const double through = cost[node] + length * 0.5 * (here + costs.cost(there));
      if (through >= cost[there]) continue;
      cost[there] = through;
      parent[there] = static_cast<std::int32_t>(node);
      open.push({through + remaining(cell + step), there});
    }
  }
  const bool found = closed[goal];
  if (!found) nearest = end_at_hand(costs, cost, closed, least + kSameNearness_m, remaining);
  result.status = found ? GuideStatus::kFound : GuideStatus::kPartial;
  result.cost = cost[nearest];
  std::vector<Vec2> path;
  for (auto at = static_cast<std::int32_t>(nearest); at >= 0;
       at = parent[static_cast<std::size_t>(at)]) {
    path.push_back(map.centre_of(costs.cell(static_cast<std::size_t>(at))));
  }
  std::reverse(path.begin(), path.end());
  path.front() = from;
  if (found) path.back() = to;
  if (path.size() == 1) path.push_back(found ? to : from);
  result.points = shortcut_path(costs, path);
  return result;
}

std::vector<Vec3> lift_path(std::span<const Vec2> path, double from_z, double to_z) {
  double length = 0;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) length += (path[i + 1] - path[i]).norm();
  std::vector<Vec3> lifted;
  double walked = 0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (i > 0) walked += (path[i] - path[i - 1]).norm();
    const double share = length > 0 ? walked / length : 1.0;
    lifted.push_back({path[i].x(), path[i].y(), from_z + share * (to_z - from_z)});
  }
  return lifted;
}

std::vector<Vec3> lift_path(std::span<const Vec2> path, double from_z, double to_z,
                            const GroundHeights& ground) {
  std::vector<Vec2> fine;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const Vec2 piece = path[i + 1] - path[i];
    const int n = std::max(1, static_cast<int>(std::ceil(piece.norm() / kLiftStep_m)));
    for (int k = 0; k < n; ++k) fine.push_back(path[i] + piece * (static_cast<double>(k) / n));
  }
  if (!path.empty()) fine.push_back(path.back());
  double last = 0;
  std::vector<double> heights;
  for (const Vec2& p : fine) {
    if (const double height = ground.at(p); std::isfinite(height)) last = height;
    heights.push_back(last);
  }
  if (fine.empty()) return {};
  std::vector<Vec3> lifted = lift_path(fine, from_z - heights.front(), to_z - heights.back());
  for (std::size_t i = 0; i < lifted.size(); ++i) lifted[i].z() += heights[i];
  return lifted;
}

double length_ahead(std::span<const Vec3> path, const Vec3& p) {
  if (path.empty()) return 0;
  const Foot foot = project_on(path, p);
  double length = (foot.point - p).norm();
  Vec3 at = foot.point;
  for (std::size_t i = foot.piece + 1; i < path.size(); ++i) {
    length += (path[i] - at).norm();
    at = path[i];
  }
  return length;
}

Vec3 point_ahead(std::span<const Vec3> path, const Vec3& p, double ahead_m) {
  if (path.size() < 2) return path.empty() ? p : path.front();
  const Foot foot = project_on(path, p);
  Vec3 at = foot.point;
  for (std::size_t i = foot.piece; i + 1 < path.size(); ++i) {
    const double piece = (path[i + 1] - at).norm();
    if (piece >= ahead_m) return at + (path[i + 1] - at) * (ahead_m / piece);
    ahead_m -= piece;
    at = path[i + 1];
  }
  return path.back();
}

}  // namespace arex
