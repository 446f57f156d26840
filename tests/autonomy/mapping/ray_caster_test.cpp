#include "mapping/ray_caster.h"

#include <gtest/gtest.h>

#include "mapping/frame_rays.h"
#include "voxel_oracle.h"

namespace arex {
namespace {

using namespace arex::test;

std::vector<TestRay> random_rays(const Vec3& origin, double reach_m, int count,
                                 std::mt19937_64& random) {
  std::uniform_real_distribution<double> u(-1, 1);
  std::vector<TestRay> rays;
  for (int i = 0; i < count; ++i) {
    const Vec3 from = origin + 0.2 * Vec3(u(random), u(random), u(random));
    Vec3 d(u(random), u(random), u(random));
    // Short rays, rays along an axis or in a coordinate plane, rays that end where they begin.
    if (i % 5 == 1) d *= 0.01;
    if (i % 7 == 2) d[i % 3] = 0;
    if (i % 11 == 3) d[i % 3] = d[(i + 1) % 3] = 0;
    if (i % 101 == 4) d.setZero();
    rays.push_back({from, from + reach_m * d, i % 4 != 0});
  }
  return rays;
}

void cast(const std::vector<TestRay>& rays, const Vec3& centre, const CellBox& clip,
          RayCaster& caster) {
  caster.begin(centre, clip);
  for (const TestRay& ray : rays) caster.add(ray.from, ray.to, ray.hit);
  caster.finish();
}

TEST(RayCaster, ReportsTheVoxelsOfABruteForceTraversal) {
  RayCaster caster(0.1);
  for (unsigned seed = 1; seed <= 6; ++seed) {
    std::mt19937_64 random(seed);
    // Origins on both sides of zero and across the window's seams.
    const Vec3 origin = seed == 1 ? Vec3(0.03, -0.02, 0.01)
                                  : Vec3(-40.0 + 17.3 * seed, 25.6 - 11.1 * seed, 3.0 - 2.7 * seed);
    const CellBox everywhere{Cell::Constant(-100000), Cell::Constant(100000)};
    const std::vector<TestRay> rays = random_rays(origin, 13, 1000, random);
    cast(rays, origin, everywhere, caster);
    const VoxelSets expected = cast_brute_force(rays, 0.1, everywhere);
    const VoxelSets got = sets_of(caster, everywhere);
    EXPECT_GT(expected.passed.size(), 20000U);
    EXPECT_EQ(got.hit, expected.hit) << seed;
    EXPECT_EQ(got.passed, expected.passed) << seed;
  }
}

TEST(RayCaster, IsExactInsideTheBoxItIsClippedTo) {
  RayCaster caster(0.1);
  for (unsigned seed = 1; seed <= 6; ++seed) {
    std::mt19937_64 random(seed);
    const Vec3 origin(12.34 * seed - 30, -7.77, 1.5);
    const Cell centre = caster.cell_of(origin);
    const CellBox box{centre - Cell(61, 40, 15), centre + Cell(59, 43, 15)};
    std::vector<TestRay> rays = random_rays(origin, 20, 800, random);
    // Some begin outside of the box and cross it.
    for (std::size_t i = 0; i < rays.size(); i += 10) rays[i].from.z() += 2.5;
    cast(rays, origin, box, caster);
    const VoxelSets expected = cast_brute_force(rays, 0.1, box);
    const VoxelSets got = sets_of(caster, box);
    EXPECT_EQ(got.hit, expected.hit) << seed;
    EXPECT_EQ(got.passed, expected.passed) << seed;
  }
}

TEST(RayCaster, ForgetsTheLastFrame) {
  RayCaster caster(0.1);
  const CellBox everywhere{Cell::Constant(-1000), Cell::Constant(1000)};
  caster.begin(Vec3::Zero(), everywhere);
  caster.add({0.05, 0.05, 0.05}, {5, 1, 2}, true);
  EXPECT_FALSE(caster.finish().empty());
  caster.begin(Vec3::Zero(), everywhere);
  EXPECT_TRUE(caster.finish().empty());
}

TEST(RayCaster, IgnoresWhatIsNotFinite) {
  RayCaster caster(0.1);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  caster.begin(Vec3::Zero(), {Cell::Constant(-1000), Cell::Constant(1000)});
  caster.add(Vec3::Zero(), {nan, 1, 1}, true);
  caster.add({nan, 0, 0}, {1, 1, 1}, true);
  caster.add(Vec3::Zero(), {1, inf, 1}, true);
  EXPECT_TRUE(caster.finish().empty());
}

TEST(FrameRays, InterpolatesOriginsCutsAtTheRangeAndLeavesOutTheBody) {
  std::mt19937_64 random(3);
  RegisteredScan scan = scan_room({0.4, 0.3, 1.2}, {0, 0, 1}, {9, 7, 2}, 1500, random);
  scan.origin_begin_O = scan.origin_end_O - Vec3(0.2, 0.05, -0.03);
  scan.p_OB = scan.origin_end_O - Vec3(0.15, 0, 0.01);
  auto points = std::make_shared<std::vector<Vec3f>>(*scan.points_O);
  const VehicleConfig vehicle;
  for (std::size_t i = 0; i < points->size(); i += 50) {  // returns of the own propellers
    (*points)[i] = (scan.origin_of(i) - Vec3(0.35, 0.1, 0.05)).cast<float>();
  }
  scan.points_O = points;
  const CellBox everywhere{Cell::Constant(-1000), Cell::Constant(1000)};
  RayCaster caster(0.1);
  for (const bool timed : {false, true}) {
    if (timed) {
      auto fractions = std::make_shared<std::vector<float>>();
      for (std::size_t i = 0; i < points->size(); ++i) {
        const float x = static_cast<float>(i) / static_cast<float>(points->size());
        fractions->push_back(x * x);
      }
      scan.fractions = fractions;
    }
    cast_frame(scan, 6.0, vehicle, everywhere, caster);
    const std::vector<TestRay> rays = rays_of(scan, 6.0, vehicle.own_returns_m());
    EXPECT_LE(rays.size(), points->size() - points->size() / 50);
    const VoxelSets expected = cast_brute_force(rays, 0.1, everywhere);
    EXPECT_EQ(sets_of(caster, everywhere).hit, expected.hit);
    EXPECT_EQ(sets_of(caster, everywhere).passed, expected.passed);
    for (const Voxel& v : expected.hit) {
      const Vec3 p = 0.1 * Vec3(v[0] + 0.5, v[1] + 0.5, v[2] + 0.5);
      EXPECT_GT((p - scan.p_OB).norm(), vehicle.own_returns_m() - 0.3);
    }
  }
}

TEST(FrameRays, LeavesOutNearReturnsThatStandAlone) {
  const VehicleConfig vehicle;
  RegisteredScan scan;
  scan.origin_begin_O = Vec3(3, 2, 1.2);
  scan.origin_end_O = Vec3(3.2, 2, 1.2);
  scan.p_OB = scan.origin_end_O - vehicle.lidar_position_m;
  const auto near_the_vehicle = [&](double x, double y, double z) {
    return Vec3f((scan.p_OB + Vec3(x, y, z)).cast<float>());
  };
  auto points = std::make_shared<std::vector<Vec3f>>();
  points->push_back(near_the_vehicle(0.9, 0.1, 0.05));  // alone: false
  points->push_back(near_the_vehicle(-0.3, 0.1, 0.0));  // the body's
  points->push_back(near_the_vehicle(2.5, 0.5, 0.0));   // alone, but far
  points->push_back(near_the_vehicle(0.3, 0.9, 0.2));   // a twig
  points->push_back(near_the_vehicle(0.3, 0.9, 0.32));
  points->push_back(near_the_vehicle(-0.6, -0.2, 0.3));  // alone: false, though the body is near
  scan.points_O = points;
  const CellBox everywhere{Cell::Constant(-1000), Cell::Constant(1000)};
  RayCaster caster(0.1);
  const auto hits = [&](double lone_range_m) {
    cast_frame(scan, 20, vehicle, everywhere, caster, lone_range_m);
    return sets_of(caster, everywhere).hit.size();
  };
  EXPECT_EQ(hits(0), 5u);
  EXPECT_EQ(hits(1.5), 3u);
  EXPECT_EQ(hits(0.8), 4u);
  cast_frame(scan, 20, vehicle, everywhere, caster, 1.5);
  for (const std::size_t i : {2, 3, 4}) {
    const Cell cell = caster.cell_of((*points)[i].cast<double>());
    EXPECT_TRUE(sets_of(caster, everywhere).hit.contains({cell.x(), cell.y(), cell.z()})) << i;
  }
}

TEST(FrameRays, PutsDepthWhereTheCameraSawIt) {
  const VehicleConfig vehicle;
  LocalGridConfig config;
  auto image = std::make_shared<DepthImage>();
  image->camera = {64, 48, 40, 40, 31.5, 23.5};
  image->depth_m.assign(64 * 48, 2.05F);
  image->depth_m[0] = 0;      // no measurement
  image->depth_m[8] = 0.1F;   // the own body
  image->depth_m[16] = 9.0F;  // too far for a point: free up to the limit
  const Pose X_OB{so3::from_yaw(std::numbers::pi / 2), {1.0213, 2.03, 1.5137}};
  const RegisteredDepth depth{X_OB * vehicle.X_BC(), image};
  RayCaster caster(0.1);
  const CellBox everywhere{Cell::Constant(-1000), Cell::Constant(1000)};
  cast_frame(depth, config, vehicle, everywhere, caster);
  const VoxelSets got = sets_of(caster, everywhere);
  // Yawed to the left: the wall stands at y = 2.03 + 0.14 + 2.05.
  EXPECT_GT(got.hit.size(), 100U);
  for (const Voxel& v : got.hit) EXPECT_EQ(v[1], 42);
  int beyond = 0;
  for (const Voxel& v : got.passed) beyond += v[1] > 42;
  EXPECT_GT(beyond, 20);
  std::vector<TestRay> rays;
  for (int v = 0; v < 48; v += 8) {
    for (int u = 0; u < 64; u += 8) {
      const double z = image->at(u, v);
      if (z < config.depth_min_m) continue;
      const bool hit = z < config.depth_max_m;
      rays.push_back({depth.X_OC.p,
                      depth.X_OC * image->camera.unproject(u, v, hit ? z : config.depth_max_m),
                      hit});
    }
  }
  VoxelSets expected = cast_brute_force(rays, 0.1, everywhere);
  for (const Voxel& v : got.hit) expected.passed.erase(v);
  EXPECT_EQ(got.passed, expected.passed);
}

}  // namespace
}  // namespace arex
