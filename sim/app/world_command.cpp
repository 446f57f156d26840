#include <array>
#include <cmath>
#include <cstdio>
#include <string_view>

#include "app/commands.h"
#include "app/host.h"
#include "run/file_io.h"
#include "run/scenario.h"
#include "worlds/export.h"
#include "worlds/recipes.h"

namespace arex::app {
namespace {

constexpr double kMostCells = 5e8;  // of the ground-truth maps, 6 bytes each

/// A world recipe on its own: the keys of a scenario's `world` section at the top of the file.
struct RecipeConfig {
  std::uint64_t seed = 1;
  worlds::WorldConfig world;
  worlds::ExportConfig exported;

  void fields(auto& f) {
    f("seed", seed, "of the world");
    f("export", exported, "resolution and height band of the maps");
    world.fields(f);
  }
};

worlds::World build(const ConfigNode& root, const RecipeConfig& recipe) {
  try {
    return worlds::build_world(recipe.world, recipe.seed, sim::load_airframe().radius_m);
  } catch (const ConfigError& error) {
    throw ConfigError(given_last(root) + ": " + error.what());
  }
}

void check_size(const ConfigNode& root, const worlds::World& world, double resolution_m) {
  const double cells = (world.bounds.high - world.bounds.low).prod() / std::pow(resolution_m, 3);
  if (cells <= kMostCells) return;
  std::array<char, 120> text{};
  std::snprintf(text.data(), text.size(),
                "export.resolution_m makes %.1e cells of this world, expected at most %.0e", cells,
                kMostCells);
  config_detail::fail(config_detail::locate_rule(root, text.data()), text.data());
}

// What a run has there would be half replaced.
void expect_no_run(const std::filesystem::path& folder) {
  for (const char* name : {"resolved.yaml", "sweep.json"}) {
    if (!std::filesystem::exists(folder / name)) continue;
    throw ConfigError(folder.string() + ": holds " + name +
                      ", so that it is a run's or a sweep's; expected a folder of its own");
  }
}

}  // namespace

int world(const WorldArguments& arguments) {
  ConfigNode root = load_yaml(or_shipped(arguments.file));
  for (const std::string& assignment : arguments.overrides) apply_override(root, assignment);
  RecipeConfig recipe;
  if (root.find("world")) {
    const sim::Scenario scenario =
        sim::load_scenario(or_shipped(arguments.file), arguments.overrides, arguments.seed);
    recipe.world = scenario.config.world;
    recipe.seed = scenario.config.seed;
  } else {
    if (arguments.seed) sim::set_seed(root, *arguments.seed, "--seed");
    read_config(root, recipe);
  }
  const sim::OutputFolder folder(arguments.out);
  expect_no_run(folder.path());
  for (const std::string_view file : worlds::kExportedFiles) check_writable(folder.path() / file);
  const worlds::World built = build(root, recipe);
  check_size(root, built, recipe.exported.resolution_m);
  worlds::export_world(built, recipe.exported, arguments.out);
  std::printf("%s: %zu objects, %zu triangles, %zu collision shapes\n", arguments.out.c_str(),
              built.objects.size(), built.mesh.triangles.size(), built.collision_shapes.size());
  return 0;
}

}  // namespace arex::app
