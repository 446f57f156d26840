#include "scoring/coverage.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "math/random.h"
#include "scoring/map_error.h"
#include "worlds/mesh_builder.h"

namespace arex::sim {
namespace {

using worlds::MeshBuilder;
using worlds::SurfaceClass;
using worlds::World;

// A closed room [0, 6] x [0, 4] x [0, 3] m with walls of no thickness, and behind the wall x = 6 a
// shut one up to x = 9. The start is in the middle of the first.
World two_rooms() {
  MeshBuilder builder;
  const auto floor = builder.add_object(SurfaceClass::kFloor, 0.3);
  const auto ceiling = builder.add_object(SurfaceClass::kCeiling, 0.3);
  const auto wall = builder.add_object(SurfaceClass::kWall, 0.3);
  builder.add_quad(floor, {0, 0, 0}, {9, 0, 0}, {9, 4, 0}, {0, 4, 0});
  builder.add_quad(ceiling, {0, 0, 3}, {9, 0, 3}, {9, 4, 3}, {0, 4, 3});
  for (const double y : {0.0, 4.0}) {
    builder.add_quad(wall, {0, y, 0}, {9, y, 0}, {9, y, 3}, {0, y, 3});
  }
  for (const double x : {0.0, 6.0, 9.0}) {
    builder.add_quad(wall, {x, 0, 0}, {x, 4, 0}, {x, 4, 3}, {x, 0, 3});
  }
  World world = builder.finish();
  world.bounds = {{-1, -1, -1}, {10, 5, 4}};
  return world;
}

const Pose kStart{Mat3::Identity(), {3.05, 2.05, 1.05}};
constexpr double kRadius = 0.35;
const ScoredRegion kEverywhere{{{-20, -20}, {20, 20}, {}}, -20, 20, Vec3::Zero()};

// A map of [x0, x1] x [-10, 10] in O, all free.
OccupancyMap2D free_map(double x0, double x1) {
  OccupancyMap2D map;
  map.origin = {x0, -10};
  map.width = static_cast<int>(std::lround((x1 - x0) / map.resolution));
  map.height = 200;
  map.cells.assign(static_cast<std::size_t>(map.width * map.height), OccupancyMap2D::kFree);
  return map;
}

CoverageScorer room_scorer(const World& world, const Scene& scene, const Pose& X_WO = kStart,
                           const ScoredRegion& region = kEverywhere) {
  CoverageConfig config;
  config.band_above_terrain = false;
  config.band_low_m = -1.0;
  config.band_high_m = 1.0;
  return {config, world, scene, X_WO, region, kRadius};
}

TEST(CoverageScorer, CountsTheReachableAreaOfTheOpenRoomOnly) {
  const World world = two_rooms();
  const Scene scene(world);
  const CoverageScorer scorer = room_scorer(world, scene);
  // Walls occupy a cell on either side; centres stay more than the radius, 3.5 cells, from those:
  // 4 cells from the occupied one beside the wall, so that 4 cells are lost at each side.
  EXPECT_NEAR(scorer.result().area_m2, 5.2 * 3.2, 1e-9);
  EXPECT_NEAR(scorer.result().reachable_volume_m3, 5.2 * 3.2 * 2.2, 1e-9);
  for (const SurfaceSample& sample : scorer.samples()) EXPECT_LE(sample.p_W.x(), 6.001 + 1e-5);
  // Floor, ceiling and the four walls.
  const double surface = 2 * 6 * 4 + 2 * (6 + 4) * 3;
  EXPECT_NEAR(0.02 * static_cast<double>(scorer.result().surface_samples), surface, 0.02 * surface);
}

TEST(CoverageScorer, NothingMappedIsZeroAndEverythingIsOne) {
  const World world = two_rooms();
  const Scene scene(world);
  CoverageScorer scorer = room_scorer(world, scene);
  EXPECT_TRUE(std::isnan(scorer.result().area_fraction)) << "never scored";
  EXPECT_TRUE(std::isnan(scorer.result().surface_fraction));
  EXPECT_TRUE(std::isnan(scorer.result().volume_m3));
  scorer.update(0, 0, OccupancyMap2D{}, 0, {}, kStart);
  EXPECT_EQ(scorer.latest().area_fraction, 0);
  EXPECT_EQ(scorer.latest().surface_fraction, 0);
  std::vector<Vec3f> cloud_O;
  for (const SurfaceSample& sample : scorer.samples()) {
    cloud_O.push_back((kStart.inverse() * sample.p_W.cast<double>()).cast<float>());
  }
  scorer.update(kNanosecondsPerSecond, 2, free_map(-10, 10), 7, cloud_O, kStart);
  const CoverageResult result = scorer.result();
  EXPECT_EQ(result.area_fraction, 1);
  EXPECT_EQ(result.surface_fraction, 1);
  EXPECT_EQ(result.volume_m3, 7);
  EXPECT_EQ(result.t95_s, 1.0);
  // 5.2 m x 3.2 m and 7 m3 for two metres of path, in one second.
  Figures figures;
  add_figures(result, figures);
  const auto coverage = figures.json()["coverage"];
  EXPECT_NEAR(coverage["area_m2_per_m"].get<double>(), 5.2 * 3.2 / 2, 1e-6);
  EXPECT_NEAR(coverage["area_m2_per_s"].get<double>(), 5.2 * 3.2, 1e-6);
  EXPECT_NEAR(coverage["volume_m3_per_m"].get<double>(), 7.0 / 2, 1e-6);
  EXPECT_NEAR(coverage["volume_m3_per_s"].get<double>(), 7.0, 1e-6);
  Figures unflown;
  add_figures(CoverageResult(), unflown);
  for (const char* rate :
       {"area_m2_per_m", "area_m2_per_s", "volume_m3_per_m", "volume_m3_per_s"}) {
    EXPECT_TRUE(unflown.json()["coverage"][rate].is_null()) << rate;
  }
  EXPECT_EQ(write_coverage_csv(result.rows),
            "time_s,distance_m,area_fraction,surface_fraction,volume_m3\n"
            "0.000,0.000,0.00000,0.00000,0.000\n1.000,2.000,1.00000,1.00000,7.000\n");
}

// A map of several storeys shows one in each column: what it knows of another counts for nothing.
TEST(CoverageScorer, KnowsNothingOfAStoreyWhoseRoofTheMapShows) {
  const World world = two_rooms();
  const Scene scene(world);
  CoverageScorer scorer = room_scorer(world, scene);
  OccupancyMap2D map = free_map(-10, 10);
  map.ground.origin = {-10, -10};
  map.ground.tile_m = 1;
  map.ground.width = 20;
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 20; ++x) map.ground.heights.push_back(x < 10 ? -1.0F : 7.5F);
  }
  map.ground.rises.assign(400, Eigen::Vector2f::Zero());
  scorer.update(0, 0, map, 0, {}, kStart);
  // Of 5.2 m, from W x = 0.4 on, the map ends at O's x = 0, W x = 3.05.
  EXPECT_NEAR(scorer.latest().area_fraction, (3.05 - 0.4) / 5.2, 0.02);
  map.ground.rises.clear();  // of one storey
  scorer.update(1, 0, map, 0, {}, kStart);
  EXPECT_EQ(scorer.latest().area_fraction, 1);
}

