#include "stack/modules.h"

AREX_PLUGIN(modules) {
  modules.planners.add<arex::NoParameters>(
      "bspline", "the name of the planner that ships",
      [](const arex::NoParameters&, const arex::ModuleContext&) { return nullptr; });
}
