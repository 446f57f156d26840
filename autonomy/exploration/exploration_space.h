#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "exploration/exploration_bounds.h"
#include "mapping/occupancy_map_2d.h"

namespace arex {

struct SpaceConfig {
  /// Distance from obstacles at which the vehicle's centre may pass; handed down from
  /// planning.inflation_m.
  double travel_radius_m = 0.5;
  double start_reach_m = 1.5;
  double information_radius_m = 1.0;

  void fields(auto& f) {
    f("start_reach_m", start_reach_m,
      "how far from the vehicle the known-free space may begin: cells below it may be unseen");
    f("information_radius_m", information_radius_m,
      "radius of the disc whose unknown area is f_I (rrt_exploration)");
    f.check(start_reach_m >= 0 && start_reach_m <= 50, "0 <= start_reach_m <= 50");
    f.check(information_radius_m > 0 && information_radius_m <= 50,
            "0 < information_radius_m <= 50");
  }
};

/// What one exploration decision needs to know of the map, computed once and then looked up: what
/// is free or unknown inside the bounds, how far the nearest obstacle is, where the vehicle can go
/// through known-free space and how far that is, how much is unknown around a point.
/// Positions in O; distances in m. The map must outlive this; what lies outside the map's array is
/// not explored. `flown_since`: cells flown through since the map was made.
class ExplorationSpace {
 public:
  static constexpr double kUnreachable = std::numeric_limits<double>::infinity();

  ExplorationSpace(const OccupancyMap2D& map, const ExplorationBounds& bounds,
                   const SpaceConfig& config, const Vec2& robot,
                   std::span<const std::uint32_t> flown_since = {});

  [[nodiscard]] const OccupancyMap2D& map() const { return map_; }
  [[nodiscard]] const ExplorationBounds& bounds() const { return bounds_; }
  [[nodiscard]] double information_radius_m() const { return config_.information_radius_m; }

  [[nodiscard]] bool is_free(const Eigen::Vector2i& cell) const {
    return map_.contains(cell) && (flags_[map_.index(cell)] & kFree) != 0;
  }
  /// Unknown, and inside the bounds: worth seeing.
  [[nodiscard]] bool is_unknown(const Eigen::Vector2i& cell) const {
    return map_.contains(cell) && (flags_[map_.index(cell)] & kUnknown) != 0;
  }
  [[nodiscard]] bool is_inside(const Eigen::Vector2i& cell) const {
    return map_.contains(cell) && (flags_[map_.index(cell)] & kInside) != 0;
  }
  /// An unknown cell inside the bounds that shares a side with a known-free one.
  [[nodiscard]] bool is_frontier(const Eigen::Vector2i& cell) const;

  /// Between the centres of a cell and of the nearest occupied one; infinite without any.
  [[nodiscard]] double clearance(const Eigen::Vector2i& cell) const;

  /// Whether the vehicle stands in or beside known-free space that it can leave.
  [[nodiscard]] bool has_start() const { return has_start_; }
  /// Where its known-free space begins: the nearest clear point to the vehicle; where there is none
  /// but the way back, the vehicle's own place.
  [[nodiscard]] const Vec2& start() const { return start_; }
  [[nodiscard]] bool is_reachable(const Eigen::Vector2i& cell) const {
    return map_.contains(cell) && travel_[map_.index(cell)] != kFar;
  }
  /// Length of the shortest 8-connected way from the vehicle through known-free cells at the travel
  /// radius and through cells that it flew through, corners not cut; kUnreachable if there is none.
  [[nodiscard]] double travel_distance(const Eigen::Vector2i& cell) const;

  /// The reachable cell nearest to p within the start reach; none if there is none.
  [[nodiscard]] std::optional<Eigen::Vector2i> nearest_reachable(const Vec2& p) const;

  /// Whether the vehicle reaches all that it flew through from where it is. If not, it stands in a
  /// pocket of the 2D map, and that nothing more can be reached says nothing.
  [[nodiscard]] bool reaches_flown() const;

  /// f_I: unknown area, m^2, of the cells inside the bounds whose centres lie within the
  /// information radius of p.
  [[nodiscard]] double unknown_area(const Vec2& p) const;

  /// What may be left to fly to: the unknown area, m^2, inside the bounds to which the vehicle's
  /// centre could come if all that is unknown were free. Counting ends at `enough_m2`.
  [[nodiscard]] double unknown_left(double enough_m2) const;

  /// Unknown area, m^2, inside the bounds that hangs together with p's cell by its cells' sides,
  /// whether a vehicle fits in there or not. Counting ends at `enough_m2`.
  [[nodiscard]] double unknown_pocket(const Vec2& p, double enough_m2) const;

  /// Area, m^2, of the cells inside the bounds that the vehicle can go to.
  [[nodiscard]] double reachable_area() const;

  /// Whether every cell on the line up to `target` is known-free; the target's own is not looked
  /// at.
  [[nodiscard]] bool sees(const Vec2& from, const Eigen::Vector2i& target) const;

 private:
  static constexpr std::uint8_t kFree = 1, kUnknown = 2, kInside = 4;
  static constexpr std::uint8_t kClear = 8;      ///< free, and as far from obstacles as it travels
  static constexpr std::uint8_t kPassable = 16;  ///< clear, flown through, or on the way to start()
  static constexpr std::uint32_t kFar = std::numeric_limits<std::uint32_t>::max();

  void classify();
  void measure_clearance();
  /// Whether a cell is as far from obstacles as the vehicle's centre travels.
  [[nodiscard]] bool is_clear(std::size_t cell) const;
  void find_start(const Vec2& robot);
  /// Nearest cell to p for which `accepts(cell)` holds, within the start reach and on p's side of
  /// any obstacle.
  template <class Accepts>
  [[nodiscard]] std::optional<Eigen::Vector2i> nearest_cell(const Vec2& p, Accepts&& accepts) const;
  void flood(const Vec2& robot);
  /// Unknown area of `open` and of what is `accept`ed beside it, and so on.
  template <class Accepts>
  [[nodiscard]] double flood_unknown(std::vector<Eigen::Vector2i> open, double enough_m2,
                                     Accepts&& accepts) const;

  const OccupancyMap2D& map_;
  ExplorationBounds bounds_;
  SpaceConfig config_;
  std::vector<std::uint8_t> flags_;
  std::vector<std::int32_t> clearance_;      ///< squared, in cells
  std::vector<std::uint32_t> travel_;        ///< in kStraight per cell
  std::vector<std::int32_t> unknown_count_;  ///< unknown cells left of x, rows of width + 1
  Vec2 start_ = Vec2::Zero();
  bool has_start_ = false;
};

}  // namespace arex
