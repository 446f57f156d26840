#include <gtest/gtest.h>

#include <cmath>

#include "worlds/file_ground.h"
#include "worlds/mesh_builder.h"

namespace arex::worlds {
namespace {

double area_of(const World& world) {
  double area = 0;
  for (std::size_t t = 0; t < world.mesh.triangles.size(); ++t) {
    const std::array<Vec3, 3> v = corners_of(world, t);
    area += 0.5 * (v[1] - v[0]).cross(v[2] - v[0]).norm();
  }
  return area;
}

/// A quad over [x0, x1] x [y0, y1] between two heights at its ends.
void add_slab(MeshBuilder& builder, std::uint32_t object, const Vec2& x, const Vec2& y,
              const Vec2& z) {
  builder.add_quad(object, {x[0], y[0], z[0]}, {x[1], y[0], z[1]}, {x[1], y[1], z[1]},
                   {x[0], y[1], z[0]});
}

// 100 m long, 20 m up: at its far end the floor is far above what is cut at the start.
TEST(CutAbove, LooksIntoASlopingTunnelFromEndToEnd) {
  MeshBuilder builder;
  const auto object = builder.add_object(SurfaceClass::kWall, 0.3, true);
  const Vec2 x(0, 100), y(-3, 3);
  add_slab(builder, object, x, y, {0, 20});
  add_slab(builder, object, x, y, {3, 23});
  for (const double side : y) {
    builder.add_quad(object, {0, side, 0}, {100, side, 20}, {100, side, 23}, {0, side, 3});
  }
  World tunnel = builder.finish();
  tunnel.X_WS.p = Vec3(1, 0, 0.2);
  constexpr double kHeight = 2.2;
  const World open = cut_above(tunnel, storey_of(tunnel), kHeight);
  const double floor = 6 * std::hypot(100, 20), walls = 2 * 100 * kHeight;
  EXPECT_NEAR(area_of(open), floor + walls, 0.01 * walls);
  for (const Vec3f& v : open.mesh.vertices) EXPECT_LE(v.z(), 0.2F * v.x() + 2.3F);
}

// A ramp leads from the one to the other through a gap in the slab.
TEST(StoreyOf, StaysInTheStoreyOfTheStart) {
  MeshBuilder builder;
  const auto object = builder.add_object(SurfaceClass::kFloor, 0.3, true);
  add_slab(builder, object, {0, 20}, {0, 20}, {0, 0});
  add_slab(builder, object, {0, 20}, {5, 20}, {3, 3});
  add_slab(builder, object, {15, 20}, {0, 5}, {3, 3});
  add_slab(builder, object, {5, 15}, {0, 5}, {0, 3});
  World house = builder.finish();
  for (const double storey : {0.0, 3.0}) {
    house.X_WS.p = Vec3(10, 18, storey);
    const HeightField sheet = storey_of(house);
    for (const Vec2& p : {Vec2(2, 12), Vec2(18, 18), Vec2(10, 8)}) {
      EXPECT_NEAR(sheet.at(p.x(), p.y()), storey, 1e-6) << p.transpose();
    }
  }
}

// What nobody can stand on is taken as high as what is nearest to it.
TEST(StoreyOf, IsKnownBesideItsGroundToo) {
  MeshBuilder builder;
  const auto object = builder.add_object(SurfaceClass::kFloor, 0.3, true);
  add_slab(builder, object, {0, 10}, {0, 10}, {4, 4});
  builder.add_quad(object, {30, 0, 0}, {30, 10, 0}, {30, 10, 9}, {30, 0, 9});
  World yard = builder.finish();
  yard.X_WS.p = Vec3(5, 5, 4);
  EXPECT_NEAR(storey_of(yard).at(29, 5), 4, 1e-6);
}

}  // namespace
}  // namespace arex::worlds
