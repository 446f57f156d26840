#include "sensors/scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <utility>

#include "math/random.h"
#include "sim/sensors_lidar/test_world.h"

namespace arex::sim {
namespace {

worlds::World soup(std::uint64_t seed, int count) {
  RandomStream stream(seed, "soup");
  test::WorldMaker maker;
  for (int i = 0; i < count; ++i) {
    if (i % 10 == 0) {
      maker.object(static_cast<float>(stream.uniform()),
                   i % 20 == 0 ? worlds::SurfaceClass::kLeaf : worlds::SurfaceClass::kTrunk);
    }
    const Vec3 centre(stream.uniform(-10, 10), stream.uniform(-10, 10), stream.uniform(-10, 10));
    maker.triangle(centre + stream.normal3(), centre + stream.normal3(), centre + stream.normal3());
  }
  return maker.world();
}

std::array<Vec3, 3> corners(const worlds::World& world, std::size_t triangle) {
  std::array<Vec3, 3> out;
  for (std::size_t i = 0; i < 3; ++i) {
    out[i] = world.mesh.vertices[world.mesh.triangles[triangle][i]].cast<double>();
  }
  return out;
}

struct BruteHit {
  double distance = std::numeric_limits<double>::infinity();
  std::uint32_t triangle = Hit::kNone;
  double margin = 1;  ///< how near the ray passes to any edge, in barycentric coordinates
};

BruteHit brute_cast(const worlds::World& world, const Vec3& o, const Vec3& d) {
  BruteHit best;
  for (std::size_t i = 0; i < world.mesh.triangles.size(); ++i) {
    const auto [a, b, c] = corners(world, i);
    Mat3 M;
    M << b - a, c - a, -d;
    const Vec3 x = M.partialPivLu().solve(o - a);  // u, v, distance
    if (!x.allFinite() || x.z() < 0) continue;
    const double inside = std::min({x.x(), x.y(), 1 - x.x() - x.y()});
    best.margin = std::min(best.margin, std::abs(inside));
    if (inside >= 0 && x.z() < best.distance) {
      best.distance = x.z();
      best.triangle = static_cast<std::uint32_t>(i);
    }
  }
  return best;
}

double to_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const double t = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
  return (a + t * (b - a) - p).norm();
}

double brute_distance(const worlds::World& world, const Vec3& p, bool leaves) {
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < world.mesh.triangles.size(); ++i) {
    if (!leaves && world.class_of_triangle(i) == worlds::SurfaceClass::kLeaf) continue;
    const auto [a, b, c] = corners(world, i);
    best = std::min({best, to_segment(p, a, b), to_segment(p, b, c), to_segment(p, c, a)});
    const Vec3 n = (b - a).cross(c - a).normalized();
    const Vec3 foot = p - n.dot(p - a) * n;
    const bool inside = n.dot((b - a).cross(foot - a)) >= 0 &&
                        n.dot((c - b).cross(foot - b)) >= 0 && n.dot((a - c).cross(foot - c)) >= 0;
    if (inside) best = std::min(best, std::abs(n.dot(p - a)));
  }
  return best;
}

TEST(Scene, CastAgreesWithEveryTriangleTried) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const worlds::World world = soup(seed, 300);
    const Scene scene(world);
    RandomStream stream(seed, "rays");
    int hits = 0, compared = 0;
    for (int i = 0; i < 1500; ++i) {
      const Vec3 o = 6 * stream.normal3().cwiseMax(-2).cwiseMin(2);
      const Vec3 d = stream.normal3().normalized();
      const BruteHit expected = brute_cast(world, o, d);
      if (expected.margin < 1e-5) continue;  // on an edge, single precision may decide otherwise
      ++compared;
      const Hit hit = scene.cast(o, d, 100);
      ASSERT_EQ(hit.triangle, expected.triangle) << "seed " << seed << " ray " << i;
      if (!hit.valid()) continue;
      ++hits;
      const auto [a, b, c] = corners(world, hit.triangle);
      const Vec3 n = (b - a).cross(c - a).normalized();
      ASSERT_NEAR(hit.distance_m, expected.distance, 1e-5 / std::abs(n.dot(d)));
      ASSERT_EQ(hit.object, world.mesh.object_of_triangle[hit.triangle]);
      ASSERT_NEAR(hit.normal_W.norm(), 1, 1e-12);
      ASSERT_LT(hit.normal_W.dot(d), 0);
      ASSERT_NEAR(std::abs(hit.normal_W.dot(n)), 1, 1e-6);
      ASSERT_FALSE(scene.cast(o, d, 0.99 * hit.distance_m).valid());
    }
    EXPECT_GT(hits, 200);
    EXPECT_GT(compared, 1400);
  }
}

