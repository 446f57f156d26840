#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <string_view>

#include "app/commands.h"
#include "app/host.h"
#include "pictures/picture.h"
#include "run/file_io.h"
#include "run/scenario.h"
#include "worlds/export.h"
#include "worlds/file_ground.h"
#include "worlds/recipes.h"

namespace arex::app {
namespace {

constexpr std::string_view kOverview = "world.png";  // of a world from a file
constexpr double kMostCells = 5e8;                   // of the ground-truth maps, 6 bytes each

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

bool is_yaml(const std::filesystem::path& file) {
  return file.extension() == ".yaml" || file.extension() == ".yml";
}

/// What somebody would write who had only this file to say.
ConfigNode recipe_of(const std::string& file) {
  ConfigNode root = parse_yaml("kind: file", file);
  ConfigNode path;
  path.kind = ConfigNode::Kind::kScalar;
  path.where = "--";  // of the command line, to which it is relative
  path.scalar = file;
  set_value(root, "file.path", path.where, path);
  return root;
}

/// The world, and of a file's what was understood of it. @param direct the file itself was given
worlds::FileWorld build(const ConfigNode& root, const RecipeConfig& recipe, bool direct) {
  const double radius_m = sim::load_airframe().radius_m;
  try {
    if (recipe.world.kind == worlds::WorldKind::kFile) {
      return worlds::load_file_world(recipe.world.file, radius_m);
    }
    worlds::FileWorld built;
    built.world = worlds::build_world(recipe.world, recipe.seed, radius_m);
    return built;
  } catch (const ConfigError& error) {
    if (direct) throw;
    throw ConfigError(last_given(root) + ": " + error.what());
  }
}

/// The whole world from above, a little from the south, and what is above the start's storey cut
/// away, however it slopes; a mast marks the start.
void draw_overview(const worlds::World& world, const std::filesystem::path& file) {
  constexpr double kStorey = 2.2;       // m above its ground
  constexpr double kMast = 1.0 / 60.0;  // of the world's extent
  const sim::PictureOptions standard;
  const Vec3 size = world.bounds.high - world.bounds.low;
  const double aspect = static_cast<double>(standard.width) / standard.height;
  const double seen = 1.05 * std::max(size.x(), 1.2 * size.y() * aspect);
  const double height = seen / 2 / std::tan(standard.field_of_view_rad / 2);
  Vec3 middle = 0.5 * (world.bounds.low + world.bounds.high);
  middle.z() = world.X_WS.p.z();
  sim::PictureOptions options;
  options.visibility_m = 20 * height;
  options.light = sim::PictureOptions::Light::kSun;
  sim::PictureOverlay overlay;
  const double mast = kMast * std::max(size.x(), size.y());
  const Vec3 p = world.X_WS.p;
  overlay.paths.push_back({{p, p + Vec3(0, 0, 3 * mast)}, {0.9, 0.02, 0.12}, mast / 6});
  overlay.paths.push_back(
      {{p + 0.3 * mast * Vec3::UnitZ(), p + world.X_WS.R * Vec3(3 * mast, 0, 0.3 * mast)},
       {0.95, 0.25, 0.1},
       mast / 8});
  const Pose X_WC = sim::look_at(middle + Vec3(0, -0.35 * height, height), middle);
  const worlds::World shown = worlds::cut_above(world, worlds::storey_of(world), kStorey);
  sim::save_png(sim::render_picture(shown, X_WC, options, overlay), file);
}

void check_size(const ConfigNode& root, const worlds::World& world, double resolution_m) {
  const double cells = (world.bounds.high - world.bounds.low).prod() / std::pow(resolution_m, 3);
  if (cells <= kMostCells) return;
  const std::string rule =
      fmt::format("export.resolution_m makes {:.1e} cells of this world, expected at most {:.0e}",
                  cells, kMostCells);
  config_detail::fail(config_detail::locate_rule(root, rule), rule);
}

/// Nobody asked for a resolution: one that a large world can be written in.
void coarsen(const worlds::World& world, worlds::ExportConfig& exported) {
  constexpr double kFew = 1e8;
  const double volume = (world.bounds.high - world.bounds.low).prod();
  const double least = std::cbrt(volume / kFew);
  if (least > exported.resolution_m) exported.resolution_m = std::ceil(20 * least) / 20;
}

// What a run has there would be half replaced.
void expect_world_folder(const std::filesystem::path& folder) {
  for (const char* name : {"resolved.yaml", "sweep.json"}) {
    if (!std::filesystem::exists(folder / name)) continue;
    throw ConfigError(folder.string() + ": holds " + name +
                      ", so that it is a run's or a sweep's; expected a folder of its own");
  }
}

}  // namespace

int world(const WorldArguments& arguments) {
  const bool direct = !is_yaml(arguments.file);
  ConfigNode root =
      direct ? recipe_of(arguments.file) : load_yaml(resolve_input_file(arguments.file));
  for (const std::string& assignment : arguments.overrides) apply_override(root, assignment);
  RecipeConfig recipe;
  if (root.find("world")) {
    const sim::Scenario scenario =
        sim::load_scenario(resolve_input_file(arguments.file), arguments.overrides, arguments.seed);
    recipe.world = scenario.config.world;
    recipe.seed = scenario.config.seed;
  } else {
    if (arguments.seed) sim::set_seed(root, *arguments.seed, "--seed");
    read_config(root, recipe);
    sim::resolve_paths(root, recipe.world);
  }
  const bool from_file = recipe.world.kind == worlds::WorldKind::kFile;
  const sim::OutputFolder folder(arguments.out);
  expect_world_folder(folder.path());
  for (const std::string_view file : worlds::kExportedFiles) check_writable(folder.path() / file);
  if (from_file) check_writable(folder.path() / kOverview);
  const worlds::FileWorld built = build(root, recipe, direct);
  if (direct && !root.find("export")) coarsen(built.world, recipe.exported);
  check_size(root, built.world, recipe.exported.resolution_m);
  worlds::export_world(built.world, recipe.exported, arguments.out);
  if (from_file) {
    draw_overview(built.world, folder.path() / kOverview);
    std::fputs(worlds::describe(built).c_str(), stdout);
  }
  std::printf("%s: %zu objects, %zu triangles, %zu collision shapes\n", arguments.out.c_str(),
              built.world.objects.size(), built.world.mesh.triangles.size(),
              built.world.collision_shapes.size());
  return 0;
}

}  // namespace arex::app
