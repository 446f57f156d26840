#include <gtest/gtest.h>

#include <cmath>

#include "worlds/file_world.h"
#include "worlds/triangle.h"

namespace arex::worlds {
namespace {

constexpr double kVehicleRadius = 0.29;

FileWorld load(const std::string& name) {
  FileRecipe recipe;
  recipe.path = std::string(AREX_SHARED_WORLDS) + "/" + name;
  return load_file_world(recipe, kVehicleRadius);
}

Vec3 extent(const World& world) {
  Eigen::AlignedBox3f box;
  for (const Vec3f& v : world.mesh.vertices) box.extend(v);
  return box.sizes().cast<double>();
}

void expect_free_start(const FileWorld& loaded) {
  const World& world = loaded.world;
  const Vec3 p = world.X_WS.p + Vec3(0, 0, 0.4);
  for (const auto& [a, b, c] : world.mesh.triangles) {
    const auto& v = world.mesh.vertices;
    const Vec3 nearest =
        nearest_on_triangle(p, v[a].cast<double>(), v[b].cast<double>(), v[c].cast<double>());
    ASSERT_GT((nearest - p).norm(), kVehicleRadius);
  }
}

TEST(SharedWorlds, TheOrchard) {
  const FileWorld loaded = load("orchard_world.dae");
  EXPECT_EQ(loaded.world.mesh.triangles.size() + loaded.dropped, 3648U);
  EXPECT_TRUE(extent(loaded.world).isApprox(Vec3(48.430, 38.342, 0.1708), 1e-3));
  EXPECT_GT(loaded.reachable_m2, 1600);
  expect_free_start(loaded);
}

TEST(SharedWorlds, TheParkingGarageIsInInches) {
  const FileWorld loaded = load("parking_garage.dae");
  EXPECT_EQ(loaded.world.mesh.triangles.size() + loaded.dropped, 6413U);
  EXPECT_TRUE(extent(loaded.world).isApprox(0.0254 * Vec3(2380.8, 1634.8514, 1807.29), 1e-3));
  expect_free_start(loaded);
}

TEST(SharedWorlds, TheMineSaysThatYIsUpAndItIsNot) {
  const FileWorld loaded = load("pittsburgh_mine.dae");
  EXPECT_EQ(loaded.world.mesh.triangles.size() + loaded.dropped, 13834U);
  EXPECT_NEAR(extent(loaded.world).z(), 2.75, 0.01);
  EXPECT_EQ(loaded.up, "z");
  ASSERT_FALSE(loaded.notes.empty());
  EXPECT_NE(loaded.notes[0].find("file.up"), std::string::npos);
  expect_free_start(loaded);
}

TEST(SharedWorlds, TheForestOfCylinders) {
  const FileWorld loaded = load("forest_density01seed0.world");
  EXPECT_EQ(loaded.world.collision_shapes.size(), 250U);
  expect_free_start(loaded);
}

TEST(SharedWorlds, TheTrapWithoutItsMeshes) {
  const FileWorld loaded = load("bugtrap.world");
  EXPECT_FALSE(loaded.notes.empty()) << "the robot's own meshes are somebody's files";
  expect_free_start(loaded);
}

TEST(SharedWorlds, TheBuildingAsAnOctree) {
  const FileWorld loaded = load("geb079.bt");
  const Vec3 size = extent(loaded.world);
  EXPECT_NEAR(size.x(), 39, 1.5);
  EXPECT_NEAR(size.y(), 15, 1.5);
  EXPECT_NEAR(size.z(), 3, 0.5);
  EXPECT_GT(loaded.reachable_m2, 150);
  expect_free_start(loaded);
}

}  // namespace
}  // namespace arex::worlds
