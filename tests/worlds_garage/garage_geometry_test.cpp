// What is seen and what is felt, against ray casts and closed forms.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "math/random.h"
#include "math/so3.h"
#include "worlds/garage.h"
#include "worlds/garage_plan.h"
#include "worlds/mesh_builder.h"
#include "worlds_garage/world_probe.h"

namespace arex::worlds {
namespace {

const Vec3 kDown(0, 0, -1), kUp(0, 0, 1);

TEST(Garage, RampDescendsAtItsAngle) {
  for (const double angle_deg : {20.0, 30.0, 35.0}) {
    GarageRecipe recipe;
    recipe.ramp_angle_deg = angle_deg;
    const World world = build(recipe, 1);
    const double slope = std::tan(angle_deg * std::numbers::pi / 180);
    const double run = -recipe.floor_z_m / slope;
    const double y = 0.7;  // beside the painted line
    const double crest = plan_garage(recipe, 1).crest_x;
    for (double x = 0.25; x < run; x += 1.0) {
      // From a metre above where the ramp should be: the roof is well above that.
      const auto hit = probe::cast(world, {crest + x, y, 1.0 - x * slope}, kDown);
      ASSERT_TRUE(hit);
      EXPECT_EQ(hit->surface_class, SurfaceClass::kRamp);
      EXPECT_NEAR(hit->distance, 1.0, 1e-4) << "x " << x << ", angle " << angle_deg;
    }
  }
}

TEST(Garage, RampIsOpenAboveItsMouthAndHighEnoughBelow) {
  const World world = build({}, 2);
  const GaragePlan plan = plan_garage({}, 2);
  const double slope = std::tan(std::numbers::pi / 6);
  for (const double y : {-2.2, -1.0, 0.0, 1.0, 2.2}) {
    for (double x = -1.0; x < plan.foot_x + 1; x += 0.23) {
      const double z = std::max(-8.5, -std::max(0.0, x - plan.crest_x) * slope);
      const auto hit = probe::cast(world, {x, y, z + 0.2}, kUp);
      EXPECT_GT(hit ? hit->distance : 10.0, 2.2) << x << ", " << y;
      if (x < plan.crest_x + 4) {
        EXPECT_FALSE(hit) << "no sky at " << x << ", " << y;
      }
    }
  }
}

TEST(Garage, FloorAndCeilingAreWhereTheRecipeSays) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const World world = build({}, seed);
    RandomStream random(seed, "probe");
    int floor_hits = 0, ceiling_hits = 0;
    constexpr int kRays = 150;
    for (int i = 0; i < kRays; ++i) {
      const Vec3 p(random.uniform(20, 99), random.uniform(-24, 24), -6.1);
      const auto down = probe::cast(world, p, kDown), up = probe::cast(world, p, kUp);
      ASSERT_TRUE(down && up) << "a hole above or below " << p.transpose();
      EXPECT_LE(down->distance, 2.4 + 1e-4);
      EXPECT_LE(up->distance, 1.1 + 1e-4);
      if (down->surface_class == SurfaceClass::kFloor) {
        ++floor_hits;
        EXPECT_NEAR(down->distance, 2.4, 0.0035);  // a painted line lies 3 mm above
      }
      if (up->surface_class == SurfaceClass::kCeiling) {
        ++ceiling_hits;
        EXPECT_NEAR(up->distance, 1.1, 1e-4);
      }
    }
    EXPECT_GT(floor_hits, kRays / 2);
    EXPECT_GT(ceiling_hits, kRays / 2);
  }
}

TEST(Garage, HallIsClosedAllAround) {
  const World world = build({}, 5);
  RandomStream random(5, "probe");
  for (int i = 0; i < 300; ++i) {
    // The far half: from the ramp's side some rays leave through the mouth, as they should.
    const Vec3 p(random.uniform(60, 98), random.uniform(-24, 24), random.uniform(-8.3, -5.2));
    Vec3 direction = random.normal3();
    direction.x() = std::abs(direction.x());
    EXPECT_TRUE(probe::cast(world, p, direction.normalized())) << p.transpose();
  }
}

