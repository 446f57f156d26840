#include "worlds/forest.h"

#include <gtest/gtest.h>

#include <numbers>

#include "config/config.h"
#include "math/random.h"
#include "worlds/mesh_builder.h"

namespace arex::worlds {
namespace {

/// A stand of 20 x 20 m with fewer leaves: enough to look closely at each tree.
ForestRecipe small_forest() {
  ForestRecipe recipe;
  recipe.size_m = {20, 20};
  recipe.tree.leaves = 60;
  return recipe;
}

double distance_to_axis(const CollisionShape& capsule, const Vec3& p) {
  const Vec3 local = capsule.X_WS.inverse() * p;
  const double z = std::clamp(local.z(), -capsule.size.y(), capsule.size.y());
  return (local - Vec3(0, 0, z)).norm();
}

/// Depth of p inside a capsule: positive within, zero on the surface.
double depth(const CollisionShape& capsule, const Vec3& p) {
  return capsule.size.x() - distance_to_axis(capsule, p);
}

double distance_to_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const double t = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
  return (p - a - t * (b - a)).norm();
}

double distance_to_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 n = (b - a).cross(c - a).normalized();
  const Vec3 q = p - n.dot(p - a) * n;
  const bool inside = n.dot((b - a).cross(q - a)) >= 0 && n.dot((c - b).cross(q - b)) >= 0 &&
                      n.dot((a - c).cross(q - c)) >= 0;
  if (inside) return (p - q).norm();
  return std::min(
      {distance_to_segment(p, a, b), distance_to_segment(p, b, c), distance_to_segment(p, c, a)});
}

std::vector<std::vector<const CollisionShape*>> shapes_by_object(const World& world) {
  std::vector<std::vector<const CollisionShape*>> out(world.objects.size());
  for (const CollisionShape& shape : world.collision_shapes) out[shape.object].push_back(&shape);
  return out;
}

std::vector<std::vector<std::size_t>> triangles_by_object(const World& world) {
  std::vector<std::vector<std::size_t>> out(world.objects.size());
  for (std::size_t t = 0; t < world.mesh.triangles.size(); ++t) {
    out[world.mesh.object_of_triangle[t]].push_back(t);
  }
  return out;
}

std::size_t count_class(const World& world, SurfaceClass surface_class) {
  std::size_t count = 0;
  for (std::size_t t = 0; t < world.mesh.triangles.size(); ++t) {
    count += world.class_of_triangle(t) == surface_class;
  }
  return count;
}

TEST(Forest, IsThePureFunctionOfRecipeAndSeed) {
  const ForestRecipe recipe = small_forest();
  const World one = build(recipe, 7);
  const World two = build(recipe, 7);
  EXPECT_EQ(one.mesh.vertices, two.mesh.vertices);
  EXPECT_EQ(one.mesh.triangles, two.mesh.triangles);
  EXPECT_EQ(world_hash(one), world_hash(two));
  EXPECT_NE(world_hash(one), world_hash(build(recipe, 8)));
  ForestRecipe other = recipe;
  other.tree.height_m += 0.01;
  EXPECT_NE(world_hash(one), world_hash(build(other, 7)));
}

TEST(Forest, TreesHaveTheAskedDensityAndSpacing) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    ForestRecipe recipe;
    recipe.tree_density_per_m2 = seed % 2 ? 0.10 : 0.18;
    const std::vector<TreeSite> trees = place_trees(recipe, seed);
    const Vec2 extent = recipe.size_m - 2 * Vec2::Constant(recipe.edge_m);
    const double wanted = recipe.tree_density_per_m2 * extent.prod();
    // All darts found room; only the start's disc took some away again.
    const double cleared =
        recipe.start_radius_m + recipe.tree.trunk_radius_max_m * (1 + recipe.tree.root_flare);
    // Discs of the spacing's diameter fill a circle by pi / sqrt 12 at most.
    const double half = recipe.min_spacing_m / 2;
    const double lost = 0.9069 * std::pow((cleared + half) / half, 2);
    EXPECT_LE(static_cast<double>(trees.size()), wanted + 0.5);
    EXPECT_GE(static_cast<double>(trees.size()), wanted - 0.5 - lost);
    for (std::size_t i = 0; i < trees.size(); ++i) {
      for (std::size_t k = 0; k < i; ++k) {
        ASSERT_GE((trees[i].position - trees[k].position).norm(), recipe.min_spacing_m);
      }
    }
  }
}

