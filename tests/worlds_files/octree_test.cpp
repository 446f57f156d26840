#include <gtest/gtest.h>
#include <octomap/octomap.h>

#include "math/random.h"
#include "room.h"
#include "support/temporary_folder.h"

namespace arex::worlds {
namespace {

using arex::test::TemporaryFolder;

/// A floor of cells, walls around it, and single cells strewn about.
octomap::OcTree cell_room(std::uint64_t seed) {
  octomap::OcTree tree(0.1);
  const auto set = [&](int i, int j, int k, bool occupied) {
    tree.updateNode(octomap::OcTreeKey(static_cast<octomap::key_type>(32768 + i),
                                       static_cast<octomap::key_type>(32768 + j),
                                       static_cast<octomap::key_type>(32768 + k)),
                    occupied ? 2.0F : -2.0F);
  };
  constexpr int kSide = 48, kHeight = 24;
  RandomStream random(seed, "cells");
  for (int i = -kSide; i < kSide; ++i) {
    for (int j = -kSide; j < kSide; ++j) {
      const bool rim = i == -kSide || j == -kSide || i == kSide - 1 || j == kSide - 1;
      for (int k = -4; k < kHeight; ++k) {
        // Four cells of floor: some leaves are pruned into greater ones.
        const bool floor = k < 0;
        const bool far = i * i + j * j > 400;
        const bool strewn = far && random.uniform() < 0.002;
        if (floor || rim || strewn) {
          set(i, j, k, true);
        } else if (random.uniform() < 0.1) {
          set(i, j, k, false);
        }
      }
    }
  }
  tree.updateInnerOccupancy();
  tree.prune();
  return tree;
}

/// Of every cell in and around the tree: a surface passes exactly between occupied and other cells.
void expect_boundary(const World& world, const octomap::OcTree& tree) {
  const double r = tree.getResolution();
  const auto occupied = [&](const Vec3& p) {
    const auto* node = tree.search(p.x(), p.y(), p.z());
    return node != nullptr && tree.isNodeOccupied(node);
  };
  double area = 0;
  for (const auto& [a, b, c] : world.mesh.triangles) {
    const auto& v = world.mesh.vertices;
    area += 0.5 * static_cast<double>((v[b] - v[a]).cross(v[c] - v[a]).norm());
  }
  double min_x, min_y, min_z, max_x, max_y, max_z;
  tree.getMetricMin(min_x, min_y, min_z);
  tree.getMetricMax(max_x, max_y, max_z);
  std::size_t count = 0;
  std::vector<std::pair<Vec3, bool>> middles;  // of cells' faces, and whether one is there
  for (double x = min_x - r / 2; x < max_x + r; x += r) {
    for (double y = min_y - r / 2; y < max_y + r; y += r) {
      for (double z = min_z - r / 2; z < max_z + r; z += r) {
        for (int axis = 0; axis < 3; ++axis) {
          const Vec3 p(x, y, z);
          const bool face = occupied(p) != occupied(p + r * Vec3::Unit(axis));
          count += face;
          if ((middles.size() + static_cast<std::size_t>(axis)) % 7 == 0 || face) {
            middles.emplace_back(p + 0.5 * r * Vec3::Unit(axis), face);
          }
        }
      }
    }
  }
  EXPECT_NEAR(area, static_cast<double>(count) * r * r, 1e-6 * area);
  // And in the right places.
  for (std::size_t i = 0; i < middles.size(); i += 97) {
    const auto& [p, face] = middles[i];
    double nearest = 1;
    for (const auto& [a, b, c] : world.mesh.triangles) {
      Eigen::AlignedBox3f box;
      for (const auto corner : {a, b, c}) box.extend(world.mesh.vertices[corner]);
      // Rectangles along the axes: two triangles share their box.
      nearest = std::min(nearest, static_cast<double>(box.exteriorDistance(p.cast<float>())));
    }
    EXPECT_EQ(nearest < 1e-4, face) << p.transpose();
  }
}

TEST(Octree, SurfacesStandBetweenOccupiedAndOtherCells) {
  const TemporaryFolder folder;
  for (const std::uint64_t seed : {1, 2}) {
    octomap::OcTree tree = cell_room(seed);
    for (const bool binary : {true, false}) {
      const auto file = folder / (binary ? "room.bt" : "room.ot");
      ASSERT_TRUE(binary ? tree.writeBinary(file.string()) : tree.write(file.string()));
      const World world = test::load(file);
      expect_boundary(world, tree);
      EXPECT_NEAR(world.X_WS.p.z(), 0, 1e-6);
      EXPECT_LT(world.mesh.triangles.size(), 30'000U) << "the merge must be greedy";
    }
  }
}

TEST(Octree, ATreeThatWouldFillTheWorldIsRefused) {
  octomap::OcTree tree(0.01);
  tree.updateNode(octomap::point3d(-300, -300, -100), true);
  tree.updateNode(octomap::point3d(300, 300, 100), true);
  const TemporaryFolder folder;
  ASSERT_TRUE(tree.writeBinary((folder / "far.bt").string()));
  EXPECT_NE(test::refusal(test::recipe_of(folder / "far.bt")).find("cells"), std::string::npos);
}

}  // namespace
}  // namespace arex::worlds
