#pragma once

#include <array>
#include <cstdint>

#include "mapping/grid_view.h"
#include "planning/plan_status.h"
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

/// How plans came about, in numbers.
struct PlanCounts {
  int plans = 0;
  int failures = 0;
  std::array<int, kPlanStageNames.size()> stages{};  ///< of the plans, by PlanStage
  int retimed = 0;                                   ///< timed anew to hold the limits
  int slowed = 0;                                    ///< for unknown space
  int emergency_stops = 0;                           ///< for what no plan could still avoid

  void add(const PlanResult& result) {
    ++(result.ok() ? plans : failures);
    if (!result.ok()) return;
    ++stages[static_cast<std::size_t>(result.diagnostics.stage)];
    retimed += result.diagnostics.retimed;
    slowed += result.diagnostics.slowed;
  }
};

/// Plans from a state to a goal within the local grid. Called from one job at a time, in
/// the order of time; same calls, same bits.
class LocalPlanner {
 public:
  virtual ~LocalPlanner() = default;

  /// A trajectory from the request's state to rest at its goal that touches nothing which the grid
  /// calls blocked, or why there is none.
  virtual PlanResult plan(const GridView& grid, const PlanRequest& request) = 0;
};

}  // namespace arex
