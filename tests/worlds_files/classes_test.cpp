#include <gtest/gtest.h>

#include "room.h"
#include "support/temporary_folder.h"
#include "worlds/file_classes.h"

namespace arex::worlds {
namespace {

using arex::test::TemporaryFolder;

TEST(FileClasses, PatternsKnowStarAndQuestionMark) {
  EXPECT_TRUE(fits("Tree_07", "tree*"));
  EXPECT_TRUE(fits("old tree", "*TREE"));
  EXPECT_TRUE(fits("tree", "t??e"));
  EXPECT_TRUE(fits("abcabd", "*ab?"));
  EXPECT_TRUE(fits("", "*"));
  EXPECT_FALSE(fits("tree", "tre"));
  EXPECT_FALSE(fits("tre", "tree"));
  EXPECT_FALSE(fits("tree", "t?e"));
  EXPECT_FALSE(fits("street", "tree*"));
}

TEST(FileClasses, WordsInNamesTell) {
  const auto of = [](const char* name, const char* material = "", const char* shape = "mesh") {
    return class_by_name({name, material, shape});
  };
  EXPECT_EQ(of("Oak_Trunk.003"), SurfaceClass::kTrunk);
  EXPECT_EQ(of("OakLeaves"), SurfaceClass::kLeaf);
  EXPECT_EQ(of("tree12", "leaf_green"), SurfaceClass::kLeaf) << "the material goes before";
  EXPECT_EQ(of("outer walls"), SurfaceClass::kWall);
  EXPECT_EQ(of("cars::link"), SurfaceClass::kCar);
  EXPECT_EQ(of("", "", "plane"), SurfaceClass::kGround);
  for (const char* no : {"cart", "scarf", "catalog", "Wallpaper", "unit_box", "street", ""}) {
    EXPECT_FALSE(of(no).has_value()) << no;
  }
}

SurfaceClass class_at(const World& world, const Vec3& p) {
  double best = 1e9;
  SurfaceClass found = SurfaceClass::kLeaf;
  for (std::size_t t = 0; t < world.mesh.triangles.size(); ++t) {
    Vec3 middle = Vec3::Zero();
    for (const auto corner : world.mesh.triangles[t]) {
      middle += world.mesh.vertices[corner].cast<double>() / 3;
    }
    if ((middle - p).norm() >= best) continue;
    best = (middle - p).norm();
    found = world.class_of_triangle(t);
  }
  return found;
}

TEST(FileClasses, RulesGoBeforeNamesAndNamesBeforeForm) {
  const TemporaryFolder folder;
  test::write_file(folder / "room.obj", test::obj(test::room()));
  FileRecipe recipe = test::recipe_of(folder / "room.obj");
  const Vec3 floor(1, 0, 0), wall(4, 0, 1.5), pillar(2.5, 1.6, 1);
  World world = load_file_world(recipe, test::kVehicleRadius).world;
  EXPECT_EQ(class_at(world, floor), SurfaceClass::kFloor);
  EXPECT_EQ(class_at(world, wall), SurfaceClass::kWall);
  EXPECT_EQ(class_at(world, pillar), SurfaceClass::kPillar);
  recipe.classes = {{"pill*", SurfaceClass::kTrunk, 0.4}, {"*", SurfaceClass::kDoor, -1}};
  world = load_file_world(recipe, test::kVehicleRadius).world;
  EXPECT_EQ(class_at(world, floor), SurfaceClass::kDoor);
  EXPECT_EQ(class_at(world, pillar), SurfaceClass::kTrunk);
  for (const Object& object : world.objects) {
    if (object.surface_class == SurfaceClass::kTrunk) {
      EXPECT_FLOAT_EQ(object.reflectivity, 0.4F);
    }
  }
}

TEST(FileClasses, FormTellsWhereNoNameDoes) {
  // The room with a slab over one half, a ramp in the other.
  auto parts = test::room();
  for (auto& part : parts) part.name = part.material = "x";
  const auto quad = [&](const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
    parts.push_back({"x", "x", {a, b, c, d}, {{0, 1, 2}, {0, 2, 3}}});
  };
  quad({-2, -2, 2.2}, {0, -2, 2.2}, {0, 3, 2.2}, {-2, 3, 2.2});
  quad({-2, -2, 2.5}, {0, -2, 2.5}, {0, 3, 2.5}, {-2, 3, 2.5});
  quad({1, -2, 0}, {3, -2, 1}, {3, -1, 1}, {1, -1, 0});
  const TemporaryFolder folder;
  test::write_file(folder / "x.ply", test::ply(parts, test::PlyKind::kLittle));
  FileRecipe recipe = test::recipe_of(folder / "x.ply");
  recipe.start.position_m = {0.5, 1, 0};
  const World world = load_file_world(recipe, test::kVehicleRadius).world;
  EXPECT_EQ(class_at(world, {1, 0, 0}), SurfaceClass::kFloor);
  EXPECT_EQ(class_at(world, {4, 0, 1.5}), SurfaceClass::kWall);
  EXPECT_EQ(class_at(world, {-1, 0, 2.2}), SurfaceClass::kCeiling);
  EXPECT_EQ(class_at(world, {-1, 0, 2.5}), SurfaceClass::kFloor) << "a roof to land on";
  EXPECT_EQ(class_at(world, {2, -1.5, 0.5}), SurfaceClass::kRamp);
}

}  // namespace
}  // namespace arex::worlds
