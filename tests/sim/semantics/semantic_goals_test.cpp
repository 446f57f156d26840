// The goals of the semantic map, on the clouds that missions would leave (support/mapped_cloud.h):
// the LiDAR's noise, the odometry's errors, the global cloud's voxels. Seeds that nothing was tuned
// on.
#include <gtest/gtest.h>

#include "scoring/semantic_score.h"
#include "semantics/semantic_map.h"
#include "support/mapped_cloud.h"
#include "worlds/recipes.h"

namespace arex::sim {
namespace {

struct Tally {
  std::size_t found = 0, right = 0, mapped = 0;
  void add(const ClassScore& score) {
    found += score.found;
    right += score.right;
    mapped += score.mapped;
  }
  [[nodiscard]] double f1() const {
    return 2.0 * static_cast<double>(right) / static_cast<double>(found + mapped);
  }
};

SemanticScore score_of(const worlds::WorldConfig& config,
                       const support::MappedCloudOptions& options, std::uint64_t seed,
                       SceneKind expected) {
  const worlds::World world = worlds::build_world(config, seed, 0.305);
  const support::MappedCloud cloud = support::map_world(world, options, seed);
  std::vector<Vec3f> path;
  for (const Vec3& p : cloud.path_O) path.push_back(p.cast<float>());
  const SemanticMap map = build_semantic_map(cloud.points_O, path, {});
  EXPECT_EQ(map.scene, expected);
  return score_semantics(map, cloud.points_O, cloud.X_WO, world);
}

void expect_stems(const worlds::ForestRecipe& forest, std::uint64_t first, std::uint64_t last) {
  worlds::WorldConfig config;
  config.kind = worlds::WorldKind::kForest;
  config.forest = forest;
  for (std::uint64_t seed = first; seed <= last; ++seed) {
    const SemanticScore score = score_of(config, {}, seed, SceneKind::kForest);
    const ClassScore& trunk = score.of(SemanticClass::kTrunk);
    EXPECT_GE(trunk.f1, 0.95) << seed << ": precision " << trunk.precision << ", recall "
                              << trunk.recall;
    EXPECT_LE(trunk.position_median_m, 0.05) << seed;
    EXPECT_LE(trunk.size_median_m, 0.02) << seed;
    EXPECT_GE(trunk.mapped, 30u) << seed;
  }
}

worlds::ForestRecipe small_forest() {
  worlds::ForestRecipe forest;
  forest.size_m = {34, 30};
  return forest;
}

TEST(SemanticGoals, StemsOfTheForest) { expect_stems(small_forest(), 101, 103); }

TEST(SemanticGoals, StemsOfADenseAndTallStand) {
  worlds::ForestRecipe pine = small_forest();
  pine.tree_density_per_m2 = 0.18;
  pine.min_spacing_m = 1.2;
  pine.tree.height_m = 19;
  pine.tree.crown_base_fraction = 0.6;
  pine.tree.crown_radius_m = 1.6;
  pine.tree.bend_m = 0.06;
  expect_stems(pine, 111, 112);
}

TEST(SemanticGoals, StemsOfLowTreesWithLowCrowns) {
  worlds::ForestRecipe orchard = small_forest();
  orchard.tree_density_per_m2 = 0.06;
  orchard.min_spacing_m = 3;
  orchard.tree.height_m = 4;
  orchard.tree.height_spread_m = 0.3;
  orchard.tree.crown_base_fraction = 0.3;
  orchard.tree.crown_radius_m = 1.5;
  orchard.tree.trunk_radius_m = 0.08;
  orchard.tree.trunk_radius_spread_m = 0.015;
  orchard.tree.low_branches = 0;
  orchard.undergrowth.shrub_density_per_m2 = 0;
  orchard.undergrowth.log_density_per_m2 = 0;
  expect_stems(orchard, 121, 122);
}

TEST(SemanticGoals, PillarsAndCarsOfTheGarage) {
  worlds::WorldConfig config;
  config.kind = worlds::WorldKind::kGarage;
  config.garage.length_m = 50;
  config.garage.width_m = 30;
  config.garage.rooms = 2;
  support::MappedCloudOptions options;
  options.low_m = {-2, -15};
  options.high_m = {50, 15};
  options.spacing_m = 2;
  Tally pillars, cars;
  for (const std::uint64_t seed : {101U, 102U, 103U}) {
    const SemanticScore score = score_of(config, options, seed, SceneKind::kGarage);
    pillars.add(score.of(SemanticClass::kPillar));
    cars.add(score.of(SemanticClass::kCar));
    EXPECT_LE(score.of(SemanticClass::kPillar).position_median_m, 0.05) << seed;
    EXPECT_GE(score.of(SemanticClass::kWall).f1, 0.7) << seed;
  }
  EXPECT_GE(pillars.f1(), 0.97);
  EXPECT_GE(cars.f1(), 0.90);
}

}  // namespace
}  // namespace arex::sim
