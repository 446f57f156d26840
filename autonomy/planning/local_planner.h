#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "mapping/grid_view.h"
#include "planning/free_space.h"
#include "planning/grid_astar.h"
#include "planning/local_planner_config.h"
#include "planning/plan_status.h"
#include "planning/spline_cost.h"
#include "planning/uniform_bspline.h"

namespace arex {

struct PlanRequest {
  MotionState start;         ///< kept exactly
  Vec3 goal = Vec3::Zero();  ///< reached at rest
  const UniformBspline* previous = nullptr;
  double previous_time_s = 0;  ///< where on `previous` the start is
  std::uint64_t seed = 0;      ///< of the random polynomials
  /// If nothing else leads away from a start that moves or is inside the inflation: through the
  /// inflation near it, but no nearer to an obstacle than the true radius.
  bool may_graze = false;
  double max_speed_mps = 0;  ///< if positive: the path is flown no faster
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
  bool start_inflated = false;  ///< the inflation was shrunk about the start: not wholly free
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

  /// To rest without touching anything, if possible near `towards`: straight on or swerving once
  /// (find_stop); if that is too late, sooner and with the whole tolerance of the limits.
  [[nodiscard]] std::optional<UniformBspline> plan_stop(const GridView& grid,
                                                        const MotionState& state,
                                                        const MotionLimits& limits,
                                                        const Vec3& towards) const;

  [[nodiscard]] const LocalPlannerConfig& config() const { return config_; }

 private:
  PlanResult plan_through_inflation(const GridView& grid, const PlanRequest& request,
                                    double yield_m);
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
  [[nodiscard]] std::optional<UniformBspline> time_within_limits(
      const GridView& grid, const std::vector<Vec3>& path, const MotionState& start,
      const MotionLimits& limits, double knot_span_s, const SpeedCap& cap = {}) const;
  [[nodiscard]] AstarResult guide(const GridView& grid, const Vec3& from, const Vec3& goal,
                                  PlanDiagnostics& diagnostics);
  [[nodiscard]] static std::vector<Vec3> join_path(const MotionState& start,
                                                   std::span<const Vec3> path, double reach_m);
  [[nodiscard]] std::optional<UniformBspline> follow_path(const GridView& grid,
                                                          const std::vector<Vec3>& path,
                                                          const MotionState& start,
                                                          const MotionLimits& limits,
                                                          double knot_span_s) const;
  [[nodiscard]] std::optional<UniformBspline> join_and_follow(const GridView& grid,
                                                              const std::vector<Vec3>& path,
                                                              const MotionState& start,
                                                              const MotionLimits& limits) const;
  [[nodiscard]] std::optional<UniformBspline> stop_and_follow(const GridView& grid,
                                                              const PlanRequest& request,
                                                              PlanDiagnostics& diagnostics);
  void climb_ladder(const GridView& grid, const PlanRequest& request, PlanResult& result);
  void slow_down(const GridView& grid, const PlanRequest& request, PlanResult& result);

  [[nodiscard]] bool within_limits(const UniformBspline& spline, const MotionState& start,
                                   const MotionLimits& limits) const;

  LocalPlannerConfig config_;
  GridAstar astar_;
  ShrunkInflation shrunk_;
};

}  // namespace arex
