#pragma once

#include <array>
#include <optional>
#include <string_view>

#include "worlds/file_world.h"
#include "worlds/forest.h"
#include "worlds/gaps.h"
#include "worlds/garage.h"
#include "worlds/orchard.h"

namespace arex::worlds {

enum class WorldKind { kForest, kGarage, kGaps, kEmpty, kOrchard, kPine, kFile };
constexpr std::array<std::string_view, 7> enum_names(WorldKind) {
  return {"forest", "garage", "gaps", "empty", "orchard", "pine", "file"};
}

/// The `world` section of a scenario: which recipe, and the recipes' parameters. Only the chosen
/// one is used.
struct WorldConfig {
  using Kind = WorldKind;
  Kind kind = Kind::kForest;
  ForestRecipe forest;
  GarageRecipe garage;
  GapsRecipe gaps;
  EmptyRecipe empty;
  OrchardRecipe orchard;
  ForestRecipe pine = pine_stand();
  FileRecipe file;

  void fields(auto& f) {
    f("kind", kind, "forest, garage, gaps, empty, orchard, pine or file");
    f("forest", forest, "recipe of kind forest");
    f("garage", garage, "recipe of kind garage");
    f("gaps", gaps, "recipe of kind gaps");
    f("empty", empty, "recipe of kind empty");
    f("orchard", orchard, "recipe of kind orchard");
    f("pine", pine, "recipe of kind pine: the forest's, with the figures of a pine stand");
    f("file", file, "what somebody else has made, for kind file");
    f.check(kind != Kind::kFile || !file.path.empty(),
            "file.path, a mesh, Gazebo world, octree or cloud");
  }
};

/// Hands the chosen recipe to `use`: a further one is added here, and in WorldConfig. A recipe has
/// build(recipe, seed[, flown]), extent() and, if a vehicle cannot get everywhere in it,
/// limit_reach().
/// @pre not of kind file
template <class Use>
auto with_recipe(const WorldConfig& config, const Use& use) {
  switch (config.kind) {
    case WorldKind::kGarage:
      return use(config.garage);
    case WorldKind::kGaps:
      return use(config.gaps);
    case WorldKind::kEmpty:
      return use(config.empty);
    case WorldKind::kOrchard:
      return use(config.orchard);
    case WorldKind::kPine:
      return use(config.pine);
    default:
      return use(config.forest);
  }
}

/// Builds the chosen world; a pure function of its arguments, and of the file for kind file.
/// @throws ConfigError (without FILE:LINE) if a vehicle of this radius cannot reach most of the
/// free space from the start; of a file's world, hardly anything.
/// @param flown where the mission leads, along x and y from the start, m: what lies far from it may
/// be coarser. Without it nothing is.
World build_world(const WorldConfig& config, std::uint64_t seed, double vehicle_radius_m,
                  const std::optional<Eigen::AlignedBox2d>& flown = {});

/// Where there is ground to fly over, along x and y from the start, m: known without building.
/// Nothing for a file, which has to be read.
std::optional<Eigen::AlignedBox2d> extent_of(const WorldConfig& config);

/// The same of a file's world: as far as a vehicle gets from its start.
Eigen::AlignedBox2d extent_of(const FileWorld& loaded);

}  // namespace arex::worlds