/// Every triangle tried: what a ray meets first, and what it may meet, within Embree's rounding of
/// a border or of lying edge-on.
struct Expected {
  std::pair<double, std::uint32_t> first{std::numeric_limits<double>::infinity(), Hit::kNone};
  std::map<std::uint32_t, double> unsure;  ///< distances by triangle, of those before the first
};

Expected try_all(const worlds::World& world, const Vec3& o, const Vec3& d, double max_distance_m) {
  Expected expected;
  for (std::uint32_t i = 0; i < world.mesh.triangles.size(); ++i) {
    const auto [a, b, c] = corners(world, i);
    const Vec3 normal = (b - a).cross(c - a);
    const double cosine = std::abs(normal.dot(d)) / normal.norm();
    const Vec3 weights = Vec3(d.dot((b - o).cross(c - o)), d.dot((c - o).cross(a - o)),
                              d.dot((a - o).cross(b - o))) /
                         normal.dot(d);
    const double border = 1e-5 / cosine;
    if (cosine > 1e-3 && weights.minCoeff() < -border) continue;
    const double t = distance_along(o, d, {a.cast<float>(), b.cast<float>(), c.cast<float>()});
    if (t < 0 || t > max_distance_m) continue;
    if (cosine > 1e-3 && weights.minCoeff() > border) {
      expected.first = std::min(expected.first, {t, i});
    } else {
      expected.unsure[i] = t;
    }
  }
  std::erase_if(expected.unsure, [&](const auto& entry) {
    return std::pair(entry.second, entry.first) > expected.first;
  });
  return expected;
}

/// Rounded to what single precision holds exactly: multiples of `step`. (Of v.cast<float>().cast<
/// double>() GCC 12 makes v again.)
Vec3 on_grid(const Vec3& v, double step) { return (v.array() / step).round() * step; }

/// A soup with what makes ties: each tenth triangle twice, neighbours across an edge, walls of
/// axis-aligned strips, and triangles that cross.
worlds::World world_of_ties(std::uint64_t seed) {
  RandomStream stream(seed, "ties");
  test::WorldMaker maker;
  for (int i = 0; i < 200; ++i) {
    maker.object(static_cast<float>(stream.uniform()));
    const Vec3 centre(stream.uniform(-10, 10), stream.uniform(-10, 10), stream.uniform(-10, 10));
    const Vec3 a = centre + stream.normal3(), b = centre + stream.normal3(),
               c = centre + stream.normal3();
    maker.triangle(a, b, c);
    if (i % 10 == 0) maker.object(0.5F).triangle(b, c, a);          // coincident
    if (i % 10 == 1) maker.object(0.5F).triangle(a, b, a + b - c);  // a neighbour across an edge
  }
  for (int k = 0; k < 12; ++k) {
    maker.object(0.3F).quad({-12.0 + 2 * k, -12, -11}, {2, 0, 0}, {0, 24, 0});
    maker.object(0.3F).quad({-11, -12.0 + 2 * k, -12}, {0, 2, 0}, {0, 0, 24});
  }
  return maker.world();
}

