#include "physics/shape_index.h"

#include "fixtures.h"

namespace arex::sim {
namespace {

using worlds::CollisionShape;

CollisionShape random_shape(RandomStream& random) {
  CollisionShape shape;
  shape.kind = static_cast<CollisionShape::Kind>(random.uniform_int(0, 2));
  shape.X_WS.R = so3::Exp(random.normal3());
  shape.X_WS.p = {random.uniform(-8, 8), random.uniform(-5, 5), random.uniform(0, 4)};
  shape.size = {random.uniform(0.02, 1), random.uniform(0.02, 2), random.uniform(0.02, 1)};
  return shape;
}

/// A random point of the solid, in its own frame, boundary included.
Vec3 point_in(const CollisionShape& shape, RandomStream& random) {
  if (shape.kind == CollisionShape::Kind::kBox) {
    return shape.size.cwiseProduct(
        Vec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)));
  }
  const double along = shape.size.y() * random.uniform(-1, 1);
  if (shape.kind == CollisionShape::Kind::kCapsule) {
    return Vec3(0, 0, along) +
           shape.size.x() * std::cbrt(random.uniform()) * random.normal3().normalized();
  }
  const double angle = random.uniform(0, 2 * std::numbers::pi);
  const double radius = shape.size.x() * std::sqrt(random.uniform());
  return {radius * std::cos(angle), radius * std::sin(angle), along};
}

TEST(ShapeIndex, DistanceAndReachBoundEveryPointAndAreAttained) {
  RandomStream random(11, "shapes");
  for (int trial = 0; trial < 60; ++trial) {
    const CollisionShape shape = random_shape(random);
    const Vec3 point{random.uniform(-9, 9), random.uniform(-6, 6), random.uniform(-1, 5)};
    const double near = distance_to(shape, point), far = reach_from(shape, point);
    double nearest = 1e9, farthest = 0;
    for (int i = 0; i < 20'000; ++i) {
      const double d = (shape.X_WS * point_in(shape, random) - point).norm();
      nearest = std::min(nearest, d);
      farthest = std::max(farthest, d);
    }
    EXPECT_GE(nearest, near - 1e-12);
    EXPECT_LE(farthest, far + 1e-12);
    // 20,000 points leave a gap of a few percent of the size at the extremes.
    EXPECT_NEAR(nearest, near, 0.25);
    EXPECT_NEAR(farthest, far, 0.25);
  }
}

TEST(ShapeIndex, FindsWhatBruteForceFinds) {
  for (std::uint64_t seed : {1, 2, 3}) {
    RandomStream random(seed, "shapes");
    std::vector<CollisionShape> shapes;
    for (int i = 0; i < 300; ++i) shapes.push_back(random_shape(random));
    CollisionShape floor;  // far larger than a cell
    floor.X_WS.p = {0, 0, -0.5};
    floor.size = {50, 25, 0.5};
    shapes.push_back(floor);
    const ShapeIndex index(shapes);
    std::vector<ShapeIndex::Neighbour> found;
    for (int trial = 0; trial < 300; ++trial) {
      const Vec3 point{random.uniform(-60, 60), random.uniform(-6, 6), random.uniform(-1, 5)};
      const double radius = random.uniform(0.1, 3);
      index.find(point, radius, found);
      std::size_t expected = 0;
      for (const CollisionShape& shape : shapes) {
        expected += distance_to(shape, point) <= radius ? 1U : 0U;
      }
      ASSERT_EQ(found.size(), expected);
      for (std::size_t i = 0; i < found.size(); ++i) {
        EXPECT_EQ(found[i].distance_m, distance_to(shapes[found[i].shape], point));
        if (i > 0) {
          EXPECT_LE(found[i - 1].distance_m, found[i].distance_m);
        }
      }
    }
  }
}

}  // namespace
}  // namespace arex::sim
