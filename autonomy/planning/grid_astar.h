#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mapping/grid_view.h"

namespace arex {

enum class AstarStatus {
  kFound,
  kExhausted,  ///< everything reachable was expanded: there is no path inside the window
  kBudget,     ///< the expansion budget ran out first
};

struct AstarResult {
  AstarStatus status = AstarStatus::kExhausted;
  std::vector<Vec3> path;  ///< cell centres from start to goal, both included
  int cost = 0;            ///< 10, 14, 17 per straight, planar and spatial diagonal step
  int expansions = 0;
};

struct AstarOptions {
  int max_expansions = 200'000;
  /// Cells around the box of start and goal that may be searched, level and in height; negative:
  /// the whole grid.
  int window_margin_cells = -1;
  int window_height_cells = -1;
  /// False: a diagonal step needs all cells that it passes between to be free, so that the straight
  /// line between the centres stays in free cells and every path keeps half a cell of clearance.
  bool cut_corners = false;
  /// True: the heuristic weighs a quarter more. Far fewer expansions, paths at most a quarter
  /// dearer.
  bool greedy = false;
};

/// A* over the free cells of a grid: 26-connected, octile heuristic (consistent, so the path is
/// optimal in its cost), ties broken towards the newest node: same input, same path. Blocked are
/// inflated and occupied cells; unknown ones are passable. The arrays are kept between searches and
/// stamped with a generation instead of being cleared.
class GridAstar {
 public:
  [[nodiscard]] AstarResult search(const GridView& grid, const Eigen::Vector3i& start,
                                   const Eigen::Vector3i& goal, const AstarOptions& options = {});

 private:
  struct Node {
    std::uint32_t generation = 0;
    int cost = 0;           ///< from the start
    std::uint8_t step = 0;  ///< index of the step that led here; kNoStep at the start
    bool closed = false;
  };
  struct Window {
    Eigen::Vector3i low, size;
  };

  void prepare(const Window& window);
  void push(std::uint32_t node, int f);
  [[nodiscard]] bool pop(std::uint32_t& node);
  void expand(const GridView& grid, const Window& window, std::uint32_t node,
              const Eigen::Vector3i& goal, const AstarOptions& options);
  [[nodiscard]] std::vector<Vec3> trace(const GridView& grid, const Window& window,
                                        std::uint32_t node) const;

  std::vector<Node> nodes_;
  std::uint32_t generation_ = 0;
  /// Open list: one stack per f - f_start. With integer costs that is a whole priority queue.
  std::vector<std::vector<std::uint32_t>> open_;
  std::size_t lowest_ = 0, highest_ = 0;
  int f_start_ = 0;
};

/// Shortens a path of cell centres: each kept vertex sees the next one along a straight line that
/// keeps `margin_m` from blocked cells. First and last point stay.
[[nodiscard]] std::vector<Vec3> shortcut(const GridView& grid, std::span<const Vec3> path,
                                         double margin_m);

}  // namespace arex