// Embree only suggests: of what a ray meets the nearest by our own arithmetic is the answer, of
// equally near ones the first in the mesh.
TEST(Scene, TheFirstTriangleIsDecidedByOurOwnArithmetic) {
  for (const std::uint64_t seed : {1U, 2U}) {
    const worlds::World world = world_of_ties(seed);
    const Scene scene(world);
    RandomStream stream(seed, "rays");
    int sure = 0, ties = 0;
    for (int i = 0; i < 5000; ++i) {
      const auto [a, b, c] =
          corners(world, static_cast<std::size_t>(stream.uniform_int(
                             0, static_cast<int>(world.mesh.triangles.size()) - 1)));
      // Anywhere, into its middle, to a corner, to an edge, along its plane.
      const std::array<Vec3, 5> targets{4 * stream.normal3(), (a + b + c) / 3, a,
                                        a + stream.uniform() * (b - a), c};
      const Vec3 from =
          i % 5 == 4 ? Vec3(a + 3 * (a - b) + 1e-2 * stream.normal3()) : Vec3(4 * stream.normal3());
      const Vec3 o = on_grid(from, 0x1p-16);
      const Vec3 d = on_grid((targets[static_cast<std::size_t>(i % 5)] - o).normalized(), 0x1p-22);
      const double range = stream.uniform() < 0.2 ? 8.0 : 60.0;
      const Expected expected = try_all(world, o, d, range);
      const Hit hit = scene.cast(o, d, range);
      if (expected.unsure.contains(hit.triangle)) {
        ASSERT_EQ(hit.distance_m, expected.unsure.at(hit.triangle));
        continue;
      }
      ASSERT_EQ(hit.triangle, expected.first.second) << "seed " << seed << " ray " << i;
      ASSERT_EQ(hit.distance_m, expected.first.first) << "seed " << seed << " ray " << i;
      ++sure;
      ties += hit.valid() && hit.triangle + 1 < world.mesh.triangles.size() &&
              distance_along(o, d,
                             {corners(world, hit.triangle + 1)[0].cast<float>(),
                              corners(world, hit.triangle + 1)[1].cast<float>(),
                              corners(world, hit.triangle + 1)[2].cast<float>()}) == hit.distance_m;
    }
    EXPECT_GT(sure, 3500);
    EXPECT_GT(ties, 50);
  }
}

TEST(Scene, BatchAgreesWithSingleCasts) {
  const worlds::World world = soup(4, 2000);
  const Scene scene(world);
  RandomStream stream(4, "batch");
  for (const std::size_t count : {1U, 7U, 8U, 203U}) {  // whole packets and remainders
    std::vector<Ray> rays(count);
    std::vector<RayHit> hits(count);
    for (Ray& ray : rays) {
      ray.origin_W = (3 * stream.normal3()).cast<float>();
      ray.direction_W = stream.normal3().normalized().cast<float>();
      ray.max_distance_m = 50;
    }
    scene.cast(rays, hits);
    for (std::size_t i = 0; i < count; ++i) {
      const Hit single =
          scene.cast(rays[i].origin_W.cast<double>(), rays[i].direction_W.cast<double>(), 50);
      ASSERT_EQ(hits[i].valid(), single.valid());
      if (!single.valid()) continue;
      ASSERT_EQ(hits[i].object, single.object);
      const double cosine = std::abs(single.normal_W.dot(rays[i].direction_W.cast<double>()));
      ASSERT_NEAR(hits[i].distance_m, single.distance_m, 1e-5 / cosine);
      ASSERT_EQ(hits[i].reflectivity, world.objects[single.object].reflectivity);
    }
  }
}

// A world of millions of triangles is held otherwise, for the memory's sake; what is out of reach
// here makes a small one large.
TEST(Scene, ALargeWorldAnswersTheSame) {
  const worlds::World world = soup(4, 2000);
  worlds::World large = world;
  const auto far = static_cast<std::uint32_t>(large.mesh.vertices.size());
  for (const Vec3f& p : {Vec3f(0, 0, -500), Vec3f(1, 0, -500), Vec3f(0, 1, -500)}) {
    large.mesh.vertices.push_back(p);
  }
  large.mesh.triangles.resize(2'000'001, {far, far + 1, far + 2});
  large.mesh.object_of_triangle.resize(large.mesh.triangles.size(), 0);
  const Scene scene(world), large_scene(large);
  RandomStream stream(4, "large");
  int met = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 o = 3 * stream.normal3(), d = stream.normal3().normalized();
    const Hit hit = scene.cast(o, d, 50), same = large_scene.cast(o, d, 50);
    ASSERT_EQ(same.triangle, hit.triangle);
    ASSERT_EQ(same.distance_m, hit.distance_m);
    ASSERT_EQ(same.normal_W, hit.normal_W);
    ASSERT_EQ(same.object, hit.object);
    met += hit.valid();
    ASSERT_EQ(large_scene.distance_to_surface(o, 5), scene.distance_to_surface(o, 5));
  }
  EXPECT_GT(met, 1000);
}

