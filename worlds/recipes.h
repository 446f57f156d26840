#pragma once

#include <array>
#include <string_view>

#include "worlds/forest.h"
#include "worlds/gaps.h"
#include "worlds/garage.h"

namespace arex::worlds {

enum class WorldKind { kForest, kGarage, kGaps, kEmpty };
constexpr std::array<std::string_view, 4> enum_names(WorldKind) {
  return {"forest", "garage", "gaps", "empty"};
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

  void fields(auto& f) {
    f("kind", kind, "forest, garage, gaps or empty");
    f("forest", forest, "recipe of kind forest");
    f("garage", garage, "recipe of kind garage");
    f("gaps", gaps, "recipe of kind gaps");
    f("empty", empty, "recipe of kind empty");
  }
};

/// Builds the chosen world; a pure function of its arguments.
/// @throws ConfigError (without FILE:LINE) if a vehicle of this radius cannot reach most of the
/// free space from the start.
World build_world(const WorldConfig& config, std::uint64_t seed, double vehicle_radius_m);

/// Where there is ground to fly over, along x and y from the start, m: known without building.
Eigen::AlignedBox2d extent_of(const WorldConfig& config);

}  // namespace arex::worlds