// In O turned by a quarter and moved, the map ends at the room's middle, W x = 3.
TEST(CoverageScorer, HalfARoomIsAHalfInAnyFrame) {
  const World world = two_rooms();
  const Scene scene(world);
  for (const double yaw : {0.0, 0.5 * std::numbers::pi, std::numbers::pi}) {
    const Pose X_WO{so3::from_yaw(yaw), {3, 2, 1.05}};
    CoverageScorer scorer = room_scorer(world, scene, X_WO);
    scorer.update(0, 0, free_map(0, 10), 0, {}, X_WO);
    EXPECT_NEAR(scorer.latest().area_fraction, 0.5, 1e-9) << yaw;
    EXPECT_TRUE(std::isnan(scorer.result().t90_s));
  }
}

TEST(CoverageScorer, ScoresInsideTheExplorationBoundsOnly) {
  const World world = two_rooms();
  const Scene scene(world);
  ScoredRegion region = kEverywhere;
  region.bounds.high_m.x() = 0;  // W x = 2.98: the cell whose middle is 2.95 is the last
  const CoverageScorer scorer =
      room_scorer(world, scene, {Mat3::Identity(), {2.98, 2.05, 1.05}}, region);
  EXPECT_NEAR(scorer.result().area_m2, 2.6 * 3.2, 1e-9);
}

