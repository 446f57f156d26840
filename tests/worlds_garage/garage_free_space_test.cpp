// Where a vehicle can fly.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "math/random.h"
#include "worlds/garage.h"
#include "worlds/garage_plan.h"
#include "worlds/occupancy.h"
#include "worlds_garage/world_probe.h"

namespace arex::worlds {
namespace {

constexpr double kRadius = 0.3;      // of the vehicle, m
constexpr double kResolution = 0.2;  // m
const Vec3 kHover(0, 0, 1.0);        // above the start pad

/// The space below ground and a little above the start: the open sky adds nothing.
FreeSpace free_space_of(const World& world) {
  Bounds bounds = world.bounds;
  bounds.low.x() = -2;
  bounds.high.z() = 2;
  return flood_free_space(voxelize(world, make_grid(bounds, kResolution), ClassSet::all()), kHover,
                          kRadius);
}

bool in_shut_room(const GaragePlan& plan, const Vec3& p) {
  for (const GarageRoom& room : plan.rooms) {
    if (!room.open && p.x() > room.x.low && p.x() < room.x.high && p.y() > room.y.low &&
        p.y() < room.y.high) {
      return true;
    }
  }
  return false;
}

/// Pillars are drawn hollow, and a wide one has room for a vehicle.
bool in_pillar(const GarageRecipe& recipe, const GaragePlan& plan, const Vec3& p) {
  const auto near = [&](double at, const std::vector<double>& lines) {
    return std::any_of(lines.begin(), lines.end(), [&](double line) {
      return std::abs(at - line) < 0.5 * recipe.pillar_width_m;
    });
  };
  return near(p.x(), plan.column_x) && near(p.y(), plan.row_y);
}

/// Just past a room's doorway.
Vec3 inside(const GarageRecipe& recipe, const GarageRoom& room) {
  const Vec2 p = room.door - 0.7 * room.outward;
  return {p.x(), p.y(), recipe.floor_z_m + 1.4};
}

/// Everything of the hall that a vehicle fits into is reached, but for the shut rooms.
void expect_connected(const GarageRecipe& recipe, std::uint64_t seed) {
  SCOPED_TRACE("seed " + std::to_string(seed));
  const World world = build(recipe, seed);
  const GaragePlan plan = plan_garage(recipe, seed);
  const FreeSpace space = free_space_of(world);
  ASSERT_TRUE(space.at(world.X_WS * kHover)) << "the start is not free";

  // Above the cars' roofs (they are hollow) and below the beams.
  const double z = recipe.floor_z_m + 2.45;
  int passable = 0, missed = 0;
  Vec3 example = Vec3::Zero();
  for (double x = plan.hall_x.low + 0.5; x < plan.hall_x.high; x += kResolution) {
    for (double y = plan.hall_y.low + 0.5; y < plan.hall_y.high; y += kResolution) {
      const Vec3 p(x, y, z);
      const bool in_shaft = x < plan.foot_x + 0.5 && y > plan.shaft_y.low && y < plan.shaft_y.high;
      if (in_shaft || in_shut_room(plan, p) || in_pillar(recipe, plan, p)) continue;
      const bool fits = space.passable[space.grid.index(space.grid.cell_of(p))] != 0;
      passable += fits;
      if (fits && !space.at(p)) {
        ++missed;
        example = p;
      }
    }
  }
  const double area = passable * kResolution * kResolution;
  EXPECT_GT(area, 0.5 * recipe.length_m * recipe.width_m);
  EXPECT_EQ(missed, 0) << "for one, " << example.transpose();

  // Along every aisle at eye height, and in every room that stands open.
  for (const double y : plan.aisle_y) {
    const double start = y == 0 ? plan.foot_x + 1 : plan.hall_x.low + 1;
    for (double x = start; x < plan.hall_x.high - 1; x += 2) {
      if (in_pillar(recipe, plan, {x, y, 0})) continue;
      EXPECT_TRUE(space.at({x, y, recipe.floor_z_m + 1.4})) << "aisle at " << x << ", " << y;
    }
  }
  for (const GarageRoom& room : plan.rooms) {
    EXPECT_EQ(space.at(inside(recipe, room)), room.open) << inside(recipe, room).transpose();
  }
}

TEST(GarageFreeSpace, ReachesTheWholeFloorFromTheStart) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) expect_connected({}, seed);
}

