#include <gtest/gtest.h>

#include "room.h"
#include "support/temporary_folder.h"

namespace arex::worlds {
namespace {

using arex::test::TemporaryFolder;

class FileErrors : public testing::Test {
 protected:
  std::string said(const std::string& name, const std::string& bytes) {
    test::write_file(folder_ / name, bytes);
    return test::refusal(test::recipe_of(folder_ / name));
  }
  static void expect(const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << "'" << text << "' should say " << part;
    EXPECT_EQ(text.find('\n'), std::string::npos);
  }
  TemporaryFolder folder_;
};

TEST_F(FileErrors, WhatIsNoFile) {
  expect(test::refusal(test::recipe_of(folder_ / "absent.stl")), "no such file");
  expect(test::refusal(test::recipe_of(folder_.path() / ".")), "no kind that can be read");
  expect(said("empty.stl", ""), "empty");
  expect(said("room.xyz", "1 2 3"), "no kind that can be read");
}

TEST_F(FileErrors, WhatHoldsNothing) {
  expect(said("x.ply",
              "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float "
              "y\nproperty float z\nend_header\n"),
         "no faces");
  expect(said("x.sdf", "<sdf version='1.6'><world name='w'/></sdf>"), "no faces");
  expect(said("y.world", "<html></html>"), "holds neither a world nor a model");
  EXPECT_NE(said("x.obj", "# nothing\n"), "");
  EXPECT_NE(said("x.stl", "solid\nendsolid\n"), "");
  expect(said("y.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n"), "holds no faces");
}

TEST_F(FileErrors, WhatWasLeftOutIsSaidWhereNothingIsLeft) {
  const auto world_with = [](const std::string& body) {
    return "<sdf version='1.6'><world name='w'>" + body + "</world></sdf>";
  };
  const auto shape = [&](const std::string& geometry) {
    return world_with(
        "<model name='m'><static>1</static><link name='l'><visual name='v'><geometry>" + geometry +
        "</geometry></visual></link></model>");
  };
  expect(said("a.world", world_with("<include><uri>model://barn</uri></include>")),
         "no points; 1 files not found and left out (model://barn); see world.file.model_paths");
  expect(said("b.world", shape("<mesh><uri>model://barn/barn.dae</uri></mesh>")), "barn.dae");
  expect(said("c.world", shape("<box><size>0 0 0</size></box>")),
         "0 faces and 1 shapes, all of them without area");
  expect(said("d.world", shape("<cylinder><radius>-1</radius><length>2</length></cylinder>")),
         "a shape of negative size");
}

TEST_F(FileErrors, NumbersThatAreNone) {
  auto parts = test::room();
  parts[1].vertices[2].y() = std::nan("");
  parts[1].vertices[3].z() = INFINITY;
  expect(said("x.ply", test::ply(parts, test::PlyKind::kLittle)), "2 of its coordinates");
}

TEST_F(FileErrors, UnitsThatCannotBe) {
  const auto inches = test::mapped(test::room(), [](const Vec3& p) { return 1000 * p; });
  expect(said("x.stl", test::stl_binary(inches)), "6000 x 5000");
  expect(said("y.stl", test::stl_binary(inches)), "file.scale");
  const auto absurd = test::mapped(test::room(), [](const Vec3& p) { return 1e6 * p; });
  expect(said("w.stl", test::stl_binary(absurd)), "6e+06 x 5e+06");
  const auto utm =
      test::mapped(test::room(), [](const Vec3& p) -> Vec3 { return p + Vec3(4e5, 5e6, 100); });
  expect(said("z.ply", test::ply(utm, test::PlyKind::kAscii)), "file.offset_m");
  const auto tiny = test::mapped(test::room(), [](const Vec3& p) { return 1e-3 * p; });
  expect(said("t.stl", test::stl_binary(tiny)), "file.scale");
  expect(said("u.dae", test::collada(test::room(), "Z_UP", 0, Eigen::Matrix4d::Identity())),
         "a unit of 0 m");
}

TEST_F(FileErrors, FacesWithoutAreaAreDroppedAndCounted) {
  auto parts = test::room();
  const auto area = parts;
  for (std::uint32_t i = 0; i < 3; ++i) parts[0].triangles.push_back({i, i, i + 1});
  parts[0].vertices.insert(parts[0].vertices.end(), {{0, 0, 1}, {1, 1, 1}, {2, 2, 1}});
  parts[0].triangles.push_back({4, 5, 6});
  test::write_file(folder_ / "x.stl", test::stl_binary(parts));
  const FileWorld loaded =
      load_file_world(test::recipe_of(folder_ / "x.stl"), test::kVehicleRadius);
  EXPECT_EQ(loaded.dropped, 4U);
  test::expect_surface(loaded.world, area);
  EXPECT_NE(describe(loaded).find("4 faces without area"), std::string::npos);
}

TEST_F(FileErrors, NothingToReach) {
  // A shaft of 0.5 x 0.5 m.
  const auto shaft = test::mapped(test::room(), [](const Vec3& p) -> Vec3 {
    return {0.5 / 6 * p.x(), 0.5 / 5 * p.y(), p.z()};
  });
  EXPECT_NE(said("x.ply", test::ply({shaft[0], shaft[1]}, test::PlyKind::kLittle)), "");
}

TEST_F(FileErrors, DamagedFilesAreOneLine) {
  const auto parts = test::room();
  std::string ply = test::ply(parts, test::PlyKind::kBig);
  expect(said("cut.ply", ply.substr(0, ply.size() - 40)), "ends before its data does");
  expect(said("word.ply",
              "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty "
              "float y\nproperty float z\nend_header\n1 2 3\n1 b 3\n"),
         "where a number is expected");
  expect(said("many.ply",
              "ply\nformat ascii 1.0\nelement vertex 99999999999\nproperty float "
              "x\nend_header\n1\n"),
         "ends before its data does");
  expect(said("x.pcd",
              "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 100000000\n"
              "HEIGHT 1\nPOINTS 100000000\nDATA binary\nabc"),
         "has 3 bytes of points, expected 100000000 points");
  EXPECT_NE(said("x.bt", "# Octomap OcTree binary file\nid OcTree\nsize 100\nres 0.1\ndata\nzz"),
            "");
  EXPECT_NE(said("x.gltf", "{\"asset\":"), "");
  EXPECT_NE(said("x.dae", "<COLLADA><library_geom"), "");
  EXPECT_NE(said("x.world", "<sdf version='1.6'><world"), "");
}

}  // namespace
}  // namespace arex::worlds
