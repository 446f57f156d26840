#include "sensors/infrared_light.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "../sensors_depth/depth_scenes.h"
#include "sensors/infrared_lamps.h"
#include "sensors/infrared_materials.h"
#include "worlds/garage.h"

namespace arex::sim {
namespace {

using worlds::SurfaceClass;

double up_facing(const LightGrid& grid, const Vec3& p) {
  return static_cast<double>(
      LightGrid::sum(grid.at(p.cast<float>()), LightGrid::weights(Vec3f::UnitZ())));
}

worlds::World floor_world(double half_m) {
  worlds::MeshBuilder builder;
  const auto floor = builder.add_object(SurfaceClass::kFloor, 0.4);
  builder.add_box(floor, {Mat3::Identity(), Vec3(0, 0, -0.2)}, {half_m, half_m, 0.2});
  return builder.finish();
}

// Rays towards the sun by Embree say what is in shadow; the map may err beside shadows' borders.
TEST(SunMap, AgreesWithRaysTowardsTheSun) {
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    const worlds::World world = small_forest(seed);
    const Scene scene(world);
    InfraredLightConfig light;
    light.sun_elevation_rad = seed == 1 ? 0.7 : 1.2;
    const SunMap sun(light, world);
    const Vec3 direction = sun_direction(light);
    RandomStream random(seed, "places");
    int lit = 0, shaded = 0, wrong = 0;
    for (int i = 0; i < 6000; ++i) {
      const Vec3 from = flying_pose(world, random).p;
      const Vec3 down = Vec3(random.normal(), random.normal(), -1).normalized();
      const Hit hit = scene.cast(from, down, 20);
      if (!hit.valid() || hit.normal_W.dot(direction) < 0.4) continue;
      const Vec3 p = from + hit.distance_m * down;
      // As the map does, a little nearer to the sun; only where all around is as the middle.
      const Vec3 x = direction.unitOrthogonal(), y = direction.cross(x);
      const double texel = sun.texel_m();
      int reached = 0;
      for (const double a : {-2.0, 0.0, 2.0}) {
        for (const double b : {-2.0, 0.0, 2.0}) {
          const Vec3 start = p + texel * (2.5 * direction + a * x + b * y);
          reached += !scene.cast(start, direction, 100).valid();
        }
      }
      if (reached > 0 && reached < 9) continue;
      const float visible = sun.visible(p.cast<float>());
      (reached > 0 ? lit : shaded) += 1;
      wrong += (reached > 0) != (visible > 0.5F);
    }
    EXPECT_GT(lit, 300) << seed;
    EXPECT_GT(shaded, 300) << seed;
    EXPECT_LT(wrong, (lit + shaded) / 25) << seed;
  }
}

TEST(SunMap, AWallCastsAShadowAsLongAsTheSunIsLow) {
  worlds::MeshBuilder builder;
  const auto floor = builder.add_object(SurfaceClass::kFloor, 0.4);
  builder.add_box(floor, {Mat3::Identity(), Vec3(0, 0, -0.2)}, {15, 15, 0.2});
  const auto wall = builder.add_object(SurfaceClass::kWall, 0.4);
  builder.add_box(wall, {Mat3::Identity(), Vec3(0, 0, 1)}, {0.1, 8, 1});
  const worlds::World world = builder.finish();
  for (const double elevation : {0.4, 0.7, 1.1}) {
    InfraredLightConfig light;
    light.sun_azimuth_rad = 0;  // the sun stands over +x: shadows fall towards -x
    light.sun_elevation_rad = elevation;
    const SunMap sun(light, world);
    double length = 0;
    while (sun.visible(Vec3f(static_cast<float>(-0.1 - length), 0, 0)) < 0.5F) length += 0.005;
    EXPECT_NEAR(length, 2 / std::tan(elevation), 0.15) << elevation;
    EXPECT_GT(sun.visible(Vec3f(3, 0, 0)), 0.99F);
  }
}

TEST(LightGrid, OpenGroundGetsTheWholeSky) {
  const worlds::World world = floor_world(20);
  const Scene scene(world);
  InfraredLightConfig light;
  light.sun = false;
  const LightGrid grid(light, world, scene, SunMap(light, world), {});
  EXPECT_NEAR(up_facing(grid, {1, 2, 0.4}) / light.sky_lx, 1, 0.05);
  // A wall sees half of the sky, and the ground's light below.
  const auto side = static_cast<double>(
      LightGrid::sum(grid.at(Vec3f(1, 2, 0.4F)), LightGrid::weights(Vec3f::UnitX())));
  EXPECT_NEAR(side / light.sky_lx, 0.5 + 0.5 * 0.4, 0.1);
}

// Straight below a lamp I / h^2, beside it less by the cosines: the point source's closed form.
TEST(LightGrid, ALampLightsTheFloorAsAPointSourceDoes) {
  const worlds::World world = floor_world(12);
  const Scene scene(world);
  InfraredLightConfig light;
  light.sun = false;
  light.sky_lx = 0;
  const double height = 3;
  const std::vector<Lamp> lamps{{Vec3(0, 0, height), Hit::kNone, 0}};
  const LightGrid grid(light, world, scene, SunMap(light, world), lamps);
  // Straight down I, at the level a quarter of it, upwards a twentieth: all of it is the flux.
  const double up = 0.05, level = 0.25;
  const double intensity = light.lamp_flux_lm / (std::numbers::pi * (2 * up + 1 + level));
  for (const double x : {0.0, 1.0, 2.0, 4.0}) {
    const double h = height - 0.4, d = std::hypot(x, h), cosine = h / d;
    const double expected = intensity * (level + (1 - level) * cosine) * cosine / (d * d);
    EXPECT_NEAR(up_facing(grid, {x, 0, 0.4}) / expected, 1, 0.25) << x;
  }
}

TEST(LightGrid, AClosedRoomWithoutLampsIsDark) {
  worlds::MeshBuilder builder;
  const auto wall = builder.add_object(SurfaceClass::kWall, 0.4);
  for (const double side : {-1.0, 1.0}) {
    builder.add_box(wall, {Mat3::Identity(), Vec3(side * 5.2, 0, 1.5)}, {0.2, 5.4, 1.9});
    builder.add_box(wall, {Mat3::Identity(), Vec3(0, side * 5.2, 1.5)}, {5.4, 0.2, 1.9});
    builder.add_box(wall, {Mat3::Identity(), Vec3(0, 0, 1.5 + side * 1.7)}, {5.4, 5.4, 0.2});
  }
  const worlds::World world = builder.finish();
  const Scene scene(world);
  const InfraredLightConfig light;
  const LightGrid grid(light, world, scene, SunMap(light, world), {});
  EXPECT_LT(up_facing(grid, {0, 0, 1.5}), 1);
}

TEST(Lamps, AreThoseThatTheGarageHangsUpAndOnesInTheDarkBetween) {
  const worlds::World world = worlds::build(worlds::GarageRecipe{}, 1);
  const Scene scene(world);
  const std::vector<Lamp> lamps = find_lamps(world, scene);
  const auto drawn = std::count_if(lamps.begin(), lamps.end(),
                                   [](const Lamp& lamp) { return lamp.object != Hit::kNone; });
  EXPECT_GT(drawn, 30);
  EXPECT_GT(std::ssize(lamps), drawn);
  const worlds::GarageRecipe recipe;
  for (const Lamp& lamp : lamps) {
    if (lamp.object != Hit::kNone) {  // the others light the ramp's tunnel and the kiosk as well
      EXPECT_LT(lamp.centre_W.z(), recipe.ceiling_z_m);
      EXPECT_GT(lamp.centre_W.z(), recipe.ceiling_z_m - 1);
    }
    // Nothing but air between it and what drives there.
    const Hit below = scene.cast(lamp.centre_W - Vec3(0, 0, 0.01), -Vec3::UnitZ(), 10);
    EXPECT_GT(below.distance_m, 0.5);
  }
  EXPECT_TRUE(find_lamps(small_forest(1), Scene(small_forest(1))).empty());
}

// DIN 67528: 15 lx at least in a large car park, 75 lx on its lanes (EN 12464-1). Under and between
// parked cars it may be darker.
TEST(Lamps, LeaveNoPartOfAGarageDark) {
  worlds::GarageRecipe recipe;
  recipe.length_m = 50;
  recipe.width_m = 30;  // lanes, and with them drawn lamps, along its middle alone
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    const worlds::World world = worlds::build(recipe, seed);
    const Scene scene(world);
    const InfraredLightConfig light;
    const LightGrid grid(light, world, scene, SunMap(light, world), find_lamps(world, scene));
    std::vector<double> lux;
    for (double y = -14; y <= 14; y += 1) {
      for (double x = 16; x <= 49; x += 1) {
        const Vec3 p(x, y, recipe.floor_z_m + 0.4);
        if (!scene.cast(p, Vec3::UnitZ(), 1.5).valid()) lux.push_back(up_facing(grid, p));
      }
    }
    std::sort(lux.begin(), lux.end());
    ASSERT_GT(lux.size(), 500U);
    EXPECT_GT(lux[lux.size() / 10], 5) << seed;
    EXPECT_GT(lux[lux.size() / 2], 15) << seed;
    EXPECT_LT(lux[lux.size() / 2], 75) << seed;
  }
}

