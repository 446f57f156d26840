#include <gtest/gtest.h>

#include <numbers>

#include "math/so3.h"
#include "room.h"
#include "support/temporary_folder.h"
#include "worlds/export.h"
#include "worlds/mesh_builder.h"

namespace arex::worlds {
namespace {

using arex::test::TemporaryFolder;
using Eigen::Matrix4d;
using test::mapped;
using test::room;

/// From W's axes to those of a file whose `up` points up.
Vec3 with_up(char up, const Vec3& p) {
  if (up == 'y') return {p.x(), p.z(), -p.y()};
  if (up == 'x') return {p.z(), p.x(), p.y()};
  return p;
}

TEST(FileMeshes, EveryFormatGivesTheRoom) {
  const TemporaryFolder folder;
  const auto parts = room();
  const std::vector<std::pair<std::string, std::string>> files{
      {"ascii.stl", test::stl_ascii(parts)},
      {"binary.stl", test::stl_binary(parts)},
      {"quads.obj", test::obj(parts)},
      {"ascii.ply", test::ply(parts, test::PlyKind::kAscii)},
      {"little.ply", test::ply(parts, test::PlyKind::kLittle)},
      {"big.PLY", test::ply(parts, test::PlyKind::kBig)},
      {"room.dae", test::collada(parts, "Z_UP", 1, Matrix4d::Identity())}};
  for (const auto& [name, bytes] : files) {
    SCOPED_TRACE(name);
    test::write_file(folder / name, bytes);
    test::expect_surface(test::load(folder / name), parts);
  }
}

TEST(FileMeshes, AnUpAxisThatIsGivenHolds) {
  const TemporaryFolder folder;
  for (const char up : {'x', 'y', 'z'}) {
    SCOPED_TRACE(up);
    const auto turned = mapped(room(), [&](const Vec3& p) { return with_up(up, p); });
    test::write_file(folder / "room.stl", test::stl_binary(turned));
    FileRecipe recipe = test::recipe_of(folder / "room.stl");
    recipe.up = up == 'x' ? FileUpAxis::kX : up == 'y' ? FileUpAxis::kY : FileUpAxis::kZ;
    const FileWorld loaded = load_file_world(recipe, test::kVehicleRadius);
    EXPECT_EQ(loaded.up, std::string(1, up));
    EXPECT_FALSE(loaded.up_assumed);
    test::expect_surface(loaded.world, room());
  }
}

TEST(FileMeshes, ScaleAndOffsetComeAfterTheAxes) {
  const TemporaryFolder folder;
  const Vec3 offset(1000.5, -2000, 30);
  const auto moved = mapped(room(), [&](const Vec3& p) { return 1000 * (p + offset); });
  test::write_file(folder / "mm.ply", test::ply(moved, test::PlyKind::kAscii));
  FileRecipe recipe = test::recipe_of(folder / "mm.ply");
  recipe.scale = 1e-3;
  recipe.offset_m = offset;
  // Nine digits in the file: a millimetre at a thousand metres.
  test::expect_surface(load_file_world(recipe, test::kVehicleRadius).world, room(), 1e-3);
}

TEST(FileMeshes, ColladaNamesItsUnitsAxesAndNodes) {
  const TemporaryFolder folder;
  Matrix4d X = Matrix4d::Identity();
  X.topLeftCorner<3, 3>() = 2 * so3::Exp({0.3, -0.5, 1.1});  // a node that turns, scales, moves
  X.topRightCorner<3, 1>() = Vec3(3, -7, 11);
  const Matrix4d X_inverse = X.inverse();
  for (const auto& [axis, up] :
       {std::pair("Z_UP", 'z'), std::pair("Y_UP", 'y'), std::pair("X_UP", 'x')}) {
    for (const double unit : {1.0, 0.0254, 0.01}) {
      SCOPED_TRACE(axis);
      SCOPED_TRACE(unit);
      const auto inside = mapped(room(), [&](const Vec3& p) -> Vec3 {
        const Vec3 in_file = with_up(up, p) / unit;
        return (X_inverse * in_file.homogeneous()).head<3>();
      });
      test::write_file(folder / "room.dae", test::collada(inside, axis, unit, X));
      const FileWorld loaded =
          load_file_world(test::recipe_of(folder / "room.dae"), test::kVehicleRadius);
      test::expect_surface(loaded.world, room(), 2e-5);
      if (HasFailure()) return;
    }
  }
}

TEST(FileMeshes, GltfHasYUpAndNodesBelowNodes) {
  const TemporaryFolder folder;
  Matrix4d X = Matrix4d::Identity();
  X.topLeftCorner<3, 3>() = so3::Exp({-0.2, 0.9, 0.4});
  X.topRightCorner<3, 1>() = Vec3(-4, 5, 6);
  const Matrix4d X_inverse = X.inverse();
  const auto inside = mapped(room(), [&](const Vec3& p) -> Vec3 {
    return (X_inverse * with_up('y', p).homogeneous()).head<3>();
  });
  test::write_file(folder / "room.gltf", test::gltf(inside, X));
  test::expect_surface(test::load(folder / "room.gltf"), room(), 2e-5);
}

TEST(FileMeshes, OurOwnExportComesBackWithItsClasses) {
  MeshBuilder builder;
  const auto ground = builder.add_object(SurfaceClass::kGround, 0.31);
  const auto trunk = builder.add_object(SurfaceClass::kTrunk, 0.42);
  const auto leaf = builder.add_object(SurfaceClass::kLeaf, 0.5);
  builder.add_box(ground, {Mat3::Identity(), {0, 0, -0.5}}, {8, 8, 0.5});
  builder.add_cylinder(trunk, {Mat3::Identity(), {4, 1, 1}}, 0.2, 1, 12);
  builder.add_disc(leaf, {Mat3::Identity(), {4, 1, 2.5}}, 1, 6);
  World world = builder.finish();
  const TemporaryFolder folder;
  write_ply(world, folder / "mesh.ply");
  const World again = test::load(folder / "mesh.ply");
  std::array<double, kSurfaceClassNames.size()> area{};
  for (const World* each : std::initializer_list<const World*>{&world, &again}) {
    const double sign = each == &world ? 1 : -1;
    for (std::size_t t = 0; t < each->mesh.triangles.size(); ++t) {
      const auto& [a, b, c] = each->mesh.triangles[t];
      const auto& v = each->mesh.vertices;
      area[static_cast<std::size_t>(each->class_of_triangle(t))] +=
          sign * static_cast<double>((v[b] - v[a]).cross(v[c] - v[a]).norm());
    }
  }
  for (const double difference : area) EXPECT_NEAR(difference, 0, 1e-4);
  ASSERT_EQ(again.objects.size(), 3U);
  for (const Object& object : again.objects) {
    EXPECT_EQ(object.felt, object.surface_class != SurfaceClass::kLeaf);
    if (object.surface_class == SurfaceClass::kTrunk) {
      EXPECT_FLOAT_EQ(object.reflectivity, 0.42F);
    }
  }
}

}  // namespace
}  // namespace arex::worlds
