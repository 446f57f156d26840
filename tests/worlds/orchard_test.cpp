#include "worlds/orchard.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "config/config.h"
#include "worlds/occupancy.h"
#include "worlds/recipes.h"

namespace arex::worlds {
namespace {

constexpr double kRadius = 0.305;  // m

/// The box around all that is drawn of each object of a class.
std::vector<Eigen::AlignedBox3d> boxes_of(const World& world, SurfaceClass wanted) {
  std::map<std::uint32_t, Eigen::AlignedBox3d> boxes;
  for (std::size_t t = 0; t < world.mesh.triangles.size(); ++t) {
    if (world.class_of_triangle(t) != wanted) continue;
    for (const std::uint32_t corner : world.mesh.triangles[t]) {
      boxes[world.mesh.object_of_triangle[t]].extend(world.mesh.vertices[corner].cast<double>());
    }
  }
  std::vector<Eigen::AlignedBox3d> found;
  for (const auto& [object, box] : boxes) found.push_back(box);
  return found;
}

TEST(Orchard, StandsInRowsOnItsTrellis) {
  OrchardRecipe recipe;
  recipe.size_m = {40, 30};
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const World world = build(recipe, seed);
    // (30 / 2 - 5) / 3.8 = 2.6: three rows on each side of the middle alley.
    ASSERT_EQ(recipe.rows(), 6);
    EXPECT_NEAR(recipe.row_y_m(3), 1.9, 1e-12);
    const int a_row = static_cast<int>(30 / 1.2) + 1;
    const std::vector<Eigen::AlignedBox3d> trunks = boxes_of(world, SurfaceClass::kTrunk);
    // A binomial draw, five sigma.
    const double expected = 6 * a_row * 0.97, sigma = std::sqrt(6 * a_row * 0.97 * 0.03);
    EXPECT_NEAR(static_cast<double>(trunks.size()), expected, 5 * sigma);
    for (const auto& trunk : trunks) {
      double off = 1e9;
      for (int row = 0; row < 6; ++row) {
        off = std::min(off, std::abs(trunk.center().y() - recipe.row_y_m(row)));
      }
      EXPECT_LT(off, 0.4);
    }
    const std::vector<Eigen::AlignedBox3d> posts = boxes_of(world, SurfaceClass::kPillar);
    EXPECT_EQ(posts.size(), 6U * (static_cast<unsigned>(std::lround(30.0 / 8)) + 1));
    for (const auto& post : posts) {
      EXPECT_NEAR(post.max().z(), 3, 1e-6);
      EXPECT_NEAR(post.min().z(), 0, 1e-6);
    }
    const std::vector<Eigen::AlignedBox3d> wires = boxes_of(world, SurfaceClass::kPipe);
    EXPECT_EQ(wires.size(), 6U * 4U);
    for (const auto& wire : wires) {
      EXPECT_NEAR(wire.sizes().x(), 30, 1e-3);
      EXPECT_LT(wire.sizes().z(), 0.003);
    }
  }
}

TEST(Orchard, ItsLeavesHangAtFlightHeightAndItsAlleysAreFree) {
  const OrchardRecipe recipe;
  const World world = build(recipe, 3);
  double at_flight_height = 0, all = 0;
  for (std::size_t t = 0; t < world.mesh.triangles.size(); ++t) {
    if (world.class_of_triangle(t) != SurfaceClass::kLeaf) continue;
    const double z = static_cast<double>(world.mesh.vertices[world.mesh.triangles[t][0]].z());
    ++all;
    at_flight_height += z > 0.8 && z < 2.5;
  }
  EXPECT_GT(at_flight_height, 0.5 * all);
  // Along the middle of every alley, a vehicle's width at 1.5 m meets nothing.
  for (const CollisionShape& shape : world.collision_shapes) {
    const Vec3 p = shape.X_WS.p;
    if (std::abs(p.z() - 1.5) > 0.6 || std::abs(p.x()) > recipe.row_length_m() / 2) continue;
    for (int row = 0; row + 1 < recipe.rows(); ++row) {
      const double alley = (recipe.row_y_m(row) + recipe.row_y_m(row + 1)) / 2;
      EXPECT_GT(std::abs(p.y() - alley), kRadius);
    }
  }
}

TEST(Orchard, IsSolvableForEverySeed) {
  WorldConfig config;
  config.kind = WorldKind::kOrchard;
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    EXPECT_NO_THROW(build_world(config, seed, kRadius)) << seed;
  }
}

TEST(Orchard, RefusesWhatNoneCanBe) {
  const auto refused = [](const char* yaml) {
    OrchardRecipe recipe;
    EXPECT_THROW(read_config(parse_yaml(yaml, "given"), recipe), ConfigError) << yaml;
  };
  refused("{wire_heights_m: [3.5]}");
  refused("{start_radius_m: 2.5}");
  refused("{headland_m: 30}");
  refused("{tree_spacing_m: 0.31, size_m: [500, 500]}");
  refused("{missing_share: 1.5}");
}

}  // namespace
}  // namespace arex::worlds
