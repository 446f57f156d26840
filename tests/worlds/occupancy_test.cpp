#include "worlds/occupancy.h"

#include <gtest/gtest.h>

#include <deque>

#include "math/random.h"
#include "worlds/mesh_builder.h"

namespace arex::worlds {
namespace {

/// Whether a triangle meets an axis-aligned box: clips the one against the other's six planes.
bool clipped_triangle_is_left(std::vector<Vec3> polygon, const Vec3& low, const Vec3& high) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {1.0, -1.0}) {
      const double limit = sign > 0 ? high[axis] : -low[axis];
      std::vector<Vec3> kept;
      for (std::size_t i = 0; i < polygon.size(); ++i) {
        const Vec3& a = polygon[i];
        const Vec3& b = polygon[(i + 1) % polygon.size()];
        const double da = limit - sign * a[axis], db = limit - sign * b[axis];
        if (da >= 0) kept.push_back(a);
        if ((da > 0 && db < 0) || (da < 0 && db > 0)) kept.push_back(a + da / (da - db) * (b - a));
      }
      polygon = kept;
    }
  }
  return !polygon.empty();
}

OccupancyGrid random_grid(const Eigen::Vector3i& size, double share, RandomStream random) {
  OccupancyGrid out;
  out.grid = {Vec3(-1, 2, 0.5), 0.1, size};
  for (std::size_t i = 0; i < out.grid.cells(); ++i) {
    out.occupied.push_back(random.uniform() < share);
  }
  return out;
}

template <class F>
void for_each_cell(const GridGeometry& grid, const F& f) {
  for (int k = 0; k < grid.size.z(); ++k) {
    for (int j = 0; j < grid.size.y(); ++j) {
      for (int i = 0; i < grid.size.x(); ++i) f(Eigen::Vector3i(i, j, k));
    }
  }
}

TEST(GridGeometry, CoversItsBoundsOnMultiplesOfTheResolution) {
  const GridGeometry grid = make_grid({{-1.0, -0.55, 0}, {1.0, 0.5, 0.31}}, 0.1);
  EXPECT_EQ(grid.size, Eigen::Vector3i(20, 11, 4));
  EXPECT_LT((grid.origin - Vec3(-1, -0.6, 0)).norm(), 1e-12);
  for_each_cell(
      grid, [&](const Eigen::Vector3i& cell) { EXPECT_EQ(grid.cell_of(grid.centre(cell)), cell); });
}

TEST(Voxelize, AgreesWithClippingEveryTriangle) {
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    RandomStream random(seed, "voxelize");
    MeshBuilder builder;
    const std::uint32_t object = builder.add_object(SurfaceClass::kWall, 0.5);
    const double size = seed % 3 == 0 ? 0.05 : 1.0;  // smaller and larger than a cell
    const Vec3 p = random.normal3();
    builder.add_triangle(object, p, p + size * random.normal3(), p + size * random.normal3());
    const World world = builder.finish();
    Bounds bounds = world.bounds;
    bounds.low.array() -= 0.25;
    bounds.high.array() += 0.25;
    const OccupancyGrid occupancy = voxelize(world, make_grid(bounds, 0.1), ClassSet::all());
    std::vector<Vec3> corners;
    for (const Vec3f& v : world.mesh.vertices) corners.push_back(v.cast<double>());
    for_each_cell(occupancy.grid, [&](const Eigen::Vector3i& cell) {
      const Vec3 centre = occupancy.grid.centre(cell);
      const auto touches = [&](double half) {
        return clipped_triangle_is_left(corners, centre.array() - half, centre.array() + half);
      };
      if (touches(0.05)) {
        EXPECT_TRUE(occupancy.at(cell));
      } else if (!touches(0.05 + 5e-6)) {
        EXPECT_FALSE(occupancy.at(cell));
      }
    });
  }
}

TEST(Voxelize, HoldsEverySampleOfTheSurfaceAndOnlyTheAskedClasses) {
  RandomStream random(3, "samples");
  MeshBuilder builder;
  const std::uint32_t wood = builder.add_object(SurfaceClass::kTrunk, 0.5);
  const std::uint32_t leaf = builder.add_object(SurfaceClass::kLeaf, 0.5);
  builder.add_cylinder(wood, {so3::Exp(Vec3(0.3, -0.2, 0.1)), Vec3(0.1, 0.2, 0.3)}, 0.4, 0.9, 12);
  builder.add_quad(leaf, Vec3(2, 0, 0), Vec3(2.2, 0, 0), Vec3(2.2, 0.2, 0.1), Vec3(2, 0.2, 0.1));
  const World world = builder.finish();
  const GridGeometry grid = make_grid(world.bounds, 0.1);
  const OccupancyGrid all = voxelize(world, grid, ClassSet::all());
  const OccupancyGrid bare = voxelize(world, grid, ClassSet::all().without(SurfaceClass::kLeaf));
  for (std::size_t t = 0; t < world.mesh.triangles.size(); ++t) {
    const auto [a, b, c] = world.mesh.triangles[t];
    const bool is_leaf = world.class_of_triangle(t) == SurfaceClass::kLeaf;
    for (int i = 0; i < 300; ++i) {
      const double u = std::sqrt(random.uniform()), v = random.uniform();
      const Vec3 p = (1 - u) * world.mesh.vertices[a].cast<double>() +
                     u * (1 - v) * world.mesh.vertices[b].cast<double>() +
                     u * v * world.mesh.vertices[c].cast<double>();
      EXPECT_TRUE(all.at(grid.cell_of(p)));
      EXPECT_EQ(bare.at(grid.cell_of(p)), !is_leaf);
    }
  }
}