TEST(GarageFreeSpace, ReachesTheWholeFloorInOtherRecipes) {
  GarageRecipe small;
  small.length_m = 60;
  small.width_m = 32;
  small.rooms = 3;
  expect_connected(small, 1);
  GarageRecipe tall;
  tall.length_m = 70;
  tall.width_m = 56;
  tall.floor_z_m = -9.5;
  tall.ramp_angle_deg = 35;
  tall.pillar_spacing_m = 9.5;
  tall.pillar_width_m = 0.8;
  tall.occupancy_fraction = 1;
  tall.rooms = 30;
  expect_connected(tall, 2);
}

/// Does a recipe pass its own checks? (config fields visitor)
struct Checker {
  bool valid = true;
  void operator()(std::string_view, auto&, std::string_view) {}
  void check(bool holds, std::string_view) { valid = valid && holds; }
};

GarageRecipe random_recipe(RandomStream random) {
  for (;;) {
    GarageRecipe recipe;
    recipe.length_m = random.uniform(50, 90);
    recipe.width_m = random.uniform(32, 60);
    recipe.ceiling_z_m = random.uniform(-7, -3);
    recipe.floor_z_m = recipe.ceiling_z_m - random.uniform(3.2, 5);
    recipe.ramp_angle_deg = random.uniform(15, 40);
    recipe.ramp_width_m = random.uniform(4, 7);
    recipe.occupancy_fraction = random.uniform();
    recipe.rooms = random.uniform_int(0, 12);
    recipe.door_width_m = random.uniform(1.4, 2.5);
    recipe.service_runs = random.uniform_int(0, 20);
    Checker checker;
    recipe.fields(checker);
    if (checker.valid) return recipe;
  }
}

TEST(GarageFreeSpace, ReachesTheWholeFloorInRecipesDrawnAtRandom) {
  for (std::uint64_t i = 1; i <= 6; ++i) {
    expect_connected(random_recipe(RandomStream(i, "recipe")), i);
  }
}

TEST(GarageFreeSpace, StartIsLevelClearAndFacesTheRamp) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const World world = build({}, seed);
    EXPECT_TRUE(world.X_WS.R.isIdentity());
    const auto ground = probe::cast(world, world.X_WS * Vec3(0.1, 0.1, 0.5), {0, 0, -1});
    ASSERT_TRUE(ground);
    EXPECT_NEAR(ground->distance, 0.5, 1e-5);
    EXPECT_EQ(ground->surface_class, SurfaceClass::kGround);
    // A cylinder of 1.5 m about the pad stays clear for the climb.
    for (const CollisionShape& shape : world.collision_shapes) {
      if (world.objects[shape.object].surface_class == SurfaceClass::kGround) continue;
      for (double z = 0.1; z < 3; z += 0.3) {
        ASSERT_GT(probe::distance_to_shape(shape, world.X_WS * Vec3(0, 0, z)), 1.5);
      }
    }
  }
}

TEST(GarageFreeSpace, DoorwaysHaveTheRecipesWidthAndHeight) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const GarageRecipe recipe;
    const World world = build(recipe, seed);
    for (const GarageRoom& room : plan_garage(recipe, seed).rooms) {
      const Vec3 out(room.outward.x(), room.outward.y(), 0);
      const Vec3 door(room.door.x(), room.door.y(), recipe.floor_z_m + 1.0);
      if (!room.open) {
        const auto shut = probe::cast(world, door + 0.6 * out, -out);
        ASSERT_TRUE(shut);
        EXPECT_EQ(shut->surface_class, SurfaceClass::kDoor);
        EXPECT_LT(shut->distance, 0.61);
        continue;
      }
      const auto left = probe::cast(world, door, Vec3(-1, 0, 0));
      const auto right = probe::cast(world, door, Vec3(1, 0, 0));
      const auto up = probe::cast(world, door, Vec3(0, 0, 1));
      ASSERT_TRUE(left && right && up);
      EXPECT_NEAR(left->distance + right->distance, recipe.door_width_m, 1e-4);
      EXPECT_NEAR(up->distance, recipe.door_height_m - 1.0, 1e-4);
      for (const double aside : {-0.5, 0.0, 0.5}) {
        const auto through = probe::cast(world, door + Vec3(aside, 0, 0) + 0.6 * out, -out);
        ASSERT_TRUE(through);
        EXPECT_GT(through->distance, 1.5) << "something stands in the doorway";
      }
    }
  }
}

}  // namespace
}  // namespace arex::worlds
