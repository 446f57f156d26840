#include "worlds/mesh_builder.h"

#include <gtest/gtest.h>

#include <map>
#include <numbers>
#include <set>

#include "math/random.h"

namespace arex::worlds {
namespace {

double triangle_area(const Mesh& mesh, std::size_t t) {
  const auto [a, b, c] = mesh.triangles[t];
  const Vec3f e1 = mesh.vertices[b] - mesh.vertices[a];
  const Vec3f e2 = mesh.vertices[c] - mesh.vertices[a];
  return 0.5 * static_cast<double>(e1.cross(e2).norm());
}

double area(const World& world) {
  double sum = 0;
  for (std::size_t t = 0; t < world.mesh.triangles.size(); ++t) sum += triangle_area(world.mesh, t);
  return sum;
}

/// Whether every edge belongs to exactly two triangles.
bool is_closed(const Mesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const auto& t : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) ++edges[std::minmax(t[i], t[(i + 1) % 3])];
  }
  return std::all_of(edges.begin(), edges.end(), [](const auto& e) { return e.second == 2; });
}

Pose random_pose(RandomStream& random) {
  return {so3::Exp(random.normal3()), 5 * random.normal3()};
}

TEST(MeshBuilder, DrawsABoxOfTheRightAreaAtItsPose) {
  RandomStream random(1, "box");
  for (int i = 0; i < 10; ++i) {
    MeshBuilder builder;
    const Vec3 h = random.normal3().cwiseAbs() + Vec3::Constant(0.1);
    const Pose X = random_pose(random);
    builder.add_box(builder.add_object(SurfaceClass::kWall, 0.5), X, h);
    const World world = builder.finish();
    EXPECT_TRUE(is_closed(world.mesh));
    EXPECT_NEAR(area(world), 8 * (h.x() * h.y() + h.y() * h.z() + h.z() * h.x()), 1e-4);
    for (const Vec3f& v : world.mesh.vertices) {
      const Vec3 p = X.inverse() * v.cast<double>();
      EXPECT_LT((p.cwiseAbs() - h).norm(), 1e-5);
    }
  }
}

TEST(MeshBuilder, DrawsACylinderOfTheRightArea) {
  RandomStream random(2, "cylinder");
  for (const int sides : {3, 8, 17}) {
    MeshBuilder builder;
    const double r = 0.4, h = 1.3, half_angle = std::numbers::pi / sides;
    builder.add_cylinder(builder.add_object(SurfaceClass::kPillar, 0.5), random_pose(random), r, h,
                         sides);
    const World world = builder.finish();
    EXPECT_TRUE(is_closed(world.mesh));
    const double caps = sides * r * r * std::sin(2 * half_angle);
    EXPECT_NEAR(area(world), caps + sides * 2 * r * std::sin(half_angle) * 2 * h, 1e-4);
  }
}

TEST(MeshBuilder, DrawsTubesAndTipsClosed) {
  RandomStream random(3, "tube");
  for (int i = 0; i < 20; ++i) {
    std::vector<Vec3> points{random.normal3()};
    std::vector<double> radii{0.2};
    for (int k = 0; k < 6; ++k) {
      points.push_back(points.back() + (Vec3(0, 0, 1.5) + 0.5 * random.normal3()).normalized());
      radii.push_back(0.2 - 0.03 * k);
    }
    if (i % 2) radii.back() = 0;
    if (i % 4 == 3) radii.front() = 0;
    MeshBuilder builder;
    builder.add_tube(builder.add_object(SurfaceClass::kBranch, 0.5), points, radii, 6);
    const World world = builder.finish();
    EXPECT_TRUE(is_closed(world.mesh));
    // Every vertex stands at the radius of one of the points.
    for (const Vec3f& v : world.mesh.vertices) {
      double best = 1e9;
      for (std::size_t k = 0; k < points.size(); ++k) {
        best = std::min(best, std::abs((v.cast<double>() - points[k]).norm() - radii[k]));
      }
      EXPECT_LT(best, 1e-6);
    }
  }
}

TEST(MeshBuilder, DrawsADiscOfTheRightArea) {
  RandomStream random(4, "disc");
  MeshBuilder builder;
  builder.add_disc(builder.add_object(SurfaceClass::kFloor, 0.5), random_pose(random), 2.0, 12);
  EXPECT_NEAR(area(builder.finish()), 6 * 4 * std::sin(std::numbers::pi / 6), 1e-5);
}

TEST(MeshBuilder, LaysACapsuleBetweenItsEnds) {
  RandomStream random(5, "capsule");
  for (int i = 0; i < 50; ++i) {
    const Vec3 a = random.normal3(), b = random.normal3();
    MeshBuilder builder;
    builder.add_collision_capsule(builder.add_object(SurfaceClass::kBranch, 0.5), a, b, 0.1);
    const CollisionShape shape = builder.finish().collision_shapes.at(0);
    EXPECT_NEAR(shape.X_WS.R.determinant(), 1, 1e-12);
    EXPECT_NEAR((shape.X_WS.R * shape.X_WS.R.transpose() - Mat3::Identity()).norm(), 0, 1e-12);
    EXPECT_LT((shape.X_WS * Vec3(0, 0, -shape.size.y()) - a).norm(), 1e-12);
    EXPECT_LT((shape.X_WS * Vec3(0, 0, shape.size.y()) - b).norm(), 1e-12);
  }
}