TEST(Forest, TreesSpreadEvenly) {
  // The number in a quadrant of a hard-core pattern varies less than Poisson's: 4 sigma of Poisson
  // over 20 seeds and 4 quadrants is a bound that a lopsided pattern breaks.
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const std::vector<TreeSite> trees = place_trees(ForestRecipe{}, seed);
    std::array<double, 4> count{};
    for (const auto& [p, index] : trees) {
      count[static_cast<std::size_t>(p.x() > 0) + 2 * static_cast<std::size_t>(p.y() > 0)] += 1;
    }
    const double mean = static_cast<double>(trees.size()) / 4;
    for (const double c : count) EXPECT_NEAR(c, mean, 4 * std::sqrt(mean));
  }
}

TEST(Forest, CollisionShapesHoldTheWoodTightly) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const World world = build(small_forest(), seed);
    const auto shapes = shapes_by_object(world);
    const auto triangles = triangles_by_object(world);
    for (std::size_t object = 0; object < world.objects.size(); ++object) {
      const SurfaceClass c = world.objects[object].surface_class;
      if (c != SurfaceClass::kTrunk && c != SurfaceClass::kLog) continue;
      ASSERT_FALSE(shapes[object].empty());
      // The mesh lies within the shapes.
      for (const std::size_t t : triangles[object]) {
        for (const std::uint32_t v : world.mesh.triangles[t]) {
          const Vec3 p = world.mesh.vertices[v].cast<double>();
          double deepest = -1e9;
          for (const CollisionShape* s : shapes[object]) deepest = std::max(deepest, depth(*s, p));
          EXPECT_GT(deepest, -1e-4) << kSurfaceClassNames[static_cast<std::size_t>(c)];
        }
      }
    }
  }
}

TEST(Forest, TrunkShapesStandOutOfTheMeshByCentimetresAtMost) {
  const World world = build(small_forest(), 4);
  const auto shapes = shapes_by_object(world);
  const auto triangles = triangles_by_object(world);
  RandomStream random(1, "capsule surface");
  int checked = 0;
  for (std::size_t object = 0; object < world.objects.size(); ++object) {
    if (world.objects[object].surface_class != SurfaceClass::kTrunk) continue;
    for (const CollisionShape* shape : shapes[object]) {
      for (int i = 0; i < 30; ++i) {
        const double angle = random.uniform(0, 2 * std::numbers::pi);
        const double z = random.uniform(-shape->size.y(), shape->size.y());
        const Vec3 p = shape->X_WS * Vec3(shape->size.x() * std::cos(angle),
                                          shape->size.x() * std::sin(angle), z);
        if (p.z() < world.terrain.at(p.x(), p.y())) continue;
        const bool buried = std::any_of(
            shapes[object].begin(), shapes[object].end(),
            [&](const CollisionShape* other) { return other != shape && depth(*other, p) > 0; });
        if (buried) continue;
        double nearest = 1e9;
        for (const std::size_t t : triangles[object]) {
          const auto [a, b, c] = world.mesh.triangles[t];
          nearest = std::min(nearest, distance_to_triangle(p, world.mesh.vertices[a].cast<double>(),
                                                           world.mesh.vertices[b].cast<double>(),
                                                           world.mesh.vertices[c].cast<double>()));
        }
        EXPECT_LT(nearest, 0.05);
        ++checked;
      }
    }
  }
  EXPECT_GT(checked, 1000);
}

