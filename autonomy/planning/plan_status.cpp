#include "planning/plan_status.h"

namespace arex {

std::string_view to_string(PlanStatus status) {
  switch (status) {
    case PlanStatus::kOk:
      return "ok";
    case PlanStatus::kStartInInflation:
      return "start_in_inflation";
    case PlanStatus::kGoalInInflation:
      return "goal_in_inflation";
    case PlanStatus::kNoPath:
      return "no_path";
    case PlanStatus::kOptimiserFailed:
      return "optimiser_failed";
    case PlanStatus::kRefineRejected:
      return "refine_rejected";
  }
  return "unknown";
}

std::string_view to_string(PlanStage stage) {
  return kPlanStageNames[static_cast<std::size_t>(stage)];
}

}  // namespace arex
