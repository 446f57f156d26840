#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "math/types.h"
#include "scoring/reachable_space.h"

namespace arex::sim {

/// The shortest ways through the true reachable space.
///
/// A node is a run: reachable cells that lie above each other in one column. Runs of neighbouring
/// columns (eight of them; past a corner only where both columns beside are open, too) that share a
/// height are joined; the vehicle changes its height within a run as it likes. So a tree's column
/// has no node, a storey's one, and where storeys lie above each other there are several; a ramp
/// joins them. Lengths over the graph are horizontal, on a lattice, and up to 8 % longer than what
/// is flown: a way is then pulled tight in three dimensions.
/// Source: Triebel, Pfaff and Burgard, Multi-level surface maps, 2006 (the runs); Dial, Algorithm
/// 360, 1969 (the search with buckets).
class FlightWays {
 public:
  using Node = std::uint32_t;
  /// From one node to each, in units of unit_m(); kFar where there is no way.
  using Distances = std::vector<std::int32_t>;
  static constexpr std::int32_t kFar = std::numeric_limits<std::int32_t>::max();

  explicit FlightWays(ReachableSpace space);

  [[nodiscard]] std::size_t nodes() const { return runs_.size(); }
  /// The node nearest to a point, with a cell of its run at most `reach_m` away; nothing if none
  /// is.
  [[nodiscard]] std::optional<Node> nearest(const Vec3& p_W, double reach_m) const;
  /// Middle of a node's column, x and y in W.
  [[nodiscard]] Vec2 place_W(Node node) const;

  [[nodiscard]] Distances distances_from(Node start) const;
  [[nodiscard]] double unit_m() const { return space_.grid.resolution_m / kStraight; }

  /// The way from where `distances` count to a node, corners in W, tight. It begins at height z_m,
  /// brought into the first run, and changes its height only where it must.
  /// @pre distances[to] < kFar
  [[nodiscard]] std::vector<Vec3> way_W(const Distances& distances, Node to, double z_m) const;

 private:
  // Costs of a step; their ratio is sqrt(2) to 1 %.
  static constexpr std::int32_t kStraight = 5;
  static constexpr std::int32_t kDiagonal = 7;
  struct Run {
    int x, y;       ///< column
    int low, high;  ///< first and last reachable cell
  };
  struct Edge {
    Node to;
    std::int32_t cost;
  };

  void find_runs();
  void join_runs();
  [[nodiscard]] std::span<const Run> column(int x, int y) const;
  [[nodiscard]] bool opens_at(int x, int y, const Run& shared) const;
  [[nodiscard]] double height(int cell) const;
  [[nodiscard]] std::vector<Vec3> at_heights(const std::vector<Node>& nodes, double z_m) const;
  [[nodiscard]] bool is_free(const Vec3& from_W, const Vec3& to_W) const;
  [[nodiscard]] std::vector<Vec3> tightened(std::vector<Vec3> way_W) const;

  ReachableSpace space_;
  std::vector<Run> runs_;        ///< column by column, upwards
  std::vector<Node> first_run_;  ///< of each column, and one past the last
  std::vector<Edge> edges_;      ///< node by node
  std::vector<std::uint32_t> first_edge_;
};

/// Length of a polyline, m.
[[nodiscard]] double polyline_length(std::span<const Vec3> points);

/// Points of a polyline at equal steps of at most `step_m`, its corners included.
[[nodiscard]] std::vector<Vec3> with_points_between(std::span<const Vec3> corners, double step_m);

}  // namespace arex::sim