TEST(Forest, EveryTwigBelowFourMetresIsSolid) {
  const World world = build(small_forest(), 5);
  const auto shapes = shapes_by_object(world);
  const auto triangles = triangles_by_object(world);
  std::size_t checked = 0;
  for (std::size_t object = 0; object < world.objects.size(); ++object) {
    if (world.objects[object].surface_class != SurfaceClass::kBranch) continue;
    for (const std::size_t t : triangles[object]) {
      for (const std::uint32_t v : world.mesh.triangles[t]) {
        const Vec3 p = world.mesh.vertices[v].cast<double>();
        // Less than 4 m above the root, which may stand 0.5 m off the ground below the branch.
        if (p.z() - world.terrain.at(p.x(), p.y()) > 3.5) continue;
        ++checked;
        double deepest = -1e9;
        for (const CollisionShape* s : shapes[object]) deepest = std::max(deepest, depth(*s, p));
        EXPECT_GT(deepest, -1e-4);
      }
    }
  }
  EXPECT_GT(checked, 500U);
}

TEST(Forest, HasBranchesAtFlightHeightDownToOneCentimetre) {
  const World world = build(small_forest(), 6);
  int at_flight_height = 0;
  double thinnest = 1;
  for (const CollisionShape& shape : world.collision_shapes) {
    if (world.objects[shape.object].surface_class != SurfaceClass::kBranch) continue;
    const Vec3& p = shape.X_WS.p;
    const double height = p.z() - world.terrain.at(p.x(), p.y());
    at_flight_height += height > 0.8 && height < 3.0;
    thinnest = std::min(thinnest, 2 * shape.size.x());
  }
  // 20 trees bear 1.6 low branches each on average, of four pieces and two twigs.
  EXPECT_GT(at_flight_height, 60);
  EXPECT_GE(thinnest, 0.01);
  EXPECT_LT(thinnest, 0.013);
}

TEST(Forest, LeavesAndGroundHaveNoCollisionShapes) {
  const World world = build(small_forest(), 7);
  for (const CollisionShape& shape : world.collision_shapes) {
    const SurfaceClass c = world.objects[shape.object].surface_class;
    EXPECT_NE(c, SurfaceClass::kLeaf);
    EXPECT_NE(c, SurfaceClass::kGround);
  }
}

TEST(Forest, DefaultHoldsThePapersBoundsAndTheLeavesOfACanopy) {
  const World world = build(ForestRecipe{}, 1);
  // Exploration bounds of +-25 m and +-20 m around the start (paper, scene 1), with a margin.
  EXPECT_LE(world.bounds.low.x(), world.X_WS.p.x() - 27);
  EXPECT_GE(world.bounds.high.x(), world.X_WS.p.x() + 27);
  EXPECT_LE(world.bounds.low.y(), world.X_WS.p.y() - 22);
  EXPECT_GE(world.bounds.high.y(), world.X_WS.p.y() + 22);
  const std::size_t leaf_quads = count_class(world, SurfaceClass::kLeaf) / 2;
  EXPECT_GT(leaf_quads, 120000U);
  EXPECT_LT(leaf_quads, 280000U);
  EXPECT_LT(world.mesh.triangles.size(), 2000000U);
  for (const Vec3f& v : world.mesh.vertices) {
    ASSERT_TRUE(world.bounds.contains(v.cast<double>())) << v.transpose();
  }
  for (const Object& object : world.objects) {
    EXPECT_GT(object.reflectivity, 0.2F);
    EXPECT_LT(object.reflectivity, 0.6F);
  }
}

TEST(Forest, GroundUndulatesAsAsked) {
  // The RMS height of a swell with 24 waves is amplitude / sqrt 2 in the mean over seeds; a window
  // of a few wavelengths leaves some spread.
  double power = 0;
  constexpr int kSeeds = 10;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    ForestRecipe recipe;
    recipe.tree_density_per_m2 = 0;
    recipe.undergrowth.shrub_density_per_m2 = 0;
    recipe.undergrowth.fern_density_per_m2 = 0;
    recipe.undergrowth.log_density_per_m2 = 0;
    const HeightField terrain = build(recipe, seed).terrain;
    double sum = 0, sum2 = 0;
    for (const float h : terrain.height_m) {
      sum += static_cast<double>(h);
      sum2 += static_cast<double>(h) * static_cast<double>(h);
    }
    const auto n = static_cast<double>(terrain.height_m.size());
    power += (sum2 / n - sum / n * sum / n) / kSeeds;
  }
  EXPECT_NEAR(std::sqrt(power), 0.5 / std::numbers::sqrt2, 0.05);
}