// The polygon is what is explored, not the box around it: a triangle, half as large as the room.
TEST(CoverageScorer, ScoresInsideTheExplorationPolygonOnly) {
  const World world = two_rooms();
  const Scene scene(world);
  const CoverageScorer whole = room_scorer(world, scene);
  ScoredRegion region = kEverywhere;
  region.bounds.polygon_m = {{-3.02, -2.03}, {2.93, -2.03}, {0.97, 1.96}};
  const CoverageScorer scorer = room_scorer(world, scene, kStart, region);
  std::size_t inside = 0;
  for (const Vec3f& cell : whole.area_cells_W()) {
    inside += region.bounds.contains((cell.cast<double>() - kStart.p).head<2>());
  }
  EXPECT_EQ(scorer.area_cells_W().size(), inside);
  EXPECT_LT(scorer.result().area_m2, 0.7 * whole.result().area_m2);
  EXPECT_GT(scorer.result().area_m2, 0.3 * whole.result().area_m2);
  for (const SurfaceSample& sample : scorer.samples()) {
    const Vec3 p_O = sample.p_W.cast<double>() - kStart.p;
    EXPECT_TRUE(region.bounds.is_near(p_O.head<2>(), 0.5));
  }
}

// Exploring begins where the entry legs end: behind the wall there is another room.
TEST(CoverageScorer, CountsWhatIsReachedFromWhereExploringBegins) {
  const World world = two_rooms();
  const Scene scene(world);
  ScoredRegion region = kEverywhere;
  region.start_O = {4.5, 0, 0};  // x = 7.55 in W
  EXPECT_NEAR(room_scorer(world, scene, kStart, region).result().area_m2, 2.2 * 3.2, 1e-9);
}

TEST(CoverageScorer, AStartWithoutRoomIsRefused) {
  const World world = two_rooms();
  const Scene scene(world);
  EXPECT_THROW(room_scorer(world, scene, {Mat3::Identity(), {3, 0.1, 1}}), std::invalid_argument);
}

TEST(CoverageScorer, WorksOutTheSameTruthEveryTime) {
  const World world = two_rooms();
  const Scene scene(world);
  const Scene again(world);
  const CoverageScorer a = room_scorer(world, scene);
  const CoverageScorer b = room_scorer(world, again);
  ASSERT_EQ(a.samples().size(), b.samples().size());
  for (std::size_t i = 0; i < a.samples().size(); ++i) {
    EXPECT_EQ(a.samples()[i].p_W, b.samples()[i].p_W);
  }
  EXPECT_EQ(a.area_cells_W(), b.area_cells_W());
}

// Samples near a mapped point, by brute force.
TEST(CoverageScorer, MarksExactlyTheSamplesWithinReach) {
  const World world = two_rooms();
  const Scene scene(world);
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    CoverageScorer scorer = room_scorer(world, scene);
    RandomStream random(seed, "cloud");
    std::vector<Vec3f> cloud;
    for (int i = 0; i < 400; ++i) {
      cloud.push_back(Vec3(random.uniform(-1, 7), random.uniform(-1, 5), random.uniform(-0.1, 3.1))
                          .cast<float>());
    }
    const Pose identity;
    scorer.update(0, 0, OccupancyMap2D{}, 0, std::span(cloud).first(200), identity);
    scorer.update(1, 0, OccupancyMap2D{}, 0, std::span(cloud).subspan(200), identity);
    std::size_t mapped = 0;
    for (std::size_t i = 0; i < scorer.samples().size(); ++i) {
      float best = 1e9F;
      for (const Vec3f& p : cloud) {
        best = std::min(best, (p - scorer.samples()[i].p_W).squaredNorm());
      }
      const bool near = best <= static_cast<float>(0.15 * 0.15);
      EXPECT_EQ(scorer.is_mapped(i), near);
      mapped += near;
    }
    EXPECT_GT(mapped, 100U);
    EXPECT_EQ(scorer.latest().surface_fraction,
              static_cast<double>(mapped) / static_cast<double>(scorer.samples().size()));
  }
}

