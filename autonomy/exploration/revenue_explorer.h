#pragma once

#include "exploration/frontier_explorer.h"

namespace arex {

/// Direction-aware RRT exploration (paper, Algorithm 1): candidates from two rapidly-exploring
/// random trees, the one with the largest revenue wins. An exhaustive search has the last word
/// before nothing is left.
class RevenueExplorer : public FrontierExplorer {
 public:
  RevenueExplorer(const ExplorerConfig& config, double resolution_m, std::uint64_t seed);

  [[nodiscard]] const TargetHistory& history() const { return history_; }
  [[nodiscard]] const FrontierDetector& detector() const { return detector_; }

 protected:
  void observe(const ExplorationSpace& space) override { detector_.update(space); }
  void choose(Decision& decision, const ExplorationSpace& space,
              const ExplorerInput& input) override;
  void note_dropped(const Vec3& p_OB) override {
    if (config().legs_as_flown) history_.last = p_OB.head<2>();
  }

 private:
  /// Where candidates come from; each is asked only if those before it have none worth a flight.
  enum class Source : std::uint8_t {
    kTrees,       ///< the RRTs
    kExhaustive,  ///< the exhaustive frontier search
    kForgiving,   ///< the same, with all strikes forgiven but the last ones
  };
  [[nodiscard]] std::vector<Candidate> assess(Source source, const ExplorationSpace& space,
                                              const ExplorerInput& input) const;
  void select(Decision& decision);

  FrontierDetector detector_;
  TargetHistory history_;
};

}  // namespace arex
