#include <cmath>

#include "fixtures.h"
#include "messages/vehicle.h"
#include "physics/physics.h"

namespace arex::sim {
namespace {

using fixtures::add_shape;
using fixtures::level;
using worlds::CollisionShape;
using worlds::SurfaceClass;
using Kind = CollisionShape::Kind;

constexpr std::array<double, 4> kStopped{};
const double kStanding_m = VehicleConfig{}.ground_offset_m;

TEST(Contact, SettlesOnItsLegsAndStaysThere) {
  const worlds::World world = fixtures::floor_world();
  // The middle of the floor, and 40 m from it.
  for (const Vec2& place : {Vec2(0, 0), Vec2(-41.3, 18.2)}) {
    Physics physics({}, world, level(place.x(), place.y(), kStanding_m + 0.02, 0.7), 1);
    for (int i = 0; i < 2000; ++i) physics.step({});
    const Vec3 rest = physics.truth().X_WB.p;
    EXPECT_NEAR(rest.z(), kStanding_m, 1e-3);
    double fastest = 0, force = 0;
    for (int i = 0; i < 1000; ++i) {
      physics.step({});
      fastest = std::max({fastest, physics.truth().v_WB.norm(), physics.truth().w_WB_B.norm()});
      ASSERT_TRUE(physics.landed());
      ASSERT_EQ(physics.collision(), nullptr);
    }
    for (const Contact& contact : physics.contacts()) force += contact.normal_force_n;
    EXPECT_LT(fastest, 1e-4) << "no jitter";
    EXPECT_LT((physics.truth().X_WB.p - rest).norm(), 1e-4) << "no creep";
    EXPECT_NEAR(force, physics.airframe().mass_kg * kGravity, 1e-3 * force);
  }
}

TEST(Contact, StandsOnRollingTerrainWhereTheTerrainIs) {
  const worlds::World world = fixtures::rolling_world(0.12);
  RandomStream random(4, "places");
  for (int trial = 0; trial < 12; ++trial) {
    const double x = random.uniform(-9, 17), y = random.uniform(-11, 9);
    Physics physics({}, world, level(x, y, world.terrain.at(x, y) + 0.25, random.uniform(-3, 3)),
                    1);
    for (int i = 0; i < 1500; ++i) physics.step({});
    EXPECT_TRUE(physics.landed()) << trial;
    EXPECT_LT(physics.truth().v_WB.norm(), 5e-3) << trial;
    // The centre of mass lies on both diagonals: two feet may carry nearly everything.
    EXPECT_GE(physics.contacts().size(), 2U);
    for (const Contact& contact : physics.contacts()) {
      EXPECT_EQ(contact.surface_class, SurfaceClass::kGround);
      EXPECT_EQ(contact.object, 1U);
      EXPECT_NEAR(contact.p_W.z(), world.terrain.at(contact.p_W.x(), contact.p_W.y()), 2e-3);
    }
  }
}

TEST(Contact, FallsFreelyUntilTheTerrainIsReached) {
  // The terrain is seen in time, also at speed: nothing slows the fall before, and it does not
  // pass.
  const worlds::World world = fixtures::rolling_world(0.2);
  const double ground = world.terrain.at(2, 1);
  Physics physics(fixtures::without_air(), world, level(2, 1, ground + 5), 1);
  bool touched = false;
  for (int i = 0; i < 1500; ++i) {
    physics.step({});
    if (!touched && physics.contacts().empty()) {
      ASSERT_NEAR(physics.truth().a_WB.z(), -kGravity, 1e-6);
    } else {
      touched = true;
    }
    ASSERT_GT(physics.truth().X_WB.p.z(), ground - 0.1);
  }
  EXPECT_TRUE(touched);
}

TEST(Contact, HittingAPillarIsACollisionOfKnownSpeedAndObject) {
  worlds::World world = fixtures::floor_world();
  add_shape(world, SurfaceClass::kPillar, Kind::kCylinder, {Mat3::Identity(), {1, 0, 1.5}},
            {0.2, 1.5, 0});
  add_shape(world, SurfaceClass::kWall, Kind::kBox, {Mat3::Identity(), {-3, 0, 1.5}},
            {0.1, 5, 1.5});
  PhysicsConfig config = fixtures::without_air();
  Physics physics(config, world, level(0.5, 0, 2), 1);
  physics.set_state(level(0.5, 0, 2), {1.5, 0, 0}, Vec3::Zero(), kStopped);
  const Contact* hit = nullptr;
  for (int i = 0; i < 400 && !hit; ++i) {
    physics.step({});
    hit = physics.collision();
  }
  ASSERT_NE(hit, nullptr);
  EXPECT_EQ(hit->object, 1U);
  EXPECT_EQ(hit->surface_class, SurfaceClass::kPillar);
  EXPECT_EQ(hit->part, AirframePart::kLidar) << "the foremost part on the middle line";
  EXPECT_NEAR(hit->impact_speed_mps, 1.5, 0.02);
  EXPECT_NEAR(hit->normal_W.x(), -1, 1e-2);
  EXPECT_FALSE(physics.landed());
  for (int i = 0; i < 50; ++i) physics.step({});
  EXPECT_LT(physics.truth().v_WB.x(), 0.3) << "the pillar stops it";
}

TEST(Contact, AThinBranchIsFeltAtAnySpeed) {
  worlds::World world;
  // 1 cm thick, along x, under the right-hand propellers only.
  add_shape(world, SurfaceClass::kBranch, Kind::kCapsule,
            {so3::Exp({0, std::numbers::pi / 2, 0}), {0, -0.2, 2}}, {0.005, 1.0, 0});
  for (double speed : {0.2, 1.0, 3.0, 6.0}) {
    Physics physics(fixtures::without_air(), world, level(0, 0, 2.3), 1);
    physics.set_state(level(0, 0, 2.3), {0, 0, -speed}, Vec3::Zero(), kStopped);
    const Contact* hit = nullptr;
    for (int i = 0; i < 600 && !hit; ++i) {
      physics.step({});
      hit = physics.collision();
    }
    ASSERT_NE(hit, nullptr) << speed;
    EXPECT_EQ(hit->surface_class, SurfaceClass::kBranch);
    EXPECT_GE(hit->impact_speed_mps, 0.95 * speed);
  }
}

TEST(Contact, LegsMayBrushButNotHit) {
  worlds::World world;
  add_shape(world, SurfaceClass::kCar, Kind::kBox, {Mat3::Identity(), {0, 0, 0.5}}, {1, 1, 0.5});
  const PhysicsConfig config = fixtures::without_air();
  const auto descend = [&](double speed) {
    // Dropped from the height that gives this speed at touch-down.
    const double height = speed * speed / (2 * kGravity);
    Physics physics(config, world, level(0, 0, 1 + kStanding_m + height), 1);
    bool collided = false;
    for (int i = 0; i < 1000; ++i) {
      physics.step({});
      collided = collided || physics.collision() != nullptr;
      EXPECT_FALSE(physics.landed()) << "a car's roof is not ground";
    }
    return collided;
  };
  EXPECT_FALSE(descend(config.contact.leg_bump_limit_mps - 0.1));
  EXPECT_TRUE(descend(config.contact.leg_bump_limit_mps + 0.1));
}

TEST(Contact, HardLandingIsACollision) {
  const worlds::World world = fixtures::floor_world();
  const PhysicsConfig config = fixtures::without_air();
  for (double excess : {-0.1, 0.1}) {
    const double speed = config.contact.hard_landing_limit_mps + excess;
    Physics physics(config, world, level(0, 0, kStanding_m + speed * speed / (2 * kGravity)), 1);
    bool collided = false;
    for (int i = 0; i < 1000; ++i) {
      physics.step({});
      collided = collided || physics.collision() != nullptr;
    }
    EXPECT_EQ(collided, excess > 0);
  }
}

/// A thicket over rolling ground: branches, trunks and crates in every attitude.
worlds::World thicket(std::uint64_t seed) {
  worlds::World world = fixtures::rolling_world(0.1);
  RandomStream random(seed, "thicket");
  for (int i = 0; i < 250; ++i) {
    const Pose X{so3::Exp(random.normal3()),
                 {random.uniform(-4, 4), random.uniform(-4, 4), random.uniform(0, 3)}};
    const auto kind = static_cast<Kind>(random.uniform_int(0, 2));
    const Vec3 size =
        kind == Kind::kBox ? Vec3(0.1, 0.05, 0.15) : Vec3(random.uniform(0.005, 0.06), 0.4, 0);
    add_shape(world, SurfaceClass::kBranch, kind, X, size);
  }
  return world;
}

TEST(Contact, NearestShapesGiveTheSameBitsAsAllShapes) {
  for (std::uint64_t seed : {1, 2, 3}) {
    const worlds::World world = thicket(seed);
    PhysicsConfig near, all;
    near.contact.search_radius_m = 0.6;
    near.contact.slots = 24;  // often fewer than lie in the radius
    all.contact.slots = static_cast<int>(world.collision_shapes.size());
    all.contact.search_radius_m = 1000;
    Physics some(near, world, level(0, 0, 5), seed), full(all, world, level(0, 0, 5), seed);
    for (Physics* physics : {&some, &full}) {
      physics->set_state(level(0, 0, 5), {0.6, 0.3, 0}, {0.5, -1, 2}, kStopped);
    }
    std::size_t touches = 0;
    for (int i = 0; i < 2000; ++i) {
      some.step({});
      full.step({});
      touches += full.contacts().size();
      ASSERT_EQ(some.contacts().size(), full.contacts().size()) << "tick " << i;
      ASSERT_EQ(some.truth().X_WB.p, full.truth().X_WB.p) << "tick " << i;
      ASSERT_EQ(some.truth().w_WB_B, full.truth().w_WB_B) << "tick " << i;
      for (std::size_t k = 0; k < some.contacts().size(); ++k) {
        ASSERT_EQ(some.contacts()[k].object, full.contacts()[k].object);
        ASSERT_EQ(some.contacts()[k].normal_force_n, full.contacts()[k].normal_force_n);
      }
    }
    EXPECT_GT(touches, 100U) << "the fall must meet something";
  }
}

}  // namespace
}  // namespace arex::sim
