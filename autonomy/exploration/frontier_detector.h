#pragma once

#include <cstdint>
#include <vector>

#include "exploration/exploration_space.h"
#include "exploration/frontier_search.h"
#include "math/random.h"

namespace arex {

struct FrontierDetectorConfig {
  double local_step_m = 1.0;    ///< eta (rrt_exploration)
  double global_step_m = 15.0;  ///< eta (rrt_exploration)
  int local_iterations = 1000;
  int global_iterations = 2000;
  double vertex_spacing_m = 0.5;
  double cluster_bandwidth_m = 0.3;  ///< rrt_exploration

  void fields(auto& f) {
    f("local_step_m", local_step_m, "step of the local tree (rrt_exploration)");
    f("global_step_m", global_step_m, "step of the global tree (rrt_exploration)");
    f("local_iterations", local_iterations, "samples of the local tree per decision");
    f("global_iterations", global_iterations, "samples of the global tree per decision");
    f("vertex_spacing_m", vertex_spacing_m,
      "a vertex nearer than this to its tree adds nothing and is left out");
    f("cluster_bandwidth_m", cluster_bandwidth_m, "of the mean shift (rrt_exploration)");
    f.check(local_step_m >= 0.02 && local_step_m <= 100, "0.02 <= local_step_m <= 100");
    f.check(global_step_m >= 0.02 && global_step_m <= 100, "0.02 <= global_step_m <= 100");
    f.check(local_iterations >= 0 && local_iterations <= 1000000,
            "0 <= local_iterations <= 1000000");
    f.check(global_iterations >= 0 && global_iterations <= 1000000,
            "0 <= global_iterations <= 1000000");
    f.check(vertex_spacing_m >= 0.02 && vertex_spacing_m <= 100, "0.02 <= vertex_spacing_m <= 100");
    f.check(cluster_bandwidth_m >= 0.02 && cluster_bandwidth_m <= 100,
            "0.02 <= cluster_bandwidth_m <= 100");
  }
};

/// What a growth line runs into.
struct Growth {
  enum class End {
    kFree,      ///< nothing: it ends in known-free space
    kBlocked,   ///< an occupied cell, the bounds or the map's edge
    kFrontier,  ///< an unknown cell inside the bounds, after free cells only
  };
  End end = End::kFree;
  Eigen::Vector2i cell = Eigen::Vector2i::Zero();  ///< where it ended
};

/// Walks the growth line cell by cell to the first that is not known to be free.
[[nodiscard]] Growth grow_line(const ExplorationSpace& space, const Vec2& from, const Vec2& to);

/// The vertices of a tree, with the nearest one found through a grid of buckets. Only the vertices
/// matter to the detector: its edges lead nowhere that anybody flies.
class VertexSet {
 public:
  explicit VertexSet(double bucket_m) : bucket_m_(bucket_m) {}

  /// Empties it; `low` and `high` bound the vertices to come.
  void reset(const Vec2& low, const Vec2& high);
  void add(const Vec2& p);
  /// @pre not empty. Of equally near vertices the oldest.
  [[nodiscard]] const Vec2& nearest(const Vec2& p) const;
  [[nodiscard]] const std::vector<Vec2>& points() const { return points_; }

 private:
  [[nodiscard]] Eigen::Vector2i bucket_of(const Vec2& p) const;

  double bucket_m_;
  Vec2 low_ = Vec2::Zero();
  Eigen::Vector2i size_ = Eigen::Vector2i::Zero();
  std::vector<Vec2> points_;
  std::vector<std::vector<std::uint32_t>> buckets_;
};

/// The paper's Frontier Detector: a local and a global RRT grow in known-free space that the
/// vehicle can reach; where a growth line meets an unknown cell, that cell is a boundary point. The
/// local tree starts again at the vehicle after each; the global one is kept for the whole mission.
/// Points are clustered by mean shift, the member nearest to its mode standing for the cluster (the
/// mode itself may lie in known space), and are kept from call to call while they are frontiers.
/// Source: Umari and Mukhopadhyay, Autonomous robotic exploration based on multiple
/// rapidly-exploring randomized trees, IROS 2017; AREX paper, II-D.
class FrontierDetector {
 public:
  FrontierDetector(const FrontierDetectorConfig& config, std::uint64_t seed);

  /// Grows both trees by their budgets; returns all boundary points known now.
  const std::vector<FrontierPoint>& update(const ExplorationSpace& space);

  [[nodiscard]] const std::vector<FrontierPoint>& points() const { return points_; }

 private:
  void grow_local(const ExplorationSpace& space);
  void grow_global(const ExplorationSpace& space);
  /// One sample: adds a vertex or a boundary point. True if it found one.
  bool grow_once(const ExplorationSpace& space, double step_m, RandomStream& random,
                 VertexSet& tree);
  void drop_known(const ExplorationSpace& space);
  void cluster(const ExplorationSpace& space);

  FrontierDetectorConfig config_;
  RandomStream local_random_, global_random_;
  VertexSet local_, global_;
  Eigen::AlignedBox2d area_;  ///< that samples are drawn from
  std::vector<FrontierPoint> points_;
};

}  // namespace arex
