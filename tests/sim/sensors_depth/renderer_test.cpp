#include "sensors/renderer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <thread>

#include "depth_scenes.h"
#include "sensors/d430_stereo.h"
#include "sensors/scene.h"

namespace arex::sim {
namespace {

const PinholeCamera kCamera = D430Config{}.camera();

std::size_t index_of(int u, int v) {
  return static_cast<std::size_t>(v) * static_cast<std::size_t>(kCamera.width) +
         static_cast<std::size_t>(u);
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

/// Depth of the first triangle along a pixel's ray by trying them all; 0 for none.
double brute_force_depth(const worlds::Mesh& mesh, const Pose& X_WC, int u, int v) {
  const Vec3 d = X_WC.R * kCamera.unproject(u, v, 1.0);
  double nearest = 0;
  for (const auto& [ia, ib, ic] : mesh.triangles) {
    const Vec3 a = mesh.vertices[ia].cast<double>();
    const Vec3 e1 = mesh.vertices[ib].cast<double>() - a, e2 = mesh.vertices[ic].cast<double>() - a;
    const Vec3 p = d.cross(e2), s = X_WC.p - a, q = s.cross(e1);
    const double det = e1.dot(p);
    if (det == 0) continue;
    const double b1 = s.dot(p) / det, b2 = d.dot(q) / det, z = e2.dot(q) / det;
    if (b1 < 0 || b2 < 0 || b1 + b2 > 1 || z <= 0.02 || z > 12) continue;
    if (nearest == 0 || z < nearest) nearest = z;
  }
  return nearest;
}

TEST(Renderer, DepthOfAPlaneIsExactToATenthOfAMillimetre) {
  for (const double tilt : {0.0, 0.5, 1.0}) {
    for (const double x : {0.3, 2.0, 9.5}) {
      const Vec3 normal = so3::Exp({0, 0.3 * tilt, tilt}) * Vec3::UnitX();
      const Vec3 point(x, 0, 0);
      const worlds::World world = plane_world(point, normal, 100);
      Renderer renderer(world, kCamera, {});
      std::vector<float> inverse_depth;
      const Pose X_WC = forward_camera();
      renderer.render_inverse_depth(X_WC, inverse_depth);
      double worst = 0;
      int seen = 0;
      for (int v = 0; v < kCamera.height; v += 7) {
        for (int u = 0; u < kCamera.width; u += 5) {
          const double q = static_cast<double>(inverse_depth[index_of(u, v)]);
          const Vec3 ray = X_WC.R * kCamera.unproject(u, v, 1.0);
          const double z = normal.dot(point) / normal.dot(ray);
          if (z < 0.1 || z > 10) continue;
          ++seen;
          worst = std::max(worst, std::abs(1 / q - z));
        }
      }
      EXPECT_GT(seen, 500) << "tilt " << tilt << ", x " << x;
      EXPECT_LT(worst, 1e-4) << "tilt " << tilt << ", x " << x;
    }
  }
}

TEST(Renderer, AgreesWithBruteForceRaysOnBoxes) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const worlds::World world = box_world(seed);
    Renderer renderer(world, kCamera, {});
    RandomStream random(seed, "poses");
    std::vector<float> inverse_depth;
    int disagreed = 0;
    for (int i = 0; i < 3; ++i) {
      const Pose X_WC =
          Pose{so3::Exp(0.2 * random.normal3()), 0.3 * random.normal3()} * forward_camera();
      renderer.render_inverse_depth(X_WC, inverse_depth);
      for (int k = 0; k < 2000; ++k) {
        const int u = random.uniform_int(0, kCamera.width - 1);
        const int v = random.uniform_int(0, kCamera.height - 1);
        const double z = brute_force_depth(world.mesh, X_WC, u, v);
        const double q = static_cast<double>(inverse_depth[index_of(u, v)]);
        const double error = z == 0 || q == 0 ? (z == 0 && q == 0 ? 0 : 1) : std::abs(1 / q - z);
        disagreed += error > 1e-5 ? 1 : 0;
      }
    }
    EXPECT_EQ(disagreed, 0);
  }
}

TEST(Renderer, AgreesWithEmbreeInAForest) {
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    const worlds::World world = small_forest(seed);
    const Scene scene(world);
    Renderer renderer(world, kCamera, {});
    RandomStream random(seed, "poses");
    std::vector<float> inverse_depth;
    std::vector<double> errors;
    int pixels = 0, disagreed = 0;
    for (int i = 0; i < 4; ++i) {
      const Pose X_WC = flying_pose(world, random) * forward_camera();
      renderer.render_inverse_depth(X_WC, inverse_depth);
      for (int v = 3; v < kCamera.height; v += 11) {
        for (int u = 2; u < kCamera.width; u += 7) {
          const Vec3 ray = kCamera.unproject(u, v, 1.0);
          const Hit hit = scene.cast(X_WC.p, (X_WC.R * ray).normalized(), 30);
          const double z = hit.valid() ? hit.distance_m / ray.norm() : 0;
          if (z > 0 && z < 0.03) continue;
          const double q = static_cast<double>(inverse_depth[index_of(u, v)]);
          ++pixels;
          const bool nothing = z == 0 || z > 12;
          if (nothing || q == 0) {
            disagreed += nothing && q == 0 ? 0 : 1;
            continue;
          }
          errors.push_back(std::abs(1 / q - z));
          disagreed += errors.back() > 5e-3 ? 1 : 0;
        }
      }
    }
    ASSERT_GT(errors.size(), 5000U);
    EXPECT_LT(median(errors), 2e-4);
    EXPECT_LT(disagreed, pixels / 200);
  }
}

