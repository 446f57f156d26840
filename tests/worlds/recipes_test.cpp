#include "worlds/recipes.h"

#include <gtest/gtest.h>

#include "config/config.h"
#include "worlds/mesh_builder.h"
#include "worlds/occupancy.h"

namespace arex::worlds {
namespace {

constexpr double kRadius = 0.305;  // m

WorldConfig config_of(WorldKind kind) {
  WorldConfig config;
  config.kind = kind;
  return config;
}

TEST(BuildWorld, GivesASolvableForestForEverySeed) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    EXPECT_NO_THROW(build_world(config_of(WorldKind::kForest), seed, kRadius)) << seed;
  }
}

TEST(BuildWorld, GivesASolvableGarageForEverySeed) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    EXPECT_NO_THROW(build_world(config_of(WorldKind::kGarage), seed, kRadius)) << seed;
  }
}

TEST(BuildWorld, IsDeterministicForEveryKind) {
  for (const WorldKind kind : {WorldKind::kForest, WorldKind::kGarage, WorldKind::kGaps,
                               WorldKind::kEmpty, WorldKind::kOrchard}) {
    const WorldConfig config = config_of(kind);
    const std::uint64_t hash = world_hash(build_world(config, 3, kRadius));
    EXPECT_EQ(world_hash(build_world(config, 3, kRadius)), hash);
    EXPECT_NE(world_hash(build_world(config, 4, kRadius)), hash);
  }
}

TEST(BuildWorld, LiesWithinTheExtentThatIsKnownBefore) {
  for (const WorldKind kind : {WorldKind::kForest, WorldKind::kGarage, WorldKind::kGaps,
                               WorldKind::kEmpty, WorldKind::kOrchard}) {
    WorldConfig config = config_of(kind);
    config.forest.size_m = {40, 30};
    config.gaps.width_m = 12;
    config.empty.size_m = {20, 24};
    config.garage.length_m = 80;
    const Eigen::AlignedBox2d extent = extent_of(config).value();
    const World world = build_world(config, 2, kRadius);
    EXPECT_TRUE(world.X_WS.p.head<2>().isZero()) << static_cast<int>(kind);
    // Walls and the ground's last cell stand just outside; the garage's entrance before x = 0.
    const double outside = kind == WorldKind::kGarage ? 20 : 0.5;
    EXPECT_LE(world.bounds.low.x(), extent.min().x() + 1e-9);
    EXPECT_GE(world.bounds.low.x(), extent.min().x() - outside);
    EXPECT_NEAR(world.bounds.low.y(), extent.min().y(), 0.5);
    EXPECT_NEAR(world.bounds.high.x(), extent.max().x(), 0.5);
    EXPECT_NEAR(world.bounds.high.y(), extent.max().y(), 0.5);
  }
}

TEST(BuildWorld, RejectsARecipeThatLeavesNoFreeStart) {
  WorldConfig config = config_of(WorldKind::kForest);
  config.forest.tree_density_per_m2 = 0.55;
  config.forest.min_spacing_m = 1.0;
  try {
    build_world(config, 1, 0.8);
    FAIL() << "accepted";
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("leaves no free start"), std::string::npos);
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
  }
}

TEST(WorldConfig, ReadsFromYamlAndRejectsUnpackableForests) {
  WorldConfig config;
  read_config(parse_yaml("kind: forest\nforest:\n  tree_density_per_m2: 0.2\n  clearings:\n"
                         "    - {centre_m: [3, 4], radius_m: 2}\n  corridors:\n"
                         "    - {points_m: [[0, 0], [5, 5]], width_m: 2}\n",
                         "world.yaml"),
              config);
  EXPECT_EQ(config.forest.tree_density_per_m2, 0.2);
  ASSERT_EQ(config.forest.clearings.size(), 1U);
  EXPECT_EQ(config.forest.clearings[0].centre_m, Vec2(3, 4));
  ASSERT_EQ(config.forest.corridors.size(), 1U);
  EXPECT_EQ(config.forest.corridors[0].points_m[1], Vec2(5, 5));
  EXPECT_THROW(
      read_config(parse_yaml("forest: {tree_density_per_m2: 0.5, min_spacing_m: 2}", "w"), config),
      ConfigError);
  EXPECT_THROW(read_config(parse_yaml("kind: desert", "w"), config), ConfigError);
}

