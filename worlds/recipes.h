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
  double vehicle_radius_m = 0.31;
  ForestRecipe forest;
  GarageRecipe garage;
  GapsRecipe gaps;
  EmptyRecipe empty;

  void fields(auto& f) {
    f("kind", kind, "forest, garage, gaps or empty");
    f("vehicle_radius_m", vehicle_radius_m,
      "the start must be able to leave at this radius: motor arm 0.19 m plus a 9-inch propeller's "
      "radius");
    f("forest", forest, "recipe of kind forest");
    f("garage", garage, "recipe of kind garage");
    f("gaps", gaps, "recipe of kind gaps");
    f("empty", empty, "recipe of kind empty");
    f.check(vehicle_radius_m > 0 && vehicle_radius_m <= 2, "0 < vehicle_radius_m <= 2");
  }
};

/// Builds the chosen world; a pure function of its arguments.
/// @throws ConfigError (without FILE:LINE) if most of the free space cannot be reached from the
/// start.
World build_world(const WorldConfig& config, std::uint64_t seed);

}  // namespace arex::worlds