TEST(Forest, ClearingsCorridorsAndTheStartAreFree) {
  ForestRecipe recipe;
  recipe.clearings.push_back({{12, 8}, 5});
  recipe.corridors.push_back({{{-20, -10}, {0, -10}, {15, -15}}, 3});
  const World world = build(recipe, 3);
  EXPECT_NEAR(world.X_WS.p.z(), world.terrain.at(0, 0), 1e-9);
  for (std::size_t t = 0; t < world.mesh.triangles.size(); ++t) {
    if (world.class_of_triangle(t) == SurfaceClass::kGround) continue;
    for (const std::uint32_t v : world.mesh.triangles[t]) {
      const Vec3 p = world.mesh.vertices[v].cast<double>();
      const Vec2 xy = p.head<2>();
      // Centre lines keep out; drawn surfaces may stand out by their thickness.
      constexpr double kThickness = 0.2;
      ASSERT_GT(xy.norm(), recipe.start_radius_m - kThickness);
      if (p.z() - world.terrain.at(p.x(), p.y()) > 4.0 - kThickness) continue;
      ASSERT_GT((xy - Vec2(12, 8)).norm(), 5 - kThickness);
      const bool in_corridor =
          std::abs(xy.y() + 10) < 1.5 - kThickness && std::abs(xy.x() + 10) < 10;
      ASSERT_FALSE(in_corridor);
    }
  }
}

TEST(Forest, AClearingLeavesTheRestAsItWas) {
  ForestRecipe recipe;
  const World before = build(recipe, 5);
  const std::vector<TreeSite> sites = place_trees(recipe, 5);
  recipe.clearings.push_back({{10, 5}, 6});
  const World after = build(recipe, 5);
  EXPECT_LT(place_trees(recipe, 5).size(), sites.size());
  // Far from the clearing every trunk has the same shapes, to the bit.
  const auto trunks = [](const World& world) {
    std::vector<std::array<double, 5>> out;
    for (const CollisionShape& shape : world.collision_shapes) {
      const Vec3& p = shape.X_WS.p;
      if (world.objects[shape.object].surface_class != SurfaceClass::kTrunk) continue;
      if ((p.head<2>() - Vec2(10, 5)).norm() < 9) continue;
      out.push_back({p.x(), p.y(), p.z(), shape.size.x(), shape.size.y()});
    }
    return out;
  };
  EXPECT_GT(trunks(after).size(), 1000U);
  EXPECT_EQ(trunks(before), trunks(after));
}

TEST(Forest, GrowsAMillionLeaves) {
  ForestRecipe recipe;
  recipe.tree.leaves = 4200;
  const World world = build(recipe, 1);
  EXPECT_GT(count_class(world, SurfaceClass::kLeaf) / 2, 950000U);
}