TEST(Garage, PillarsStandOnTheGridFromFloorToCeiling) {
  const GarageRecipe recipe;
  const World world = build(recipe, 3);
  const double pitch = recipe.pillar_spacing_m, half = 0.5 * recipe.pillar_width_m;
  const auto by_object = probe::triangles_by_object(world);
  int pillars = 0;
  for (std::size_t i = 0; i < world.objects.size(); ++i) {
    const Eigen::AlignedBox3d box = probe::box_of(world, by_object[i]);
    const bool whole = world.objects[i].surface_class == SurfaceClass::kPillar &&
                       (box.sizes() - Vec3(2 * half, 2 * half, 3.5)).norm() < 1e-4;
    if (!whole) continue;
    ++pillars;
    const Vec3 centre = box.center();
    // Columns about the hall's middle, rows half a pitch off the centre line.
    const double column = (centre.x() - 0.5 * recipe.length_m) / pitch - 0.5;
    const double row = centre.y() / pitch - 0.5;
    EXPECT_NEAR(column, std::round(column), 1e-5);
    EXPECT_NEAR(row, std::round(row), 1e-5);
    EXPECT_NEAR(box.min().z(), recipe.floor_z_m, 1e-5);
    EXPECT_NEAR(box.max().z(), recipe.ceiling_z_m, 1e-5);
  }
  EXPECT_EQ(pillars, 12 * 6);  // 100 x 50 m at a pitch of 8 m
}

/// Points on a solid's surface, on a grid in its own coordinates, with outward normals.
struct SurfacePoint {
  Vec3 p, normal;
};
std::vector<SurfacePoint> surface_points(const CollisionShape& shape, RandomStream& random) {
  std::vector<SurfacePoint> points;
  const bool box = shape.kind == CollisionShape::Kind::kBox;
  for (int i = 0; i < 12; ++i) {
    Vec3 p, n = Vec3::Zero();
    if (box) {
      const int axis = i % 3;
      for (int k = 0; k < 3; ++k) p[k] = random.uniform(-shape.size[k], shape.size[k]);
      n[axis] = i % 2 ? 1 : -1;
      p[axis] = n[axis] * shape.size[axis];
    } else {
      const double a = random.uniform(0, 2 * std::numbers::pi);
      n = Vec3(std::cos(a), std::sin(a), 0);
      p = shape.size.x() * n + Vec3(0, 0, random.uniform(-shape.size.y(), shape.size.y()));
    }
    points.push_back({shape.X_WS * p, shape.X_WS.R * n});
  }
  return points;
}

/// Where two solids of one thing meet, such as a car's boxes, their faces are not its surface.
bool inside_another(const World& world, const CollisionShape& shape, const Vec3& p) {
  return std::any_of(world.collision_shapes.begin(), world.collision_shapes.end(),
                     [&](const CollisionShape& other) {
                       return &other != &shape && other.object == shape.object &&
                              probe::distance_to_shape(other, p) < 0.02;
                     });
}

/// How far what is seen may lie from what is felt: painted lines and corner guards stand out of
/// flat things by millimetres, round ones are drawn as polygons, and a car's upright boxes cut its
/// slanting windscreen halfway up.
double tolerance(SurfaceClass c) {
  switch (c) {
    case SurfaceClass::kCar:
      return 0.32;
    case SurfaceClass::kPipe:
      return 0.03;
    default:
      return 0.025;
  }
}

TEST(Garage, WhatTheVehicleCanHitIsDrawn) {
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    const World world = build({}, seed);
    const auto by_object = probe::triangles_by_object(world);
    RandomStream random(seed, "probe");
    int compared = 0;
    for (const CollisionShape& shape : world.collision_shapes) {
      const SurfaceClass c = world.objects[shape.object].surface_class;
      for (const SurfacePoint& point : surface_points(shape, random)) {
        // Slabs are drawn on the side that can be reached: towards the hall, or the sky.
        if (c == SurfaceClass::kFloor || c == SurfaceClass::kGround) {
          if (point.normal.z() < 0.5) continue;
        } else if (c == SurfaceClass::kCeiling) {
          if (point.normal.z() > -0.5) continue;
        }
        if (inside_another(world, shape, point.p)) continue;
        // A car's solids are its body's; its windows and tyres follow as objects of their own.
        const std::uint32_t last = shape.object + (c == SurfaceClass::kCar ? 2 : 0);
        double nearest = 1e9;
        for (std::uint32_t object = shape.object; object <= last; ++object) {
          for (const std::size_t i : by_object[object]) {
            const auto [a, b, d] = probe::corners(world, i);
            nearest = std::min(nearest, probe::distance_to_triangle(point.p, a, b, d));
          }
        }
        EXPECT_LT(nearest, tolerance(c))
            << kSurfaceClassNames[static_cast<std::size_t>(c)] << " at " << point.p.transpose();
        ++compared;
      }
    }
    EXPECT_GT(compared, 5000);
  }
}

