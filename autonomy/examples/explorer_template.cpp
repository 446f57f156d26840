// A plug-in with an explorer of one's own: the largest frontier is next. Copy it, rename it, and
// change choose(). In a scenario:
//
//     plugins: [build/autonomy/examples/libexplorer_template.so]
//     exploration: {strategy: largest}
//     modules: {largest: {least_gain_m2: 1.0}}

#include <algorithm>
#include <memory>
#include <vector>

#include "exploration/frontier_explorer.h"
#include "stack/modules.h"
#include "stack/stack_config.h"

namespace {

using namespace arex;

struct LargestConfig {
  double least_gain_m2 = 0.5;

  void fields(auto& f) {
    f("least_gain_m2", least_gain_m2, "unknown area below which a frontier is left alone");
    f.check(least_gain_m2 >= 0, "least_gain_m2 >= 0");
  }
};

// FrontierExplorer minds the battery, the targets under way and the stop; it only has to be told
// which frontier is next. Whoever wants to decide all of that derives from Explorer.
class LargestFrontierExplorer : public FrontierExplorer {
 public:
  LargestFrontierExplorer(const LargestConfig& config, const StackConfig& stack)
      : FrontierExplorer(stack.exploration.explorer, stack.mapping.resolution_m), config_(config) {}

 protected:
  void choose(Decision& decision, const ExplorationSpace& space,
              const ExplorerInput& input) override {
    std::vector<FrontierPoint> points;
    for (const Frontier& frontier : find_frontiers(space))
      points.push_back(frontier.points.front());
    decision.source = "largest";
    decision.candidates = candidates_at(points, space, input.now, false);
    filter(decision.candidates, space);
    for (Candidate& candidate : decision.candidates) {
      candidate.revenue = candidate.information_m2;
    }
    const auto best = best_candidate(decision.candidates);
    if (best && decision.candidates[*best].information_m2 >= config_.least_gain_m2) {
      decision.winner = best;
    }
  }

 private:
  LargestConfig config_;
};

}  // namespace

AREX_PLUGIN(modules) {
  modules.explorers.add<LargestConfig>(
      "largest", "the frontier with the most unknown area around it",
      [](const LargestConfig& config, const ModuleContext& context) {
        return std::make_unique<LargestFrontierExplorer>(config, context.config);
      });
}
