#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "mapping/grid_view.h"
#include "planning/free_space.h"
#include "planning/grid_astar.h"
#include "planning/local_planner_config.h"
#include "planning/spline_cost.h"
#include "planning/uniform_bspline.h"

namespace arex {

enum class PlanStatus {
  kOk,
  kStartInInflation,  ///< plan_escape() leads out
  kGoalInInflation,   ///< and no free place near it
  kNoPath,            ///< A* found none within its budget
  kOptimiserFailed,   ///< there is a path, but no spline of the ladder is free
  kRefineRejected,    ///< free splines were found, but none within the limits
};
[[nodiscard]] std::string_view to_string(PlanStatus status);

/// Which rung of the ladder gave the trajectory.
enum class PlanStage {
  kNone,
  kPrevious,       ///< rebound from the rest of the previous trajectory
  kPolynomial,     ///< rebound from the minimum-jerk polynomial
  kGuided,         ///< rebound from the complete A* path
  kRandom,         ///< rebound from a seeded random polynomial
  kPathFollowing,  ///< no optimiser: the rounded A* path, timed
  kStopAndFollow,  ///< brake to rest first, then the same
  kEscape,
};
[[nodiscard]] std::string_view to_string(PlanStage stage);

struct PlanRequest {
  MotionState start;         ///< kept exactly
  Vec3 goal = Vec3::Zero();  ///< reached at rest
  const UniformBspline* previous = nullptr;
  double previous_time_s = 0;  ///< where on `previous` the start is
  std::uint64_t seed = 0;      ///< of the random polynomials
  double max_speed_mps = 0;    ///< below the configured one, if positive
};

struct PlanDiagnostics {
  PlanStage stage = PlanStage::kNone;
  int attempts = 0;  ///< initial paths tried
  int rebounds = 0;  ///< minimisations of the rebound stage
  int iterations = 0;
  int evaluations = 0;
  int astar_searches = 0;
  int astar_expansions = 0;
  int anchors_dropped = 0;
  bool reallocated = false;  ///< time was re-allocated and the shape refined
  bool retimed = false;      ///< the path was timed anew
  bool slowed = false;       ///< for unknown space
  bool braked = false;       ///< too fast for the unknown ahead: it only comes to rest
  bool goal_shifted = false;
  bool start_inflated = false;  ///< the inflation was shrunk about the start
};

struct [[nodiscard]] PlanResult {
  PlanStatus status = PlanStatus::kOptimiserFailed;
  UniformBspline trajectory;  ///< empty unless kOk
  Vec3 goal = Vec3::Zero();   ///< the goal planned to
  PlanDiagnostics diagnostics;

  [[nodiscard]] bool ok() const { return status == PlanStatus::kOk; }
};

/// Local planner of the EGO-Planner family (paper, Local Motion Planner). A ladder of initial paths
/// (previous trajectory, polynomial, complete A* path, random polynomials) is bent out of obstacles
/// by anchors and L-BFGS ("rebound"), brought within the limits by time re-allocation and a
/// shape-keeping refinement, and accepted only if the whole curve is free (exactly, not at samples)
/// and speed and acceleration norms hold. If no rung gives that, the A* path itself is rounded and
/// flown as fast as its corners allow. All budgets are iterations; same input, same bits.
class LocalPlanner {
 public:
  explicit LocalPlanner(const LocalPlannerConfig& config) : config_(config) {}

  /// Plans from a state to rest at the goal. Unknown cells count as free here; with
  /// stop_in_known_space the speed is such that the vehicle can stop before them. A start inside
  /// the inflation, but no nearer to an obstacle than the true radius, is left on the way.
  PlanResult plan(const GridView& grid, const PlanRequest& request);

  /// From inside the inflation: out of it, with the inflation shrunk to the true radius, slowly,
  /// along the gradient of clearance.
  PlanResult plan_escape(const GridView& grid, const MotionState& start);

  [[nodiscard]] const LocalPlannerConfig& config() const { return config_; }

 private:
  PlanResult plan_from_free(const GridView& grid, const PlanRequest& request);
  [[nodiscard]] std::vector<Vec3> polynomial_path(const PlanRequest& request) const;
  [[nodiscard]] std::vector<Vec3> previous_path(const PlanRequest& request) const;
  [[nodiscard]] std::vector<Vec3> random_path(const PlanRequest& request, int index) const;
  [[nodiscard]] std::optional<UniformBspline> rebound(const GridView& grid,
                                                      const PlanRequest& request,
                                                      const std::vector<Vec3>& path, double dt,
                                                      double safe_distance_m,
                                                      PlanDiagnostics& diagnostics);
  void optimise(std::vector<Vec3>& q, double dt, const Anchors& anchors,
                const FitnessReference* reference, double collision_scale, double safe_distance_m,
                const LbfgsConfig& budget, PlanDiagnostics& diagnostics);
  [[nodiscard]] std::optional<UniformBspline> refine(const GridView& grid,
                                                     const UniformBspline& spline,
                                                     const PlanRequest& request,
                                                     PlanDiagnostics& diagnostics);
  [[nodiscard]] std::optional<UniformBspline> bring_within_limits(const GridView& grid,
                                                                  const UniformBspline& spline,
                                                                  const PlanRequest& request,
                                                                  PlanDiagnostics& diagnostics);
  [[nodiscard]] std::optional<UniformBspline> time_within_limits(const GridView& grid,
                                                                 const std::vector<Vec3>& path,
                                                                 const MotionState& start,
                                                                 const MotionLimits& limits,
                                                                 const SpeedCap& cap = {}) const;
  [[nodiscard]] AstarResult guide(const GridView& grid, const Vec3& from, const Vec3& goal,
                                  PlanDiagnostics& diagnostics);
  [[nodiscard]] static std::vector<Vec3> join_path(const MotionState& start,
                                                   std::span<const Vec3> path, double reach_m);
  [[nodiscard]] std::optional<UniformBspline> follow_path(const GridView& grid,
                                                          const std::vector<Vec3>& path,
                                                          const MotionState& start,
                                                          const MotionLimits& limits) const;
  [[nodiscard]] std::optional<UniformBspline> join_and_follow(const GridView& grid,
                                                              const std::vector<Vec3>& path,
                                                              const MotionState& start,
                                                              const MotionLimits& limits) const;
  [[nodiscard]] std::optional<UniformBspline> stop_and_follow(const GridView& grid,
                                                              const PlanRequest& request,
                                                              PlanDiagnostics& diagnostics);
  void climb_ladder(const GridView& grid, const PlanRequest& request, PlanResult& result);
  void slow_before_unknown(const GridView& grid, const PlanRequest& request, PlanResult& result);

  [[nodiscard]] MotionLimits limits(const PlanRequest& request) const;
  [[nodiscard]] bool within_limits(const UniformBspline& spline, const MotionState& start,
                                   const MotionLimits& limits) const;

  LocalPlannerConfig config_;
  GridAstar astar_;
  ShrunkInflation shrunk_;
};

}  // namespace arex
