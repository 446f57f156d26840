#pragma once

#include <optional>
#include <span>
#include <vector>

#include "planning/free_space.h"
#include "planning/grid_astar.h"
#include "planning/local_planner.h"
#include "planning/local_planner_config.h"
#include "planning/spline_cost.h"

namespace arex {

/// Local planner of the EGO-Planner family (paper, Local Motion Planner). A ladder of initial paths
/// (previous trajectory, polynomial, complete A* path, random polynomials) is bent out of obstacles
/// by anchors and L-BFGS ("rebound"), brought within the limits by time re-allocation and a
/// shape-keeping refinement, and accepted only if the whole curve is free (exactly, not at samples)
/// and speed and acceleration norms hold. If no rung gives that, the A* path itself is rounded and
/// flown as fast as its corners allow. All budgets are iterations; same input, same bits.
class BsplinePlanner : public LocalPlanner {
 public:
  explicit BsplinePlanner(const LocalPlannerConfig& config) : config_(config) {}

  /// Plans from a state to rest at the goal. Unknown cells count as free here; with
  /// stop_in_known_space the speed is such that the vehicle can stop before them. A start inside
  /// the inflation, but no nearer to an obstacle than the true radius, is left on the way.
  PlanResult plan(const GridView& grid, const PlanRequest& request) override;

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