// A screen across the room, a box in it and foliage.
TEST(Visibility, AgreesWithTryingEveryViewpoint) {
  MeshBuilder builder;
  const auto floor = builder.add_object(SurfaceClass::kFloor, 0.3);
  const auto wall = builder.add_object(SurfaceClass::kWall, 0.3);
  const auto car = builder.add_object(SurfaceClass::kCar, 0.3);
  const auto leaf = builder.add_object(SurfaceClass::kLeaf, 0.3);
  builder.add_box(floor, {Mat3::Identity(), {0, 0, -0.1}}, {6, 6, 0.1});
  builder.add_box(wall, {Mat3::Identity(), {0, 1, 1}}, {0.1, 3, 1});
  builder.add_box(car, {Mat3::Identity(), {3, -2, 0.6}}, {1, 0.5, 0.4});
  builder.add_quad(leaf, {-4, -4, 1}, {-3, -4, 1}, {-3, -3, 1}, {-4, -3, 1});
  World world = builder.finish();
  world.bounds = {{-6, -6, -1}, {6, 6, 2}};
  const Scene scene(world);
  const Pose X_WO{Mat3::Identity(), {-2, 0, 1}};
  const ReachableSpace space = find_reachable_space(world, X_WO, kEverywhere, kRadius);
  const VisibilityConfig config;
  const Viewpoints viewpoints(space, config.viewpoint_spacing_m);
  const auto samples = sample_surfaces(world, world.bounds);
  const auto visible = find_visible(scene, viewpoints, samples, config);
  std::size_t found = 0, missed = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    EXPECT_NE(samples[i].surface_class, SurfaceClass::kLeaf);
    bool seen = false;
    for (const Vec3& v : viewpoints.all()) seen = seen || sees(scene, v, samples[i], config);
    EXPECT_LE(visible[i], seen);  // an answer of yes has a witness
    found += visible[i];
    missed += seen && !visible[i];
  }
  EXPECT_GT(found, 7000U);  // the floor's top alone: 144 m^2
  EXPECT_LT(missed, found / 100);
}

TEST(SurfaceSamples, AreEvenOverLargeAndSmallTriangles) {
  const World world = two_rooms();
  const auto samples = sample_surfaces(world, world.bounds);
  // Per square metre of floor, 50 samples each: a low-discrepancy set stays within a few.
  std::array<std::array<int, 4>, 9> count{};
  for (const SurfaceSample& s : samples) {
    if (s.surface_class != SurfaceClass::kFloor) continue;
    ++count[static_cast<std::size_t>(s.p_W.x())][static_cast<std::size_t>(s.p_W.y())];
  }
  for (const auto& row : count) {
    for (const int n : row) EXPECT_NEAR(n, 50, 10);
  }
}