/// A surface around the camera, of `slices` x `stacks` x 2 triangles with shared, irregular
/// corners.
worlds::World shell(int slices, int stacks, double radius_m, RandomStream& random) {
  worlds::MeshBuilder builder;
  const auto wall = builder.add_object(worlds::SurfaceClass::kWall, 0.5);
  std::vector<std::vector<Vec3>> rings;
  for (int i = 0; i <= stacks; ++i) {
    rings.emplace_back();
    const double polar = std::numbers::pi * i / stacks;
    for (int k = 0; k < slices; ++k) {
      const double azimuth = 2 * std::numbers::pi * k / slices;
      const double r = radius_m * random.uniform(0.8, 1.2);
      rings.back().push_back(i == 0 || i == stacks ? Vec3(0, 0, i == 0 ? radius_m : -radius_m)
                                                   : Vec3(r * std::sin(polar) * std::cos(azimuth),
                                                          r * std::sin(polar) * std::sin(azimuth),
                                                          r * std::cos(polar)));
    }
  }
  const auto at = [&](int i, int k) {
    return rings[static_cast<std::size_t>(i)][static_cast<std::size_t>(k % slices)];
  };
  for (int i = 0; i < stacks; ++i) {
    for (int k = 0; k < slices; ++k) {
      builder.add_quad(wall, at(i, k), at(i, k + 1), at(i + 1, k + 1), at(i + 1, k));
    }
  }
  return builder.finish();
}

// Triangles of all sizes, thousands of edges across every picture: not one pixel slips through.
TEST(Renderer, AClosedSurfaceHasNoHoles) {
  RandomStream random(7, "shells");
  for (const int slices : {3, 8, 40, 400}) {
    const worlds::World world = shell(slices, std::max(2, slices / 2), 5, random);
    Renderer renderer(world, kCamera, {});
    std::vector<float> inverse_depth;
    for (int i = 0; i < 5; ++i) {
      renderer.render_inverse_depth(
          Pose{so3::Exp(random.normal3()), 0.5 * random.normal3()} * forward_camera(),
          inverse_depth);
      EXPECT_EQ(std::count(inverse_depth.begin(), inverse_depth.end(), 0.0F), 0) << slices;
    }
  }
}