TEST(MeshBuilder, ChunksCoverEveryTriangleOnceWithinTheirBounds) {
  RandomStream random(6, "chunks");
  MeshBuilder builder;
  const std::uint32_t wood = builder.add_object(SurfaceClass::kBranch, 0.5);
  const std::uint32_t leaf = builder.add_object(SurfaceClass::kLeaf, 0.5);
  constexpr int kTriangles = 30000;
  std::multiset<std::uint32_t> expected_objects;
  double expected_area = 0;
  for (int i = 0; i < kTriangles; ++i) {
    // Half of them crowd one column, which has to be split.
    const double spread = i % 2 ? 20 : 0.5;
    const Vec3 p = spread * random.normal3();
    const Vec3 q = p + 0.1 * random.normal3(), r = p + 0.1 * random.normal3();
    const std::uint32_t object = i % 3 ? leaf : wood;
    builder.add_triangle(object, p, q, r);
    expected_objects.insert(object);
    expected_area += 0.5 * (q - p).cross(r - p).norm();
  }
  const World world = builder.finish();
  const Mesh& mesh = world.mesh;
  ASSERT_EQ(mesh.triangles.size(), kTriangles);
  EXPECT_EQ(
      std::multiset<std::uint32_t>(mesh.object_of_triangle.begin(), mesh.object_of_triangle.end()),
      expected_objects);
  EXPECT_NEAR(area(world), expected_area, 1e-4 * expected_area);
  std::uint32_t next = 0;
  for (const Chunk& chunk : mesh.chunks) {
    EXPECT_EQ(chunk.first_triangle, next);
    EXPECT_GT(chunk.triangle_count, 0U);
    EXPECT_LE(chunk.triangle_count, MeshBuilder::kMaxChunkTriangles);
    EXPECT_LT(chunk.bounds.sizes().head<2>().maxCoeff(), MeshBuilder::kChunkSide + 1.0);
    next += chunk.triangle_count;
    Eigen::AlignedBox3f box;
    const bool leaves = world.class_of_triangle(chunk.first_triangle) == SurfaceClass::kLeaf;
    for (std::uint32_t t = chunk.first_triangle; t < next; ++t) {
      EXPECT_EQ(world.class_of_triangle(t) == SurfaceClass::kLeaf, leaves);
      for (const std::uint32_t v : mesh.triangles[t]) box.extend(mesh.vertices[v]);
    }
    EXPECT_EQ(box.min(), chunk.bounds.min());
    EXPECT_EQ(box.max(), chunk.bounds.max());
  }
  EXPECT_EQ(next, mesh.triangles.size());
}

TEST(MeshBuilder, RejectsImpossiblePrimitives) {
  MeshBuilder builder;
  EXPECT_THROW(builder.add_object(SurfaceClass::kWall, -0.1), std::invalid_argument);
  EXPECT_THROW(builder.add_object(SurfaceClass::kWall, 1001), std::invalid_argument);
  const std::uint32_t object = builder.add_object(SurfaceClass::kWall, 0.5);
  const std::vector<Vec3> one_point{Vec3::Zero()};
  const std::vector<double> one_radius{1.0};
  EXPECT_THROW(builder.add_tube(object, one_point, one_radius, 5), std::invalid_argument);
  EXPECT_THROW(builder.add_height_field(object, HeightField{}), std::invalid_argument);
}

TEST(HeightField, AgreesWithTheTrianglesOfItsMesh) {
  RandomStream random(7, "terrain");
  HeightField field;
  field.origin = {-3, 2};
  field.spacing_m = 0.7;
  field.columns = 9;
  field.rows = 6;
  for (int i = 0; i < field.columns * field.rows; ++i) {
    field.height_m.push_back(static_cast<float>(random.normal()));
  }
  MeshBuilder builder;
  builder.add_height_field(builder.add_object(SurfaceClass::kGround, 0.3), field);
  const World world = builder.finish();
  ASSERT_EQ(world.mesh.triangles.size(), 2U * 8 * 5);
  for (const auto& [a, b, c] : world.mesh.triangles) {
    for (int i = 0; i < 20; ++i) {
      double u = random.uniform(), v = random.uniform();
      if (u + v > 1) u = 1 - u, v = 1 - v;
      const Vec3 p = (1 - u - v) * world.mesh.vertices[a].cast<double>() +
                     u * world.mesh.vertices[b].cast<double>() +
                     v * world.mesh.vertices[c].cast<double>();
      EXPECT_NEAR(world.terrain.at(p.x(), p.y()), p.z(), 1e-5);
    }
  }
  // Clamped outside.
  EXPECT_DOUBLE_EQ(field.at(-100, -100), static_cast<double>(field.height_m.front()));
  EXPECT_DOUBLE_EQ(field.at(100, 100), static_cast<double>(field.height_m.back()));
}

}  // namespace
}  // namespace arex::worlds