// What is far from where a mission leads is drawn in fewer triangles, as thick and as leafy.
TEST(Forest, FarTreesAreCoarse) {
  ForestRecipe recipe;
  recipe.size_m = {140, 120};
  recipe.tree.leaves = 60;
  const Eigen::AlignedBox2d flown(Vec2(-5, -5), Vec2(30, 5));
  const World full = build(recipe, 5), world = build(recipe, 5, flown);
  const Eigen::AlignedBox2d detailed = recipe.detailed(flown);
  EXPECT_EQ(detailed.min(), Vec2(-40, -40));
  EXPECT_EQ(detailed.max(), Vec2(50, 40));

  struct Tally {
    std::size_t near = 0, far = 0;
    std::array<double, kSurfaceClassNames.size()> far_m2{};
  };
  constexpr double kCrown = 6;  // reaches over the border, m
  const auto tally = [&](const World& of) {
    Tally count;
    for (std::size_t t = 0; t < of.mesh.triangles.size(); ++t) {
      const auto& [a, b, c] = of.mesh.triangles[t];
      const Vec3 p = of.mesh.vertices[a].cast<double>(), q = of.mesh.vertices[b].cast<double>(),
                 r = of.mesh.vertices[c].cast<double>();
      const Vec2 middle = ((p + q + r) / 3).head<2>();
      const double inside = (middle - detailed.min()).cwiseMin(detailed.max() - middle).minCoeff();
      count.near += inside > kCrown;
      if (inside > -kCrown) continue;
      ++count.far;
      count.far_m2[static_cast<std::size_t>(of.class_of_triangle(t))] +=
          0.5 * (q - p).cross(r - p).norm();
    }
    return count;
  };
  const Tally of_full = tally(full), of_coarse = tally(world);
  EXPECT_EQ(of_coarse.near, of_full.near);
  EXPECT_LT(of_coarse.far, of_full.far / 2);
  for (const SurfaceClass c : {SurfaceClass::kTrunk, SurfaceClass::kLeaf, SurfaceClass::kShrub}) {
    const auto i = static_cast<std::size_t>(c);
    EXPECT_NEAR(of_coarse.far_m2[i] / of_full.far_m2[i], 1, 0.1) << kSurfaceClassNames[i];
  }
  const double expected = recipe.expected_triangles(flown);
  EXPECT_GT(expected, 0.7 * static_cast<double>(world.mesh.triangles.size()));
  EXPECT_LT(expected, 2 * static_cast<double>(world.mesh.triangles.size()));
}

TEST(Forest, AMissionThatLeadsThroughTooMuchIsRefused) {
  ForestRecipe recipe;
  recipe.size_m = {300, 300};
  EXPECT_THROW(build(recipe, 1, Eigen::AlignedBox2d(Vec2(-140, -140), Vec2(140, 140))),
               ConfigError);
}

// Of a surveyed stand: 0.18 stems/m^2, 0.22 m mean diameter, 19.4 m high.
TEST(Forest, APineStandHasTheFiguresOfASurveyedOne) {
  ForestRecipe recipe = pine_stand();
  const Vec2 wooded = recipe.size_m - Vec2::Constant(2 * recipe.edge_m);
  double stems = 0;
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    stems += static_cast<double>(place_trees(recipe, seed).size()) / 10;
  }
  EXPECT_NEAR(stems / wooded.prod(), 0.18, 0.01);

  recipe.size_m = {30, 30};
  recipe.tree.leaves = 0;
  const World world = build(recipe, 1);
  const auto triangles = triangles_by_object(world);
  double count = 0, diameter = 0, height = 0;
  for (std::size_t object = 0; object < world.objects.size(); ++object) {
    if (world.objects[object].surface_class != SurfaceClass::kTrunk) continue;
    double top = -1e9, breast_high = 1e9, width = 0;
    Vec3 axis = Vec3::Zero();
    std::vector<Vec3> ring;  // the vertices nearest to breast height
    for (const std::size_t t : triangles[object]) {
      for (const std::uint32_t v : world.mesh.triangles[t]) {
        const Vec3 p = world.mesh.vertices[v].cast<double>();
        top = std::max(top, p.z());
        const double above = p.z() - world.terrain.at(p.x(), p.y());
        if (std::abs(above - 1.3) < breast_high - 0.05) ring.clear();
        breast_high = std::min(breast_high, std::abs(above - 1.3));
        if (std::abs(above - 1.3) < breast_high + 0.05) ring.push_back(p);
      }
    }
    for (const Vec3& p : ring) axis += p / static_cast<double>(ring.size());
    for (const Vec3& p : ring) {
      width += 2 * (p - axis).head<2>().norm() / static_cast<double>(ring.size());
    }
    count += 1;
    diameter += width;
    height += top - world.terrain.at(axis.x(), axis.y());
  }
  ASSERT_GT(count, 60);
  EXPECT_NEAR(diameter / count, 0.22, 0.03);
  EXPECT_NEAR(height / count, 19.4, 1);
}

}  // namespace
}  // namespace arex::worlds