TEST(MapScore, MeasuresNormalNoiseAndOutliersInClosedForm) {
  MeshBuilder builder;
  const auto floor = builder.add_object(SurfaceClass::kFloor, 0.3);
  const auto leaf = builder.add_object(SurfaceClass::kShrub, 0.3);
  builder.add_quad(floor, {-50, -50, 0}, {50, -50, 0}, {50, 50, 0}, {-50, 50, 0});
  builder.add_quad(leaf, {-1, -1, 2}, {1, -1, 2}, {1, 1, 2}, {-1, 1, 2});
  const World world = builder.finish();
  const Scene scene(world);
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    RandomStream random(seed, "noise");
    const Pose X_WO{so3::from_yaw(random.uniform(-3, 3)), random.normal3()};
    const Pose X_OW = X_WO.inverse();
    constexpr double kSigma = 0.02;
    std::vector<Vec3f> cloud;
    const auto add = [&](double x, double y, double z) {
      cloud.push_back((X_OW * Vec3(x, y, z)).cast<float>());
    };
    for (int i = 0; i < 20000; ++i) {
      const bool outlier = i % 100 == 0;
      add(random.uniform(-20, 20), random.uniform(-20, 20),
          outlier ? -1.0 : kSigma * random.normal());
    }
    for (int i = 0; i < 1000; ++i) add(0, 0, 2 + 0.1 * random.uniform());
    add(0, 0, 2.5);  // nearest to foliage, but not explained by it
    const MapScore score = score_map(cloud, X_WO, scene);
    EXPECT_EQ(score.points, 21001U);
    EXPECT_EQ(score.foliage, 1000U);
    EXPECT_EQ(score.scored, 20001U);
    EXPECT_NEAR(score.outlier_fraction, 201.0 / 20001, 1e-12);
    // Quantiles of |N(0, sigma)| among 99 % of the points; 4 standard errors.
    EXPECT_NEAR(score.median_m, 0.6842 * kSigma, 0.0006);
    EXPECT_NEAR(score.p95_m, 2.046 * kSigma, 0.0022);
    MapErrorConfig sparse;
    sparse.max_points = 5000;
    const MapScore sampled = score_map(cloud, X_WO, scene, sparse);
    EXPECT_EQ(sampled.scored + sampled.foliage, 5000U);
    EXPECT_NEAR(sampled.median_m, score.median_m, 0.0012);
  }
}

TEST(PathMeter, ThereAndBackIsHalfRevisitedLessTheTurn) {
  PathMeter meter;
  for (int i = 0; i <= 800; ++i) {
    meter.add({i <= 400 ? 0.1 * i : 0.1 * (800 - i), 0.5, 1}, true);
  }
  EXPECT_NEAR(meter.length_m(), 80, 1e-9);
  // Within 1.5 m of the turn the way back comes too soon to be a return; cells round that up.
  EXPECT_NEAR(meter.revisit_ratio(), 0.5 * (1 - 1.5 / 40), 0.5 * 1.01 / 40);
  EXPECT_NEAR(meter.heading_change_radpm(), std::numbers::pi / 80, 1e-3);
}

TEST(PathMeter, ACircleTurnsOneOverItsRadiusAndItsSecondLapIsARevisit) {
  for (const double radius : {4.0, 10.0}) {
    PathMeter meter;
    PathMeter blind;
    const int steps = static_cast<int>(2 * 2 * std::numbers::pi * radius / 0.05);
    for (int i = 0; i <= steps; ++i) {
      const double angle = 4 * std::numbers::pi * i / steps;
      meter.add({radius * std::cos(angle), radius * std::sin(angle), 1}, true);
      blind.add({radius * std::cos(angle), radius * std::sin(angle), 1}, false);
    }
    EXPECT_NEAR(meter.heading_change_radpm(), 1 / radius, 0.02 / radius);
    EXPECT_NEAR(meter.revisit_ratio(), 0.5, 0.01);
    EXPECT_EQ(blind.revisit_ratio(), 0);
  }
}

TEST(PathMeter, AStraightPathNeitherTurnsNorReturns) {
  PathMeter meter;
  for (int i = 0; i < 200; ++i) meter.add({0.1 * i, 0, 1}, true);
  EXPECT_EQ(meter.revisit_ratio(), 0);
  EXPECT_NEAR(meter.heading_change_radpm(), 0, 1e-12);
}

TEST(PathMeter, WithoutAPathThereIsNoShareOfIt) {
  PathMeter meter;
  EXPECT_TRUE(std::isnan(meter.revisit_ratio()));
  for (int i = 0; i < 10; ++i) meter.add({1, 2, 0.1 * i}, true);  // straight up
  EXPECT_TRUE(std::isnan(meter.revisit_ratio()));
  EXPECT_TRUE(std::isnan(meter.heading_change_radpm()));
}

}  // namespace
}  // namespace arex::sim
