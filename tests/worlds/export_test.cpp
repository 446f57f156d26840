#include "worlds/export.h"

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>
#include <octomap/OcTree.h>

#include <cstring>
#include <sstream>

#include "support/temporary_folder.h"
#include "worlds/forest.h"
#include "worlds/gaps.h"

namespace arex::worlds {
namespace {

using test::read_text;
using test::TemporaryFolder;

World small_forest() {
  ForestRecipe recipe;
  recipe.size_m = {14, 12};
  recipe.tree.leaves = 40;
  return build(recipe, 3);
}

template <class T>
T take(const std::string& bytes, std::size_t& at) {
  T value;
  std::memcpy(&value, bytes.data() + at, sizeof(T));
  at += sizeof(T);
  return value;
}

TEST(Export, PlyReadsBackBitByBit) {
  const TemporaryFolder folder;
  const World world = small_forest();
  write_ply(world, folder / "mesh.ply");
  const std::string bytes = read_text(folder / "mesh.ply");
  const std::string end = "end_header\n";
  const std::string header = bytes.substr(0, bytes.find(end));
  EXPECT_EQ(header.rfind("ply\nformat binary_little_endian 1.0\n", 0), 0U);
  const Mesh& mesh = world.mesh;
  EXPECT_NE(header.find("element vertex " + std::to_string(mesh.vertices.size()) + "\n"),
            std::string::npos);
  EXPECT_NE(header.find("element face " + std::to_string(mesh.triangles.size()) + "\n"),
            std::string::npos);
  std::size_t at = header.size() + end.size();
  for (const Vec3f& v : mesh.vertices) {
    for (int i = 0; i < 3; ++i) ASSERT_EQ(take<float>(bytes, at), v[i]);
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    ASSERT_EQ(take<std::uint8_t>(bytes, at), 3);
    for (const std::uint32_t v : mesh.triangles[t]) ASSERT_EQ(take<std::uint32_t>(bytes, at), v);
    ASSERT_EQ(take<std::uint8_t>(bytes, at), static_cast<std::uint8_t>(world.class_of_triangle(t)));
    const auto object = take<std::uint32_t>(bytes, at);
    ASSERT_EQ(object, mesh.object_of_triangle[t]);
    ASSERT_EQ(take<float>(bytes, at), world.objects[object].reflectivity);
  }
  EXPECT_EQ(at, bytes.size());
}

TEST(Export, MujocoLoadsEveryShapeAndTheTerrain) {
  const TemporaryFolder folder;
  const World world = small_forest();
  write_mjcf(world, folder / "world.xml");
  std::array<char, 1000> error{};
  mjModel* model = mj_loadXML((folder / "world.xml").c_str(), nullptr, error.data(), error.size());
  ASSERT_NE(model, nullptr) << error.data();
  ASSERT_EQ(model->ngeom, static_cast<int>(world.collision_shapes.size()) + 1);
  ASSERT_EQ(model->nhfield, 1);
  ASSERT_EQ(model->hfield_nrow[0], world.terrain.rows);
  ASSERT_EQ(model->hfield_ncol[0], world.terrain.columns);
  // Heights as MuJoCo sees them: the geom's z plus the normalised sample times the elevation.
  for (std::size_t i = 0; i < world.terrain.height_m.size(); ++i) {
    const double height =
        model->geom_pos[2] + static_cast<double>(model->hfield_data[i]) * model->hfield_size[2];
    EXPECT_NEAR(height, static_cast<double>(world.terrain.height_m[i]), 1e-5);
  }
  EXPECT_NEAR(model->hfield_size[0], 7.0, 1e-6);
  EXPECT_NEAR(model->hfield_size[1], 6.0, 1e-6);
  for (std::size_t i = 0; i < world.collision_shapes.size(); ++i) {
    const CollisionShape& shape = world.collision_shapes[i];
    const mjtNum* p = model->geom_pos + 3 * (i + 1);
    EXPECT_LT((Vec3(p[0], p[1], p[2]) - shape.X_WS.p).norm(), 1e-6);
    EXPECT_EQ(model->geom_type[i + 1], static_cast<int>(mjGEOM_CAPSULE));
    EXPECT_NEAR(model->geom_size[3 * (i + 1)], shape.size.x(), 1e-6);
    EXPECT_NEAR(model->geom_size[3 * (i + 1) + 1], shape.size.y(), 1e-6);
  }
  mj_deleteModel(model);
}

TEST(Export, MujocoLoadsLevelGround) {
  const TemporaryFolder folder;
  write_mjcf(build(EmptyRecipe{}, 1), folder / "world.xml");
  std::array<char, 1000> error{};
  mjModel* model = mj_loadXML((folder / "world.xml").c_str(), nullptr, error.data(), error.size());
  ASSERT_NE(model, nullptr) << error.data();
  mj_deleteModel(model);
}

TEST(Export, OctomapReadsTheSameCells) {
  const TemporaryFolder folder;
  const World world = small_forest();
  Bounds bounds = world.bounds;
  bounds.high.z() = world.X_WS.p.z() + 4;
  const OccupancyGrid occupancy = voxelize(world, make_grid(bounds, 0.2), ClassSet::all());
  const FreeSpace free = flood_free_space(occupancy, world.X_WS.p + Vec3(0, 0, 1), 0);
  write_octomap(occupancy, free, folder / "map.bt");

  octomap::OcTree tree(0.1);
  ASSERT_TRUE(tree.readBinary((folder / "map.bt").string()));
  EXPECT_DOUBLE_EQ(tree.getResolution(), 0.2);
  EXPECT_EQ(tree.size(), tree.calcNumNodes());
  std::size_t counts[3] = {};
  const GridGeometry& grid = occupancy.grid;
  for (int k = 0; k < grid.size.z(); ++k) {
    for (int j = 0; j < grid.size.y(); ++j) {
      for (int i = 0; i < grid.size.x(); ++i) {
        const Vec3 p = grid.centre({i, j, k});
        const octomap::OcTreeNode* node = tree.search(p.x(), p.y(), p.z());
        const std::size_t index = grid.index({i, j, k});
        const int expected = occupancy.occupied[index] ? 2 : free.reachable[index] ? 1 : 0;
        ++counts[expected];
        ASSERT_EQ(node == nullptr ? 0 : tree.isNodeOccupied(node) ? 2 : 1, expected);
      }
    }
  }
  for (const std::size_t count : counts) EXPECT_GT(count, 100U);
  // Nothing outside the grid, and pruned as OctoMap itself would.
  const std::size_t nodes = tree.size();
  tree.toMaxLikelihood();
  tree.prune();
  EXPECT_EQ(tree.size(), nodes);
  EXPECT_EQ(tree.search(grid.origin.x() - 0.1, 0.0, 1.0), nullptr);
}

TEST(Export, Map2dShowsTheWallAndItsOpening) {
  const TemporaryFolder folder;
  GapsRecipe recipe;
  recipe.gap_m = 1.2;
  const World world = build(recipe, 1);
  ExportConfig config;
  config.band_low_m = 0.2;
  export_world(world, config, folder / "out");
  for (const char* name : {"mesh.ply", "world.xml", "terrain.hf", "map.bt", "map2d.yaml"}) {
    EXPECT_TRUE(std::filesystem::exists(folder / "out" / name)) << name;
  }
  const std::string yaml = read_text(folder / "out/map2d.yaml");
  EXPECT_NE(yaml.find("resolution: 0.1\n"), std::string::npos);
  EXPECT_NE(yaml.find("image: map2d.pgm\n"), std::string::npos);
  std::istringstream image(read_text(folder / "out/map2d.pgm"));
  std::string magic;
  int columns = 0, rows = 0, depth = 0;
  image >> magic >> columns >> rows >> depth;
  image.get();
  ASSERT_EQ(magic, "P5");
  ASSERT_EQ(depth, 255);
  std::string pixels(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), '\0');
  image.read(pixels.data(), static_cast<std::streamsize>(pixels.size()));
  ASSERT_TRUE(image.good());
  const GridGeometry grid = make_grid(world.bounds, 0.1);
  ASSERT_EQ(columns, grid.size.x());
  const auto pixel = [&](double x, double y) {
    const Eigen::Vector3i cell = grid.cell_of({x, y, 0});
    return static_cast<unsigned char>(
        pixels[static_cast<std::size_t>((rows - 1 - cell.y()) * columns + cell.x())]);
  };
  EXPECT_EQ(pixel(0.05, 0.05), 254);
  EXPECT_EQ(pixel(recipe.wall_distance_m + 0.05, 0.05), 254);        // in the opening
  EXPECT_EQ(pixel(recipe.wall_distance_m - 0.05, 0.65), 0);          // its lip
  EXPECT_EQ(pixel(recipe.wall_distance_m + 0.05, 0.6 + 0.25), 205);  // inside the pillar
  EXPECT_EQ(pixel(recipe.wall_distance_m + 4, 3), 254);              // beyond
  EXPECT_EQ(pixel(5, recipe.width_m / 2 + 0.05), 0);                 // the side wall
}

TEST(Export, NamesTheFileThatCannotBeWritten) {
  const TemporaryFolder folder;
  try {
    write_ply(World{}, folder / "missing/mesh.ply");
    FAIL() << "written";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("mesh.ply"), std::string::npos);
  }
}

}  // namespace
}  // namespace arex::worlds
