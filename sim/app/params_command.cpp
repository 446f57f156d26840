#include <algorithm>
#include <cstdio>

#include "app/commands.h"
#include "app/host.h"
#include "config/text.h"
#include "run/idle_faults.h"
#include "run/scenario.h"

namespace arex::app {
namespace {

sim::Scenario load(const ScenarioArguments& arguments) {
  return sim::load_scenario(resolve_input_file(arguments.file), arguments.overrides,
                            arguments.seed);
}

}  // namespace

int params(const ScenarioArguments& arguments) {
  const auto parameters = describe_parameters(load(arguments).config);
  std::size_t key_width = 0;
  for (const ParameterInfo& p : parameters) key_width = std::max(key_width, p.key.size());
  for (const ParameterInfo& p : parameters) {
    std::printf("%-*s  %-18s  %-8s  %s\n", static_cast<int>(key_width), p.key.c_str(),
                p.value.c_str(), p.unit.c_str(), p.meaning.c_str());
  }
  return 0;
}

int validate(const ScenarioArguments& arguments) {
  sim::Scenario scenario = load(arguments);
  if (scenario.config.world.kind == worlds::WorldKind::kFile) {
    scenario.file_world = scenario.read_file_world();
    std::fputs(worlds::describe(*scenario.file_world).c_str(), stdout);
  }
  const worlds::World world = scenario.build_world();
  std::printf("%s: valid; %zu objects, %zu triangles\n", arguments.file.c_str(),
              world.objects.size(), world.mesh.triangles.size());
  for (const std::string& line : sim::idle_faults(scenario.config)) {
    std::fprintf(stderr, "arex: %s\n", printable(line).c_str());
  }
  return 0;
}

}  // namespace arex::app
