#include "scoring/clearance.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "math/random.h"
#include "worlds/mesh_builder.h"

namespace arex::sim {
namespace {

using worlds::MeshBuilder;
using worlds::SurfaceClass;
using worlds::World;

constexpr double kReach = 2.0;

/// A floor at z = 0 and a wall at x = 10, both larger than any search.
World corner() {
  MeshBuilder builder;
  const auto floor = builder.add_object(SurfaceClass::kFloor, 0.3);
  const auto wall = builder.add_object(SurfaceClass::kWall, 0.3);
  builder.add_quad(floor, {-50, -50, 0}, {50, -50, 0}, {50, 50, 0}, {-50, 50, 0});
  builder.add_quad(wall, {10, -50, -50}, {10, 50, -50}, {10, 50, 50}, {10, -50, 50});
  return builder.finish();
}

TEST(ClearanceMeter, IsTheDistanceOfTheNearestHullPoint) {
  const World world = corner();
  const Scene scene(world);
  ClearanceMeter meter(scene, load_airframe());
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    RandomStream random(seed, "poses");
    Truth truth;
    truth.X_WB.p = {6, 0, 4};
    int within = 0;
    for (int i = 0; i < 400; ++i) {
      // Steps of a flight, and now and then a jump: the search is bounded by how far it went.
      const double step = i % 50 == 0 ? 4.0 : 0.1;
      truth.X_WB.p +=
          step * Vec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
      truth.X_WB.p.x() = std::clamp(truth.X_WB.p.x(), 1.0, 9.0);
      truth.X_WB.p.z() = std::clamp(truth.X_WB.p.z(), 1.0, 8.0);
      truth.X_WB.R *= so3::Exp(step * Vec3(random.uniform(-1, 1), random.uniform(-1, 1), 0));
      double nearest = kReach;
      for (const Vec3& p_B : meter.points_B()) {
        const Vec3 p_W = truth.X_WB * p_B;
        nearest = std::min({nearest, p_W.z(), 10 - p_W.x()});
      }
      EXPECT_NEAR(meter.measure(truth, kReach), nearest, 1e-6);
      within += nearest < kReach;
    }
    EXPECT_GT(within, 50);
    EXPECT_LT(within, 400);
  }
  EXPECT_EQ(meter.statistics().samples, 1200U);
}

}  // namespace
}  // namespace arex::sim
