#include "scoring/world_complexity.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "math/random.h"
#include "worlds/mesh_builder.h"

namespace arex::sim {
namespace {

using worlds::MeshBuilder;
using worlds::SurfaceClass;
using worlds::World;

constexpr double kVehicleRadius = 0.3;
constexpr double kCell = 0.1;

// The middles of all cells of a rectangle but those near one of the discs.
std::vector<Vec3f> cells(const Vec2& low, const Vec2& high, const std::vector<Vec2>& discs,
                         double near_m) {
  std::vector<Vec3f> area;
  for (double y = low.y() + 0.5 * kCell; y < high.y(); y += kCell) {
    for (double x = low.x() + 0.5 * kCell; x < high.x(); x += kCell) {
      const bool taken = std::ranges::any_of(
          discs, [&](const Vec2& d) { return (d - Vec2(x, y)).norm() < near_m; });
      if (!taken) area.push_back(Vec3(x, y, 1.2).cast<float>());
    }
  }
  return area;
}

const Pose kOrigin;

// In a rectangle: the mean distance to its walls over all places and directions, by closed form
// along each line.
TEST(WorldComplexity, ARoomsMeanFreePathIsTheMeanDistanceToItsWalls) {
  const Vec2 size(6, 4);
  MeshBuilder builder;
  const auto wall = builder.add_object(SurfaceClass::kWall, 0.3);
  const Vec3 half(0.5 * size.x(), 0.5 * size.y(), 1.5);
  builder.add_box(wall, {Mat3::Identity(), half}, half);
  const World world = builder.finish();
  const Scene scene(world);
  const ScoredRegion region{{{0, 0}, size, {}}, 0, 3, Vec3::Zero()};
  WorldComplexityConfig config;
  config.spacing_m = 0.2;
  config.directions = 64;
  const auto area = cells({0, 0}, size, {}, 0);
  const WorldComplexity complexity =
      measure_complexity(config, world, scene, kOrigin, region, area, kCell, kVehicleRadius);
  double sum = 0;
  int count = 0;
  for (double x = 0.1; x < size.x(); x += 0.1) {
    for (double y = 0.1; y < size.y(); y += 0.1) {
      for (int i = 0; i < 90; ++i, ++count) {
        const double angle = 2 * std::numbers::pi * (i + 0.5) / 90;
        const double c = std::cos(angle), s = std::sin(angle);
        sum += std::min(c > 0 ? (size.x() - x) / c : -x / c, s > 0 ? (size.y() - y) / s : -y / s);
      }
    }
  }
  EXPECT_NEAR(complexity.mean_free_path_m, sum / count, 0.02 * sum / count);
  EXPECT_TRUE(std::isnan(complexity.stems_per_m2)) << "no trunks, no density of them";
  EXPECT_TRUE(std::isnan(complexity.traversability)) << "the area ends where the region does";
}

struct Grove {
  std::vector<Vec2> stems;
  World world;
};

// Stems of one diameter at random in the square +-30 m; leaves everywhere.
Grove grove(std::uint64_t seed, double density, double diameter) {
  constexpr double kHalf = 30;
  MeshBuilder builder;
  RandomStream random(seed, "grove");
  Grove grove;
  const int count = static_cast<int>(std::lround(density * 4 * kHalf * kHalf));
  for (int i = 0; i < count; ++i) {
    const auto trunk = builder.add_object(SurfaceClass::kTrunk, 0.3);
    const Vec2 p(random.uniform(-kHalf, kHalf), random.uniform(-kHalf, kHalf));
    grove.stems.push_back(p);
    builder.add_cylinder(trunk, {Mat3::Identity(), {p.x(), p.y(), 2}}, 0.5 * diameter, 2, 24);
  }
  const auto leaf = builder.add_object(SurfaceClass::kLeaf, 0.3);
  for (double x = -kHalf; x < kHalf; x += 2) {
    builder.add_quad(leaf, {x, -kHalf, 0}, {x, kHalf, 0}, {x, kHalf, 3}, {x, -kHalf, 3});
  }
  grove.world = builder.finish();
  return grove;
}

// Of random discs a line meets one in 1 / (density * diameter) on average.
TEST(WorldComplexity, AGrovesMeanFreePathIsOneOverDensityTimesDiameter) {
  const ScoredRegion region{{{-10, -10}, {10, 10}, {}}, 0, 3, Vec3::Zero()};
  double paths = 0, flights = 0;
  constexpr int kSeeds = 4;
  constexpr double kDensity = 0.15, kDiameter = 0.5, kClear = 0.5 * kDiameter + kVehicleRadius;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const Grove made = grove(seed, kDensity, kDiameter);
    const Scene scene(made.world);
    const auto area = cells({-10, -10}, {10, 10}, made.stems, kClear);
    const WorldComplexity complexity =
        measure_complexity({}, made.world, scene, kOrigin, region, area, kCell, kVehicleRadius);
    const auto inside = std::ranges::count_if(
        made.stems, [](const Vec2& p) { return p.cwiseAbs().maxCoeff() < 10; });
    EXPECT_NEAR(complexity.stems_per_m2, static_cast<double>(inside) / 400, 1e-9);
    paths += complexity.mean_free_path_m / kSeeds;
    flights += complexity.traversability / kSeeds;
  }
  const double sight = 1 / (kDensity * kDiameter), flight = 1 / (kDensity * 2 * kClear);
  EXPECT_NEAR(paths, sight, 0.15 * sight);
  EXPECT_NEAR(flights, flight / kVehicleRadius, 0.15 * flight / kVehicleRadius);
}

TEST(WorldComplexity, WhatWasNotMeasuredIsNull) {
  Figures figures;
  add_figures(WorldComplexity(), figures);
  EXPECT_TRUE(figures.json()["world"].is_null());
  Figures some;
  add_figures(WorldComplexity{0.1, 12, 40}, some);
  EXPECT_EQ(some.json()["world"]["stems_per_m2"], 0.1);
  EXPECT_EQ(some.json()["world"]["mean_free_path_m"], 12);
}

}  // namespace
}  // namespace arex::sim
