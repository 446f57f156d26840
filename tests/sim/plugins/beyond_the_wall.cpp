// Knows the name of a function of the simulator, and finds that it is not to be had.

#include <cstdint>

#include "stack/modules.h"

namespace arex::sim {
struct Scenario;
void set_seed(ConfigNode& source, std::uint64_t seed, const std::string& where);
}  // namespace arex::sim

AREX_PLUGIN(modules) {
  static_cast<void>(modules);
  arex::ConfigNode node;
  arex::sim::set_seed(node, 1, "here");
}