TEST(Texture, IsOneOnAverageAndFadesWhereThePixelsAreCoarse) {
  const Material material = noise_material({2, 0.5F, 0.12F, 0.03F}, {0.2F, 0.2F, 0.2F, 0.2F});
  RandomStream random(1, "texture");
  std::vector<double> deviation;
  for (const double footprint : {0.0005, 0.02, 0.1, 0.6, 2.0}) {
    double sum = 0, squares = 0;
    constexpr int kDraws = 40'000;
    for (int i = 0; i < kDraws; ++i) {
      const auto value = static_cast<double>(
          texture_at(material, 77, static_cast<float>(random.uniform(-500, 500)),
                     static_cast<float>(random.uniform(-500, 500)), static_cast<float>(footprint)));
      sum += value;
      squares += value * value;
    }
    const double mean = sum / kDraws;
    EXPECT_NEAR(mean, 1, 0.01) << footprint;
    deviation.push_back(std::sqrt(std::max(0.0, squares / kDraws - mean * mean)));
  }
  EXPECT_GT(deviation.front(), 0.1);
  EXPECT_EQ(deviation.back(), 0);
  for (std::size_t i = 1; i < deviation.size(); ++i) EXPECT_LT(deviation[i], deviation[i - 1]);
}

TEST(Texture, IsContinuousAndItsOwnOnEachObject) {
  const Material material = noise_material({2, 0.5F, 0.12F, 0.03F}, {0.2F, 0.2F, 0.2F, 0.2F});
  double largest = 0, difference = 0;
  for (int i = 0; i < 5000; ++i) {
    const float a = -5 + 0.002F * static_cast<float>(i);
    const float here = texture_at(material, 1, a, 3, 0.001F);
    largest = std::max(
        largest,
        std::abs(static_cast<double>(here - texture_at(material, 1, a + 1e-4F, 3, 0.001F))));
    difference += std::abs(static_cast<double>(here - texture_at(material, 2, a, 3, 0.001F)));
  }
  EXPECT_LT(largest, 0.01);
  EXPECT_GT(difference / 5000, 0.05);
}

TEST(Texture, IsTheSameForEightPlacesAtOnce) {
  const Material material = noise_material({2, 0.5F, 0.12F, 0.03F}, {0.2F, 0.2F, 0.2F, 0.2F}, 0.4F);
  RandomStream random(9, "places");
  for (int n = 0; n < 500; ++n) {
    Float8 a, b, footprint;
    for (int i = 0; i < 8; ++i) {
      a[i] = static_cast<float>(random.uniform(-50, 50));
      b[i] = static_cast<float>(random.uniform(-50, 50));
      footprint[i] = static_cast<float>(random.uniform(0.001, 0.5));
    }
    const Float8 together = texture_at(material, 5, a, b, footprint);
    for (int i = 0; i < 8; ++i) {
      EXPECT_NEAR(together[i], texture_at(material, 5, a[i], b[i], footprint[i]), 1e-5);
    }
  }
}

}  // namespace
}  // namespace arex::sim
