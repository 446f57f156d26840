// The recipe and its random decisions.
#include "worlds/garage.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "config/config.h"
#include "worlds/garage_plan.h"
#include "worlds/mesh_builder.h"
#include "worlds_garage/world_probe.h"

namespace arex::worlds {
namespace {

TEST(Garage, SameRecipeAndSeedGiveTheSameBytes) {
  std::set<std::uint64_t> hashes;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const World first = build({}, seed), second = build({}, seed);
    EXPECT_EQ(world_hash(first), world_hash(second));
    ASSERT_EQ(first.mesh.vertices.size(), second.mesh.vertices.size());
    EXPECT_TRUE(first.mesh.vertices == second.mesh.vertices);
    EXPECT_TRUE(first.mesh.triangles == second.mesh.triangles);
    hashes.insert(world_hash(first));
  }
  EXPECT_EQ(hashes.size(), 3U) << "seeds must differ";
  GarageRecipe other;
  other.occupancy_fraction = 0.3;
  EXPECT_EQ(hashes.count(world_hash(build(other, 1))), 0U);
}

TEST(Garage, EverythingIsLabelledChunkedAndWithinBounds) {
  const World world = build({}, 7);
  const auto by_object = probe::triangles_by_object(world);
  for (std::size_t i = 0; i < world.objects.size(); ++i) {
    EXPECT_FALSE(by_object[i].empty()) << "object " << i << " cannot be seen";
    EXPECT_GT(world.objects[i].reflectivity, 0.0F);
    EXPECT_LE(world.objects[i].reflectivity, 1.0F);
  }
  std::set<SurfaceClass> classes;
  for (const Object& object : world.objects) classes.insert(object.surface_class);
  for (const SurfaceClass expected :
       {SurfaceClass::kGround, SurfaceClass::kFloor, SurfaceClass::kRamp, SurfaceClass::kWall,
        SurfaceClass::kCeiling, SurfaceClass::kPillar, SurfaceClass::kBeam, SurfaceClass::kPipe,
        SurfaceClass::kCar, SurfaceClass::kKerb, SurfaceClass::kDoor}) {
    EXPECT_EQ(classes.count(expected), 1U)
        << kSurfaceClassNames[static_cast<std::size_t>(expected)];
  }
  for (const Vec3f& vertex : world.mesh.vertices) {
    ASSERT_TRUE((vertex.cast<double>().array() >= world.bounds.low.array() - 1e-5).all());
    ASSERT_TRUE((vertex.cast<double>().array() <= world.bounds.high.array() + 1e-5).all());
  }
  EXPECT_GE(world.collision_shapes.size(), 300U);
  EXPECT_LE(world.collision_shapes.size(), 1500U);
  EXPECT_EQ(world.terrain.columns, 0);
  // Only a chunk of limited reach can be culled: the largest face is a tile.
  for (std::size_t i = 0; i < world.mesh.triangles.size(); ++i) {
    const SurfaceClass c = world.class_of_triangle(i);
    if (c == SurfaceClass::kPipe) continue;  // pipes are long and thin
    const auto [a, b, d] = probe::corners(world, i);
    ASSERT_LT(std::max({(a - b).norm(), (b - d).norm(), (d - a).norm()}), 6.0)
        << kSurfaceClassNames[static_cast<std::size_t>(c)];
  }
}

TEST(Garage, BaysFillWithTheRecipesProbability) {
  std::size_t bays = 0, cars = 0;
  std::set<CarKind> kinds;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const GaragePlan plan = plan_garage({}, seed);
    bays += plan.bays.size();
    cars += plan.cars.size();
    for (const ParkedCar& car : plan.cars) kinds.insert(car.kind);
  }
  const double p = GarageRecipe{}.occupancy_fraction, n = static_cast<double>(bays);
  EXPECT_NEAR(static_cast<double>(cars), n * p, 4 * std::sqrt(n * p * (1 - p)));
  EXPECT_EQ(kinds.size(), static_cast<std::size_t>(kCarKinds));
  GarageRecipe recipe;
  recipe.occupancy_fraction = 0;
  EXPECT_TRUE(plan_garage(recipe, 1).cars.empty());
  recipe.occupancy_fraction = 1;
  const GaragePlan full = plan_garage(recipe, 1);
  EXPECT_EQ(full.cars.size(), full.bays.size());
}

TEST(Garage, SomeRoomsStandOpenAndSomeAreShut) {
  std::set<double> doors;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const GaragePlan plan = plan_garage({}, seed);
    ASSERT_EQ(plan.rooms.size(), static_cast<std::size_t>(GarageRecipe{}.rooms));
    EXPECT_TRUE(plan.rooms[0].open);
    EXPECT_FALSE(plan.rooms[1].open);
    for (const GarageRoom& room : plan.rooms) doors.insert(room.door.x());
  }
  EXPECT_GT(doors.size(), 60U) << "the doors' places must depend on the seed";
}

TEST(Garage, ChangingTheCarsLeavesTheRoomsAndPipesAsTheyWere) {
  GarageRecipe other;
  other.occupancy_fraction = 0.9;
  const GaragePlan a = plan_garage({}, 4), b = plan_garage(other, 4);
  ASSERT_EQ(a.rooms.size(), b.rooms.size());
  for (std::size_t i = 0; i < a.rooms.size(); ++i) EXPECT_EQ(a.rooms[i].door, b.rooms[i].door);
  ASSERT_EQ(a.services.size(), b.services.size());
  for (std::size_t i = 0; i < a.services.size(); ++i) EXPECT_EQ(a.services[i].y, b.services[i].y);
}

TEST(GarageRecipe, RefusesWhatCannotBeBuilt) {
  const auto read = [](const std::string& text) {
    GarageRecipe recipe;
    read_config(parse_yaml(text, "garage.yaml"), recipe);
    return recipe;
  };
  EXPECT_NO_THROW(read("length_m: 100"));
  EXPECT_EQ(read("rooms: 2").rooms, 2);
  for (const char* bad : {"door_width_m: 1.0", "floor_z_m: -6.0", "ramp_angle_deg: 5",
                          "ramp_width_m: 8", "occupancy_fraction: 1.5", "length_m: 20",
                          "reflectivity: {car_darkest: 0.9}", "pillar_pitch_m: 8"}) {
    EXPECT_THROW(read(bad), ConfigError) << bad;
  }
}

}  // namespace
}  // namespace arex::worlds
