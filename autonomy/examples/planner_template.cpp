// A plug-in with a local planner of one's own: straight on, or not at all. Copy it, rename it, and
// change plan(). In a scenario:
//
//     plugins: [build/autonomy/examples/libplanner_template.so]
//     planning: {strategy: straight}
//
// Stops and the way out of an inflated cell stay with the shipped planner.

#include <array>
#include <memory>

#include "planning/curve_check.h"
#include "planning/path_timing.h"
#include "stack/modules.h"
#include "stack/stack_config.h"

namespace {

using namespace arex;

class StraightPlanner : public LocalPlanner {
 public:
  explicit StraightPlanner(const LocalPlannerConfig& config) : config_(config) {}

  PlanResult plan(const GridView& grid, const PlanRequest& request) override {
    MotionLimits limits = config_.limits();
    if (request.max_speed_mps > 0) limits.max_speed_mps = request.max_speed_mps;
    PlanResult result;
    result.goal = request.goal;
    if (is_blocked(grid, request.start.p)) {
      result.status = PlanStatus::kStartInInflation;
      return result;
    }
    const std::array<Vec3, 2> way{request.start.p, request.goal};
    result.trajectory =
        time_path(resample(way, 0.1), request.start, limits, config_.timing_knot_span_s);
    result.status =
        first_collision(grid, result.trajectory) ? PlanStatus::kNoPath : PlanStatus::kOk;
    result.diagnostics.stage = PlanStage::kPathFollowing;
    if (!result.ok()) result.trajectory = {};
    return result;
  }

 private:
  LocalPlannerConfig config_;
};

}  // namespace

AREX_PLUGIN(modules) {
  modules.planners.add<NoParameters>(
      "straight", "straight to the goal, or not at all",
      [](const NoParameters&, const ModuleContext& context) {
        return std::make_unique<StraightPlanner>(context.config.planning.local);
      });
}
