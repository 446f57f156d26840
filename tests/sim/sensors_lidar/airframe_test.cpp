#include <gtest/gtest.h>

#include "math/random.h"
#include "messages/vehicle.h"
#include "sensors/mid360_airframe.h"
#include "sensors/scene.h"
#include "sim/sensors_lidar/test_world.h"

namespace arex::sim {
namespace {

using worlds::CollisionShape;
using Kind = CollisionShape::Kind;

// The same solid as a fine mesh: Embree is the oracle of the closed forms.
worlds::World mesh_of(const CollisionShape& shape) {
  test::WorldMaker maker;
  maker.object(0.5F);
  const Pose& X = shape.X_WS;
  const double radius = shape.size.x(), half = shape.size.y();
  if (shape.kind == Kind::kBox) return maker.box(X, shape.size).world();
  maker.tube(X, radius, half, 720);
  for (const double end : {-half, half}) {
    if (shape.kind == Kind::kCapsule) {
      maker.sphere(X * Vec3(0, 0, end), radius, 360, 180);
    } else {
      maker.surface(720, 1, [&](double u, double v) {
        const double angle = 2 * std::numbers::pi * u;
        return X * Vec3(v * radius * std::cos(angle), v * radius * std::sin(angle), end);
      });
    }
  }
  return maker.world();
}

TEST(AirframeMask, MeetsTheShapesWhereTheirMeshesAre) {
  RandomStream stream(1, "airframe");
  for (int i = 0; i < 6; ++i) {
    CollisionShape shape;
    shape.kind = static_cast<Kind>(i % 3);
    shape.X_WS = {so3::Exp(stream.normal3()), 0.5 * stream.normal3().normalized()};
    shape.size = {stream.uniform(0.02, 0.1), stream.uniform(0.02, 0.2), stream.uniform(0.02, 0.1)};
    const Pose X_BL{so3::Exp(stream.normal3()), 0.05 * stream.normal3()};
    const AirframeMask mask({shape}, X_BL);
    const Scene scene(mesh_of(shape));
    int hits = 0;
    for (int j = 0; j < 10'000; ++j) {
      // Half of the directions near the shape.
      Vec3 d_L = stream.normal3().normalized();
      if (j % 2 == 0) d_L = (X_BL.inverse() * shape.X_WS.p + 0.15 * stream.normal3()).normalized();
      const Hit expected = scene.cast(X_BL.p, X_BL.R * d_L, 10);
      const AirframeMask::BodyHit hit = mask.cast(d_L);
      const Vec3f d = d_L.cast<float>();
      if (hit.valid()) {
        ASSERT_TRUE(mask.near_body(d.x(), d.y(), d.z()));
      }
      if (expected.valid() != hit.valid()) {
        // Only at the outline, where the mesh's facets lie inside the round shape.
        ASSERT_TRUE(hit.valid());
        const bool box = shape.kind == Kind::kBox;
        ASSERT_LT(std::abs(hit.normal_L.dot(d_L)), box ? 1e-3 : 0.1);
        continue;
      }
      if (!hit.valid()) continue;
      ++hits;
      const double cosine = std::abs(hit.normal_L.dot(d_L));
      ASSERT_NEAR(hit.distance_m, expected.distance_m, 2e-5 / cosine);
      // A round shape's facet leans by up to half its angle against the true normal.
      ASSERT_GT((X_BL.R * hit.normal_L).dot(expected.normal_W), 0.99);
    }
    EXPECT_GT(hits, 300);
  }
}

TEST(AirframeMask, LeavesOutTheHousingAroundTheOrigin) {
  const Pose X_BL = VehicleConfig{}.X_BL();
  CollisionShape housing;
  housing.kind = Kind::kCylinder;
  housing.X_WS = X_BL;
  housing.size = {0.033, 0.03, 0};
  const AirframeMask mask({housing}, X_BL);
  RandomStream stream(2, "housing");
  for (int i = 0; i < 1000; ++i) {
    const Vec3f d = stream.normal3().normalized().cast<float>();
    ASSERT_FALSE(mask.near_body(d.x(), d.y(), d.z()));
    ASSERT_FALSE(mask.cast(d.cast<double>()).valid());
  }
}

TEST(AirframeMask, AsksOnlyNearTheShapes) {
  // A 2 cm arm 30 cm away covers little of the sphere: the cheap question must say so.
  CollisionShape arm;
  arm.kind = Kind::kCapsule;
  arm.X_WS = {Mat3::Identity(), {0.3, 0, 0}};
  arm.size = {0.01, 0.1, 0};
  const AirframeMask mask({arm}, Pose{});
  RandomStream stream(3, "arm");
  int near = 0;
  for (int i = 0; i < 100'000; ++i) {
    const Vec3f d = stream.normal3().normalized().cast<float>();
    near += mask.near_body(d.x(), d.y(), d.z()) ? 1 : 0;
  }
  EXPECT_LT(near, 1'500);  // the arm itself: 0.4 %
}

}  // namespace
}  // namespace arex::sim