TEST(WorldConfig, ListsItselfSoThatItReadsBack) {
  WorldConfig config;
  config.forest.clearings.push_back({{1, 2}, 3});
  const std::string text = write_yaml(list_parameters(config));
  WorldConfig copy;
  read_config(parse_yaml(text, "resolved.yaml"), copy);
  EXPECT_EQ(write_yaml(list_parameters(copy)), text);
}

TEST(Gaps, OpeningIsExactInTheMeshAndInTheShapes) {
  for (const double gap : {0.62, 0.8, 1.2345}) {
    GapsRecipe recipe;
    recipe.gap_m = gap;
    recipe.gap_offset_m = 1.7;
    const World world = build(recipe, 1);
    // The nearest surfaces on either side of the opening's middle, along y.
    double below = -1e9, above = 1e9;
    for (std::size_t t = 0; t < world.mesh.triangles.size(); ++t) {
      if (world.class_of_triangle(t) != SurfaceClass::kPillar) continue;
      for (const std::uint32_t v : world.mesh.triangles[t]) {
        const double y = static_cast<double>(world.mesh.vertices[v].y());
        (y < recipe.gap_offset_m ? below : above) =
            y < recipe.gap_offset_m ? std::max(below, y) : std::min(above, y);
      }
    }
    EXPECT_NEAR(above - below, gap, 1e-5);
    EXPECT_NEAR((above + below) / 2, recipe.gap_offset_m, 1e-5);
    below = -1e9, above = 1e9;
    for (const CollisionShape& shape : world.collision_shapes) {
      if (shape.kind != CollisionShape::Kind::kCylinder) continue;
      const double y = shape.X_WS.p.y();
      if (y < recipe.gap_offset_m) below = std::max(below, y + shape.size.x());
      if (y > recipe.gap_offset_m) above = std::min(above, y - shape.size.x());
    }
    EXPECT_NEAR(above - below, gap, 1e-9);
  }
}

TEST(Gaps, TheOpeningIsTheOnlyWay) {
  for (const double gap : {0.5, 1.1}) {
    GapsRecipe recipe;
    recipe.gap_m = gap;
    const World world = build(recipe, 1);
    const OccupancyGrid occupancy = voxelize(world, make_grid(world.bounds, 0.1), ClassSet::all());
    const Vec3 start(0, 0, 1);
    const Vec3 beyond(recipe.wall_distance_m + 3, 0, 1);
    EXPECT_EQ(flood_free_space(occupancy, start, 0.4).at(beyond), gap > 1.0);
  }
}

TEST(Gaps, FieldStandsBeforeTheWallAndKeepsItsSpacing) {
  GapsRecipe recipe;
  recipe.field_density_per_m2 = 0.1;
  const World world = build(recipe, 2);
  std::vector<Vec2> field;
  for (const CollisionShape& shape : world.collision_shapes) {
    if (shape.kind != CollisionShape::Kind::kCylinder) continue;
    if (shape.X_WS.p.x() == recipe.wall_distance_m) continue;
    field.emplace_back(shape.X_WS.p.head<2>());
    EXPECT_GT(field.back().norm(), recipe.start_radius_m + shape.size.x());
    EXPECT_LT(field.back().x(), recipe.wall_distance_m - 1);
  }
  EXPECT_GT(field.size(), 10U);
  for (std::size_t i = 0; i < field.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      EXPECT_GE((field[i] - field[k]).norm(), recipe.field_spacing_m);
    }
  }
}

TEST(Empty, IsLevelGround) {
  const World world = build(EmptyRecipe{}, 1);
  EXPECT_TRUE(world.collision_shapes.empty());
  for (const Vec3f& v : world.mesh.vertices) EXPECT_EQ(v.z(), 0.0F);
  EXPECT_EQ(world.terrain.at(3.3, -4.4), 0.0);
  EXPECT_GT(world.bounds.high.z(), 5.0);
}

}  // namespace
}  // namespace arex::worlds