TEST(Garage, WhatIsDrawnCanBeHit) {
  const World world = build({}, 3);
  const auto by_object = probe::triangles_by_object(world);
  RandomStream random(3, "probe");
  int rods = 0, compared = 0;
  for (std::size_t object = 0; object < world.objects.size(); ++object) {
    const SurfaceClass c = world.objects[object].surface_class;
    for (int k = 0; k < 16; ++k) {
      const int last = static_cast<int>(by_object[object].size()) - 1;
      const auto pick = static_cast<std::size_t>(random.uniform_int(0, last));
      const auto [a, b, d] = probe::corners(world, by_object[object][pick]);
      const double u = std::sqrt(random.uniform()), v = random.uniform();
      const Vec3 p = (1 - u) * a + u * (1 - v) * b + u * v * d;
      double nearest = 1e9;
      for (const CollisionShape& shape : world.collision_shapes) {
        nearest = std::min(nearest, probe::distance_to_shape(shape, p));
      }
      ++compared;
      // Rods and sprinkler heads hang in the half metre above a pipe, where no vehicle fits.
      const bool above = c == SurfaceClass::kPipe && p.z() > -5.6 && p.z() <= -5.0;
      if (above && nearest > tolerance(c)) {
        ++rods;
        EXPECT_LT(nearest, 0.35) << p.transpose();
      } else {
        EXPECT_LT(nearest, tolerance(c))
            << kSurfaceClassNames[static_cast<std::size_t>(c)] << " at " << p.transpose();
      }
    }
  }
  EXPECT_LT(rods, compared / 10);
}

TEST(Garage, CarsTouchNeitherEachOtherNorTheBuilding) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    GarageRecipe recipe;
    recipe.occupancy_fraction = 1.0;
    const World world = build(recipe, seed);
    const auto class_of = [&](const CollisionShape& s) {
      return world.objects[s.object].surface_class;
    };
    for (std::size_t i = 0; i < world.collision_shapes.size(); ++i) {
      const CollisionShape& car = world.collision_shapes[i];
      if (class_of(car) != SurfaceClass::kCar) continue;
      for (std::size_t j = 0; j < world.collision_shapes.size(); ++j) {
        const CollisionShape& other = world.collision_shapes[j];
        const SurfaceClass c = class_of(other);
        const bool solid = c == SurfaceClass::kWall || c == SurfaceClass::kPillar ||
                           c == SurfaceClass::kDoor || (c == SurfaceClass::kCar && j > i);
        if (!solid || other.object == car.object || other.kind != CollisionShape::Kind::kBox ||
            (other.X_WS.p - car.X_WS.p).norm() > 4 + other.size.norm()) {
          continue;
        }
        ASSERT_FALSE(probe::boxes_overlap(car, other, 0.0))
            << "seed " << seed << ": car at " << car.X_WS.p.transpose() << " and "
            << kSurfaceClassNames[static_cast<std::size_t>(c)] << " at "
            << other.X_WS.p.transpose();
      }
    }
  }
}

TEST(Car, HasItsKindsSizeAndStandsOnItsWheels) {
  for (int kind = 0; kind < kCarKinds; ++kind) {
    MeshBuilder mesh;
    add_car(mesh, static_cast<CarKind>(kind), Pose{}, {});
    const World world = mesh.finish();
    EXPECT_GE(world.mesh.triangles.size(), 100U);
    EXPECT_LE(world.mesh.triangles.size(), 500U);
    ASSERT_EQ(world.objects.size(), 3U);
    const auto by_object = probe::triangles_by_object(world);
    const Eigen::AlignedBox3d body = probe::box_of(world, by_object[0]);
    const Eigen::AlignedBox3d tyres = probe::box_of(world, by_object[2]);
    const Vec3 size = car_size(static_cast<CarKind>(kind));
    EXPECT_NEAR(body.sizes().x(), size.x(), 1e-4);
    EXPECT_NEAR(body.max().z(), size.z(), 1e-4);
    EXPECT_LT(body.sizes().y(), size.y() + 0.30) << "mirrors";
    EXPECT_NEAR(tyres.min().z(), 0.0, 0.012) << "a polygon in its circle";
    EXPECT_GT(body.min().z(), 0.1);
    EXPECT_LE(world.collision_shapes.size(), 4U);
    // A car is longer than wide, wider than high or nearly so, and has windows above its middle.
    EXPECT_GT(size.x(), 1.9 * size.y());
    EXPECT_GT(probe::box_of(world, by_object[1]).min().z(), 0.5 * size.z());
  }
}

}  // namespace
}  // namespace arex::worlds
