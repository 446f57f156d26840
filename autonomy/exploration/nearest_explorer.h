#pragma once

#include "exploration/frontier_explorer.h"

namespace arex {

/// The nearest frontier, along the known-free path, is next: what explorers are compared with.
/// Source: Yamauchi, A frontier-based approach for autonomous exploration, CIRA 1997.
class NearestExplorer : public FrontierExplorer {
 public:
  using FrontierExplorer::FrontierExplorer;

 protected:
  void choose(Decision& decision, const ExplorationSpace& space,
              const ExplorerInput& input) override;
};

}  // namespace arex