TEST(Scene, BatchSearchesOnlyTheGivenStretch) {
  test::WorldMaker maker;
  maker.object(0.2F).quad({2, -5, -5}, {0, 10, 0}, {0, 0, 10});
  maker.object(0.8F).quad({4, -5, -5}, {0, 10, 0}, {0, 0, 10});
  const Scene scene(maker.world());
  const std::vector<Ray> rays{{Vec3f::Zero(), Vec3f::UnitX(), 0, 10},
                              {Vec3f::Zero(), Vec3f::UnitX(), 3, 10},
                              {Vec3f::Zero(), Vec3f::UnitX(), 0, 1.5F},
                              {Vec3f::Zero(), Vec3f::UnitX(), 0, -1}};
  std::vector<RayHit> hits(rays.size());
  scene.cast(rays, hits);
  EXPECT_FLOAT_EQ(hits[0].distance_m, 2);
  EXPECT_FLOAT_EQ(hits[1].distance_m, 4);
  EXPECT_FLOAT_EQ(hits[1].reflectivity, 0.8F);
  EXPECT_FALSE(hits[2].valid());
  EXPECT_FALSE(hits[3].valid());
}

TEST(Scene, NoRaySlipsThroughASeam) {
  // Ground of many triangles: every ray that points down must meet it.
  test::WorldMaker maker;
  maker.object(0.3F).surface(100, 100, [](double u, double v) {
    return Vec3(40 * u - 20, 40 * v - 20, 0.3 * std::sin(9 * u) * std::cos(7 * v));
  });
  const Scene scene(maker.world());
  RandomStream stream(5, "seam");
  int lost = 0;
  for (int i = 0; i < 100'000; ++i) {
    // Aimed at vertices and edges of the grid on purpose.
    const Vec3 target(0.4 * stream.uniform_int(-40, 40), 0.4 * stream.uniform_int(-40, 40), 0);
    const Vec3 o(stream.uniform(-5, 5), stream.uniform(-5, 5), 3);
    lost += scene.cast(o, (target - o).normalized(), 100).valid() ? 0 : 1;
  }
  EXPECT_EQ(lost, 0);
}

TEST(Scene, DistanceAgreesWithEveryTriangleTried) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const worlds::World world = soup(seed, 300);
    const Scene scene(world);
    RandomStream stream(seed, "points");
    for (int i = 0; i < 1000; ++i) {
      const Vec3 p = 6 * stream.normal3();
      const double solid = brute_distance(world, p, false), all = brute_distance(world, p, true);
      ASSERT_NEAR(scene.distance_to_surface(p, 100), solid, 1e-9);
      ASSERT_NEAR(scene.distance_to_surface(p, 100, worlds::ClassSet::all()), all, 1e-9);
      ASSERT_NEAR(scene.distance_to_surface(p, 0.5), std::min(solid, 0.5), 1e-9);
    }
  }
}

TEST(Scene, ATreeBuiltBesideAnswersTheSame) {
  const worlds::World world = soup(7, 20'000);
  const Scene now(world), beside(world, Scene::Build::kBeside);
  RandomStream stream(7, "rays");
  std::vector<Ray> rays(800);
  for (Ray& ray : rays) {
    ray.origin_W = (3 * stream.normal3()).cast<float>();
    ray.direction_W = stream.normal3().normalized().cast<float>();
    ray.max_distance_m = 50;
  }
  std::vector<RayHit> expected(rays.size()), hits(rays.size());
  beside.cast(rays, hits);  // asked while it is being built
  now.cast(rays, expected);
  int valid = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    valid += hits[i].valid() ? 1 : 0;
    ASSERT_EQ(hits[i].object, expected[i].object);
    ASSERT_EQ(hits[i].distance_m, expected[i].distance_m);
  }
  EXPECT_GT(valid, 400);
}

TEST(Scene, EmptyWorldHoldsNothing) {
  const worlds::World world;
  const Scene scene(world);
  EXPECT_FALSE(scene.cast(Vec3::Zero(), Vec3::UnitX(), 100).valid());
  EXPECT_EQ(scene.distance_to_surface(Vec3::Zero(), 7), 7);
}

}  // namespace
}  // namespace arex::sim
