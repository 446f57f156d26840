#include <gtest/gtest.h>
#include <png.h>

#include <cmath>
#include <numbers>

#include "config/config.h"
#include "math/so3.h"
#include "room.h"
#include "support/temporary_folder.h"

namespace arex::worlds {
namespace {

using arex::test::TemporaryFolder;
using Kind = CollisionShape::Kind;

std::string world_of(const std::string& inside) {
  return "<?xml version='1.0'?><sdf version='1.6'><world name='w'>" + inside + "</world></sdf>";
}

std::string model(const std::string& name, const std::string& pose, const std::string& geometry,
                  const std::string& tag = "visual") {
  return "<model name='" + name + "'><static>1</static><pose>" + pose + "</pose><link name='l'><" +
         tag + " name='v'><geometry>" + geometry + "</geometry></" + tag + "></link></model>";
}

const std::string kPlane =
    model("ground", "0 0 0 0 0 0", "<plane><normal>0 0 1</normal><size>40 30</size></plane>");

std::vector<CollisionShape> shapes_of(const World& world, Kind kind) {
  std::vector<CollisionShape> found;
  for (const CollisionShape& shape : world.collision_shapes) {
    if (shape.kind == kind) found.push_back(shape);
  }
  return found;
}

TEST(Sdf, PrimitivesStandWhereTheirPosesSay) {
  const TemporaryFolder folder;
  test::write_file(
      folder / "x.world",
      world_of(kPlane + model("box", "5 -3 0.5 0 0 0.5", "<box><size>1 2 1</size></box>") +
               model("rod", "-6 4 1 0.3 0 0",
                     "<cylinder><radius>0.25</radius><length>3</length></cylinder>") +
               model("ball", "8 8 1 0 0 0", "<sphere><radius>0.75</radius></sphere>") +
               model("pill", "-8 -8 1 0 0 0",
                     "<capsule><radius>0.3</radius><length>1</length></capsule>")));
  const World world = test::load(folder / "x.world");
  const auto boxes = shapes_of(world, Kind::kBox);
  ASSERT_EQ(boxes.size(), 1U);
  EXPECT_TRUE(boxes[0].size.isApprox(Vec3(0.5, 1, 0.5)));
  EXPECT_TRUE(boxes[0].X_WS.p.isApprox(Vec3(5, -3, 0.5)));
  EXPECT_TRUE(boxes[0].X_WS.R.isApprox(so3::from_yaw(0.5), 1e-9));
  const auto rods = shapes_of(world, Kind::kCylinder);
  ASSERT_EQ(rods.size(), 1U);
  EXPECT_TRUE(rods[0].size.isApprox(Vec3(0.25, 1.5, 0)));
  EXPECT_TRUE(rods[0].X_WS.R.isApprox(so3::Exp({0.3, 0, 0}), 1e-9));
  const auto pills = shapes_of(world, Kind::kCapsule);
  ASSERT_EQ(pills.size(), 1U);
  EXPECT_TRUE(pills[0].size.isApprox(Vec3(0.3, 0.5, 0)));
  // The ball is of triangles: all its corners on the sphere, and felt.
  std::size_t on_ball = 0;
  for (std::size_t t = 0; t < world.mesh.triangles.size(); ++t) {
    for (const auto corner : world.mesh.triangles[t]) {
      const Vec3 p = world.mesh.vertices[corner].cast<double>();
      if ((p - Vec3(8, 8, 1)).norm() > 1) continue;
      EXPECT_NEAR((p - Vec3(8, 8, 1)).norm(), 0.75, 1e-6);
      EXPECT_TRUE(world.objects[world.mesh.object_of_triangle[t]].felt);
      ++on_ball;
    }
  }
  EXPECT_GT(on_ball, 1000U);
  EXPECT_TRUE(world.bounds.low.isApprox(Vec3(-20, -15, -0.507), 1e-3));
  std::size_t ground = 0;
  for (std::size_t t = 0; t < world.mesh.triangles.size(); ++t) {
    ground += world.class_of_triangle(t) == SurfaceClass::kGround;
  }
  EXPECT_EQ(ground, 2U) << "the plane";
}

TEST(Sdf, NestedPosesAndFramesMultiply) {
  const TemporaryFolder folder;
  test::write_file(
      folder / "x.sdf",
      "<sdf version='1.9'><world name='w'>" + kPlane +
          "<model name='outer'><static>1</static><pose>1 2 0 0 0 1.5</pose>"
          "<frame name='f'><pose>0 1 0 0 0 0.25</pose></frame>"
          "<model name='inner'><pose relative_to='f'>2 0 0.5 0 0 0.2</pose>"
          "<link name='a'><pose>0.5 0 0 0 0 0.1</pose><visual name='v'><pose>0 0.25 0 0.4 0 "
          "0</pose>"
          "<geometry><box><size>0.5 0.6 0.7</size></box></geometry></visual></link></model>"
          "<link name='base'/></model></world></sdf>");
  const World world = test::load(folder / "x.sdf");
  const auto boxes = shapes_of(world, Kind::kBox);
  ASSERT_EQ(boxes.size(), 1U);
  const auto X = [](const Vec3& p, double roll, double yaw) {
    return Pose{so3::from_yaw(yaw) * so3::Exp({roll, 0, 0}), p};
  };
  const Pose expected = X({1, 2, 0}, 0, 1.5) * X({0, 1, 0}, 0, 0.25) * X({2, 0, 0.5}, 0, 0.2) *
                        X({0.5, 0, 0}, 0, 0.1) * X({0, 0.25, 0}, 0.4, 0);
  EXPECT_TRUE(boxes[0].X_WS.p.isApprox(expected.p, 1e-9));
  EXPECT_TRUE(boxes[0].X_WS.R.isApprox(expected.R, 1e-9));
}

TEST(Sdf, IncludesAndMeshesAreFoundAlongThePath) {
  const TemporaryFolder folder;
  const std::string tower =
      "<?xml version='1.0'?><sdf version='1.6'><model name='tower'><static>1</static><link "
      "name='l'><visual name='v'><pose>0 0 1 0 0 0</pose><geometry><mesh><uri>"
      "model://tower/meshes/room.dae</uri><scale>0.1 0.2 0.3</scale></mesh></geometry></visual>"
      "</link></model></sdf>";
  test::write_file(folder / "elsewhere/tower/model.config",
                   "<model><name>tower</name><sdf version='1.6'>model.sdf</sdf></model>");
  test::write_file(folder / "elsewhere/tower/model.sdf", tower);
  // Centimetres, y up: as the mesh says.
  const auto cm = test::mapped(
      test::room(), [](const Vec3& p) -> Vec3 { return 100 * Vec3(p.x(), p.z(), -p.y()); });
  test::write_file(folder / "elsewhere/tower/meshes/room.dae",
                   test::collada(cm, "Y_UP", 0.01, Eigen::Matrix4d::Identity()));
  test::write_file(
      folder / "worlds/x.world",
      world_of(kPlane + "<include><uri>model://tower</uri><name>t2</name><pose>3 -4 0 0 0 "
                        "1.5707963267948966</pose></include>"
                        "<include><uri>model://sun</uri></include>"));
  FileRecipe recipe = test::recipe_of(folder / "worlds/x.world");
  FileWorld without = load_file_world(recipe, test::kVehicleRadius);
  EXPECT_EQ(without.world.mesh.triangles.size(), 2U) << "the ground is left";
  ASSERT_FALSE(without.notes.empty());
  EXPECT_NE(without.notes[0].find("tower"), std::string::npos);
  recipe.model_paths = {(folder / "elsewhere").string()};
  const FileWorld with = load_file_world(recipe, test::kVehicleRadius);
  EXPECT_TRUE(with.notes.empty()) << with.notes[0];
  const auto placed = test::mapped(test::room(), [](const Vec3& p) -> Vec3 {
    const Vec3 q = Vec3(0.1, 0.2, 0.3).cwiseProduct(p) + Vec3(0, 0, 1);
    return {3 - q.y(), -4 + q.x(), q.z()};
  });
  std::vector<test::Part> all = placed;
  all.push_back({"ground",
                 "",
                 {{-20, -15, 0}, {20, -15, 0}, {20, 15, 0}, {-20, 15, 0}},
                 {{0, 1, 2}, {0, 2, 3}}});
  test::expect_surface(with.world, all, 1e-5);
}

// A model that is included may include others, and say where they stand.
TEST(Sdf, IncludesStandInIncludedModels) {
  const TemporaryFolder folder;
  const auto model = [&](const std::string& name, const std::string& body) {
    test::write_file(folder / ("models/" + name + "/model.config"),
                     "<model><name>" + name + "</name><sdf version='1.6'>model.sdf</sdf></model>");
    test::write_file(folder / ("models/" + name + "/model.sdf"),
                     "<?xml version='1.0'?><sdf version='1.6'><model name='" + name +
                         "'><static>1</static>" + body + "</model></sdf>");
  };
  model("post",
        "<link name='l'><pose>3 0 1 0 0 0</pose><visual name='v'><geometry><box><size>1 1 2</size>"
        "</box></geometry></visual></link>");
  model("yard",
        "<include><uri>model://post</uri><pose>1 2 0 0 0 1.5707963267948966</pose></include>"
        "<include><uri>model://shed</uri></include>"
        "<link name='l'/>");
  test::write_file(folder / "x.world",
                   world_of(kPlane + "<include><uri>model://yard</uri><pose>10 0 0 0 0 0</pose>"
                                     "</include>"));
  const FileWorld loaded =
      load_file_world(test::recipe_of(folder / "x.world"), test::kVehicleRadius);
  ASSERT_EQ(loaded.world.collision_shapes.size(), 1U);
  EXPECT_TRUE(loaded.world.collision_shapes[0].X_WS.p.isApprox(Vec3(11, 5, 1), 1e-9));
  ASSERT_EQ(loaded.notes.size(), 1U);
  EXPECT_NE(loaded.notes[0].find("1 files not found and left out (model://shed)"),
            std::string::npos)
      << loaded.notes[0];
}

TEST(Sdf, ASavedStateMovesItsModels) {
  const TemporaryFolder folder;
  test::write_file(
      folder / "x.world",
      world_of(kPlane + model("box", "5 5 0.5 0 0 0", "<box><size>1 1 1</size></box>") +
               "<state world_name='w'><model name='box'><pose frame=''>-4 2 0.5 0 0 "
               "0.7</pose></model></state>"));
  const auto boxes = shapes_of(test::load(folder / "x.world"), Kind::kBox);
  ASSERT_EQ(boxes.size(), 1U);
  EXPECT_TRUE(boxes[0].X_WS.p.isApprox(Vec3(-4, 2, 0.5)));
}

// libsdformat follows such includes until its stack ends.
TEST(Sdf, ModelsThatIncludeEachOtherInACircleAreNamed) {
  const TemporaryFolder folder;
  const auto include = [](const std::string& uri) {
    return "<include><uri>" + uri + "</uri></include>";
  };
  const auto write_model = [&](const std::string& name, const std::string& content) {
    test::write_file(folder / ("models/" + name + "/model.config"),
                     "<model><name>" + name + "</name><sdf version='1.6'>model.sdf</sdf></model>");
    test::write_file(folder / ("models/" + name + "/model.sdf"),
                     "<sdf version='1.6'><model name='" + name + "'><static>1</static>" + content +
                         "<link name='l'/></model></sdf>");
  };
  const auto complaint = [&](const std::string& model) -> std::string {
    test::write_file(folder / "x.world", world_of(kPlane + include(model)));
    try {
      test::load(folder / "x.world");
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  };
  write_model("snake", include("model://snake"));
  EXPECT_NE(complaint("model://snake").find("model://snake includes model://snake"),
            std::string::npos)
      << complaint("model://snake");
  write_model("hen", include("model://nest"));
  write_model("nest", include(" model://egg\n") + include("model://egg"));
  write_model("egg", "<!-- " + include("model://egg") + " -->" + include("model://hen"));
  EXPECT_NE(
      complaint("model://hen")
          .find("model://hen includes model://nest includes model://egg includes model://hen"),
      std::string::npos)
      << complaint("model://hen");
  // What is only written beside, or included twice, is no circle.
  write_model("egg", "<!-- " + include("model://hen") + " -->");
  EXPECT_EQ(complaint("model://hen"), "");
}

TEST(Sdf, CollisionsStandInForMissingVisuals) {
  const TemporaryFolder folder;
  test::write_file(folder / "x.world",
                   world_of(kPlane + model("box", "5 5 0.5 0 0 0", "<box><size>1 1 1</size></box>",
                                           "collision")));
  const World world = test::load(folder / "x.world");
  EXPECT_EQ(shapes_of(world, Kind::kBox).size(), 1U);
  EXPECT_EQ(world.mesh.triangles.size(), 2U + 12U);
}

/// Samples of a landscape, 0 to 1; rows of an image run from the far side to the near one.
double landscape(double u, double v) { return 0.5 + 0.25 * std::sin(5 * u) * std::cos(3 * v); }

template <class Sample>
double write_heightmap(const std::filesystem::path& file, std::uint32_t side, std::uint32_t format,
                       double white) {
  std::vector<Sample> level(side * side);
  double most = 0;
  for (std::uint32_t row = 0; row < side; ++row) {
    for (std::uint32_t column = 0; column < side; ++column) {
      const double h = landscape(column / (side - 1.0), 1 - row / (side - 1.0));
      level[row * side + column] = static_cast<Sample>(white * h);
      most = std::max<double>(most, level[row * side + column]);
    }
  }
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = image.height = side;
  image.format = format;
  EXPECT_NE(png_image_write_to_file(&image, file.c_str(), 0, level.data(), 0, nullptr), 0);
  return most / white;
}

TEST(Sdf, HeightMapsAreTerrain) {
  const TemporaryFolder folder;
  const char* geometry =
      "<heightmap><uri>file://map.png</uri><size>40 20 6</size><pos>0 0 -1</pos></heightmap>";
  test::write_file(folder / "x.world", world_of(model("hills", "0 0 0 0 0 0", geometry)));
  for (const bool deep : {true, false}) {
    const double most =
        deep ? write_heightmap<std::uint16_t>(folder / "map.png", 65, PNG_FORMAT_LINEAR_Y, 60000)
             : write_heightmap<std::uint8_t>(folder / "map.png", 65, PNG_FORMAT_GRAY, 255);
    const World world = test::load(folder / "x.world");
    ASSERT_EQ(world.mesh.triangles.size(), 2U * 64 * 64);
    for (const Vec3f& v : world.mesh.vertices) {
      const double u = static_cast<double>(v.x()) / 40 + 0.5;
      const double w = static_cast<double>(v.y()) / 20 + 0.5;
      EXPECT_NEAR(static_cast<double>(v.z()), 6 * landscape(u, w) / most - 1, deep ? 1e-3 : 0.04);
    }
    EXPECT_EQ(world.class_of_triangle(0), SurfaceClass::kGround);
  }
}

}  // namespace
}  // namespace arex::worlds
