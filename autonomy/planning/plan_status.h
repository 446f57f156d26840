#pragma once

#include <array>
#include <string_view>

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
inline constexpr std::array<std::string_view, 8> kPlanStageNames{
    "none",   "previous",       "polynomial",      "guided",
    "random", "path_following", "stop_and_follow", "escape"};
[[nodiscard]] std::string_view to_string(PlanStage stage);

}  // namespace arex