TEST(SquaredDistances, EqualBruteForce) {
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    RandomStream random(seed, "distances");
    const Eigen::Vector3i size(random.uniform_int(1, 20), random.uniform_int(1, 20),
                               random.uniform_int(1, 20));
    const double share = std::array{0.0, 0.002, 0.05, 0.5}[seed % 4];
    const OccupancyGrid occupancy = random_grid(size, share, random.fork(1));
    const std::vector<float> distances = squared_distances(occupancy);
    std::vector<Eigen::Vector3i> occupied;
    for_each_cell(occupancy.grid, [&](const Eigen::Vector3i& cell) {
      if (occupancy.at(cell)) occupied.push_back(cell);
    });
    for_each_cell(occupancy.grid, [&](const Eigen::Vector3i& cell) {
      float best = std::numeric_limits<float>::infinity();
      for (const Eigen::Vector3i& other : occupied) {
        best = std::min(best, static_cast<float>((cell - other).squaredNorm()));
      }
      EXPECT_EQ(distances[occupancy.grid.index(cell)], best);
    });
  }
}

TEST(FloodFreeSpace, EqualsBruteForce) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    RandomStream random(seed, "flood");
    const Eigen::Vector3i size(12, 9, 10);
    const OccupancyGrid occupancy = random_grid(size, seed % 2 ? 0.02 : 0.3, random.fork(1));
    const GridGeometry& grid = occupancy.grid;
    const double radius = seed % 2 ? 0.18 : 0.0;
    const Vec3 start = grid.centre({random.uniform_int(0, 11), random.uniform_int(0, 8), 5});
    const FreeSpace space = flood_free_space(occupancy, start, radius);

    const auto fits = [&](const Eigen::Vector3i& cell) {
      bool free = true;
      for_each_cell(grid, [&](const Eigen::Vector3i& other) {
        free &= !(occupancy.at(other) &&
                  (grid.centre(cell) - grid.centre(other)).norm() <= radius + 1e-9);
      });
      return free;
    };
    std::vector<char> passable(grid.cells()), reachable(grid.cells());
    for_each_cell(grid, [&](const auto& cell) { passable[grid.index(cell)] = fits(cell); });
    reachable[grid.index(grid.cell_of(start))] = passable[grid.index(grid.cell_of(start))];
    for (bool changed = true; changed;) {  // relax until nothing is gained
      changed = false;
      for_each_cell(grid, [&](const Eigen::Vector3i& cell) {
        if (!passable[grid.index(cell)] || reachable[grid.index(cell)]) return;
        for (int n = 0; n < 6; ++n) {
          const Eigen::Vector3i next = cell + (n % 2 ? 1 : -1) * Eigen::Vector3i::Unit(n / 2);
          if (!grid.contains(next) || !reachable[grid.index(next)]) continue;
          reachable[grid.index(cell)] = 1;
          changed = true;
          return;
        }
      });
    }
    for (std::size_t i = 0; i < grid.cells(); ++i) {
      EXPECT_EQ(static_cast<bool>(space.passable[i]), static_cast<bool>(passable[i]));
      EXPECT_EQ(static_cast<bool>(space.reachable[i]), static_cast<bool>(reachable[i]));
    }
  }
}

TEST(FloodFreeSpace, PassesAGapOnlyAtARadiusThatFits) {
  // Two rooms of a closed box, joined by a doorway 1 m wide and as high as the room.
  MeshBuilder builder;
  const std::uint32_t wall = builder.add_object(SurfaceClass::kWall, 0.5);
  const auto box = [&](const Vec3& centre, const Vec3& half) {
    builder.add_box(wall, {Mat3::Identity(), centre}, half);
  };
  box({0, 0, 1.5}, {4, 3, 1.5});
  box({0, -1.75, 1.5}, {0.025, 1.25, 1.5});
  box({0, 1.75, 1.5}, {0.025, 1.25, 1.5});
  const World world = builder.finish();
  const OccupancyGrid occupancy = voxelize(world, make_grid(world.bounds, 0.05), ClassSet::all());
  const Vec3 start(-2, 0, 1.5), goal(2, 0, 1.5);
  EXPECT_TRUE(flood_free_space(occupancy, start, 0.4).at(goal));
  EXPECT_FALSE(flood_free_space(occupancy, start, 0.6).at(goal));
  EXPECT_TRUE(flood_free_space(occupancy, start, 0.6).at(Vec3(-1, 0, 1.5)));
  EXPECT_FALSE(flood_free_space(occupancy, start, 0).at(Vec3(5, 0, 1.5)));  // outside the box
  // A start inside an obstacle reaches nothing.
  const FreeSpace none = flood_free_space(occupancy, Vec3(-4, 0, 1.5), 0.2);
  EXPECT_EQ(std::count(none.reachable.begin(), none.reachable.end(), 1), 0);
}

}  // namespace
}  // namespace arex::worlds
