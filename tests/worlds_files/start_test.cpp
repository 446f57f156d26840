#include <gtest/gtest.h>

#include "room.h"
#include "support/temporary_folder.h"
#include "worlds/mesh_builder.h"
#include "worlds/triangle.h"

namespace arex::worlds {
namespace {

using arex::test::TemporaryFolder;

FileRecipe room_recipe(const TemporaryFolder& folder) {
  test::write_file(folder / "room.ply", test::ply(test::room(), test::PlyKind::kLittle));
  return test::recipe_of(folder / "room.ply");
}

/// Distance of a point from the nearest triangle, one by one.
double distance_to(const World& world, const Vec3& p) {
  double best = 1e9;
  for (const auto& [a, b, c] : world.mesh.triangles) {
    const auto& v = world.mesh.vertices;
    best = std::min(
        best,
        (nearest_on_triangle(p, v[a].cast<double>(), v[b].cast<double>(), v[c].cast<double>()) - p)
            .norm());
  }
  return best;
}

TEST(FileStart, IsFoundOnTheGroundWithRoomAround) {
  const TemporaryFolder folder;
  FileRecipe recipe = room_recipe(folder);
  recipe.high_m = {4, 3, 2.9};  // not over the walls
  const FileWorld loaded = load_file_world(recipe, test::kVehicleRadius);
  const Vec3 p = loaded.world.X_WS.p;
  EXPECT_TRUE(loaded.start_found);
  EXPECT_NEAR(p.z(), 0, 1e-6);
  EXPECT_GE(distance_to(loaded.world, p + Vec3(0, 0, 0.6)), 0.6 - 1e-6);
  // 6 x 5 m less the pillar and what the vehicle keeps off walls, in cells of 0.2 m.
  EXPECT_NEAR(loaded.reachable_m2, 5.4 * 4.4, 4.0);
  EXPECT_GT(loaded.reachable.low.x(), -2 + 0.2);
  EXPECT_LT(loaded.reachable.high.x(), 4 - 0.2);
}

TEST(FileStart, IsWhereItIsGiven) {
  const TemporaryFolder folder;
  FileRecipe recipe = room_recipe(folder);
  recipe.start.position_m = {-1, 2};
  recipe.start.yaw_rad = 0.7;
  const Pose X = load_file_world(recipe, test::kVehicleRadius).world.X_WS;
  EXPECT_TRUE(X.p.isApprox(Vec3(-1, 2, 0), 1e-6));
  EXPECT_NEAR(X.R(1, 0), std::sin(0.7), 1e-12);
}

TEST(FileStart, WhatIsWrongWithAGivenOneIsSaid) {
  const TemporaryFolder folder;
  FileRecipe recipe = room_recipe(folder);
  const auto said = [&](std::vector<double> position) {
    recipe.start.position_m = std::move(position);
    return test::refusal(recipe);
  };
  EXPECT_NE(said({1, 1, 2.3}).find("in the air, 2.30 m above the ground"), std::string::npos);
  EXPECT_NE(said({1, 1, -1}).find("1.00 m below the ground"), std::string::npos);
  EXPECT_NE(said({3.85, 1}).find("no room"), std::string::npos);
  EXPECT_NE(said({2.5, 1.75}).find("no room"), std::string::npos) << "inside the pillar";
  EXPECT_NE(said({9, 1}).find("no ground"), std::string::npos);
  EXPECT_EQ(said({1, 1, 0.1}), "");
}

TEST(FileStart, TheLowestFloorWithRoomIsTaken) {
  // Three slabs: 0.25 m of room above the first, 2.45 m above the second, then the sky.
  MeshBuilder builder;
  const auto slab = builder.add_object(SurfaceClass::kWall, 0.3);
  for (const double z : {-0.1, 0.35, 3.0}) {
    builder.add_box(slab, {Mat3::Identity(), {0, 0, z}}, {5, 4, 0.1});
  }
  World world = builder.finish();
  test::Part part{"slabs", "", {}, {}};
  for (const Vec3f& v : world.mesh.vertices) part.vertices.push_back(v.cast<double>());
  part.triangles = world.mesh.triangles;
  const TemporaryFolder folder;
  test::write_file(folder / "slabs.stl", test::stl_binary({part}));
  FileRecipe recipe = test::recipe_of(folder / "slabs.stl");
  EXPECT_NEAR(load_file_world(recipe, test::kVehicleRadius).world.X_WS.p.z(), 0.45, 1e-5);
  recipe.start.position_m = {0, 0};
  EXPECT_NEAR(load_file_world(recipe, test::kVehicleRadius).world.X_WS.p.z(), 0.45, 1e-5);
  recipe.start.position_m = {0, 0, 3.0};
  EXPECT_NEAR(load_file_world(recipe, test::kVehicleRadius).world.X_WS.p.z(), 3.1, 1e-5);
}

}  // namespace
}  // namespace arex::worlds