// Corners exactly on pixel centres, edges exactly through them: where rounding would decide.
TEST(Renderer, EdgesThroughPixelCentresBelongToSomebody) {
  const PinholeCamera camera{64, 48, 32, 32, 31.5, 23.5};
  worlds::MeshBuilder builder;
  const auto wall = builder.add_object(worlds::SurfaceClass::kWall, 0.5);
  const double step = 1.0 / 32;  // a pixel at 1 m
  for (int i = -32; i < 32; ++i) {
    for (int k = -24; k < 24; ++k) {
      const double x = (i + 0.5) * step, y = (k + 0.5) * step;
      builder.add_quad(wall, {x, y, 1}, {x + step, y, 1}, {x + step, y + step, 1},
                       {x, y + step, 1});
    }
  }
  const worlds::World world = builder.finish();
  Renderer renderer(world, camera, {});
  std::vector<float> inverse_depth;
  renderer.render_inverse_depth({}, inverse_depth);
  EXPECT_EQ(std::count(inverse_depth.begin(), inverse_depth.end(), 1.0F), 64 * 48);
}

// A floor that passes under the camera and behind it, and a corner within the near plane.
TEST(Renderer, DrawsTrianglesThatReachBehindTheEye) {
  const worlds::World world = plane_world({0, 0, -1}, Vec3::UnitZ(), 1000);
  RendererOptions options;
  options.far_m = 1e6;
  Renderer renderer(world, kCamera, options);
  std::vector<float> inverse_depth;
  const Pose X_WC = Pose{so3::Exp({0.1, 0.2, 0.3}), Vec3::Zero()} * forward_camera();
  renderer.render_inverse_depth(X_WC, inverse_depth);
  int below = 0;
  for (int v = 0; v < kCamera.height; ++v) {
    for (int u = 0; u < kCamera.width; ++u) {
      const Vec3 ray = X_WC.R * kCamera.unproject(u, v, 1.0);
      const double q = ray.z() < 0 ? -ray.z() : 0;  // of the plane z = -1
      const Vec3 p = q > 0 ? Vec3(ray / q) : Vec3::Zero();
      if (q > 0 && p.head<2>().cwiseAbs().maxCoeff() > 700) continue;  // beyond its borders
      ASSERT_NEAR(static_cast<double>(inverse_depth[index_of(u, v)]), q, 1e-7) << u << ", " << v;
      below += q > 0 ? 1 : 0;
    }
  }
  EXPECT_GT(below, 100'000);
}

TEST(Renderer, CullingChangesNoBit) {
  const worlds::World world = small_forest(5);
  Renderer culled(world, kCamera, {});
  RendererOptions everything;
  everything.cull = false;
  Renderer whole(world, kCamera, everything);
  RandomStream random(5, "poses");
  std::vector<float> a, b;
  for (int i = 0; i < 12; ++i) {
    const Pose X_WC = flying_pose(world, random) * forward_camera();
    culled.render_inverse_depth(X_WC, a);
    whole.render_inverse_depth(X_WC, b);
    ASSERT_EQ(a, b);
    EXPECT_LT(culled.last_frame().triangles, whole.last_frame().triangles / 2);
  }
}

TEST(Renderer, GivesTheSameBitsAgainAndOnAnyThread) {
  const worlds::World world = small_forest(6);
  Renderer first(world, kCamera, {}), second(world, kCamera, {});
  RandomStream random(6, "poses");
  for (int i = 0; i < 4; ++i) {
    const Pose X_WC = flying_pose(world, random) * forward_camera();
    std::vector<float> here, there, again;
    first.render_inverse_depth(X_WC, here);
    std::thread worker([&] { first.render_inverse_depth(X_WC, there); });
    std::thread other([&] { second.render_inverse_depth(X_WC, again); });
    worker.join();
    other.join();
    EXPECT_EQ(here, there);
    EXPECT_EQ(here, again);
  }
}

TEST(Renderer, SeesNothingInAnEmptyWorld) {
  const worlds::World nothing;
  Renderer renderer(nothing, kCamera, {});
  std::vector<float> inverse_depth;
  renderer.render_inverse_depth({}, inverse_depth);
  ASSERT_EQ(inverse_depth.size(), index_of(0, kCamera.height));
  EXPECT_TRUE(
      std::all_of(inverse_depth.begin(), inverse_depth.end(), [](float q) { return q == 0.0F; }));
}

}  // namespace
}  // namespace arex::sim
