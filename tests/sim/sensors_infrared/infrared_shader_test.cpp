#include "sensors/infrared_shader.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "../sensors_depth/depth_scenes.h"
#include "sensors/d430_stereo.h"
#include "worlds/garage.h"

namespace arex::sim {
namespace {

const PinholeCamera kCamera = D430Config{}.camera();

std::size_t index_of(const PinholeCamera& camera, int u, int v) {
  return static_cast<std::size_t>(v) * static_cast<std::size_t>(camera.width) +
         static_cast<std::size_t>(u);
}

struct Agreement {
  int pixels = 0, other_surface = 0, other_depth = 0;
};

/// Of the id buffer with Embree's rays, at samples over the image.
Agreement compare_with_embree(const worlds::World& world, const Scene& scene, const Pose& X_WC,
                              double far_m) {
  PinholeCamera camera = kCamera;
  Renderer renderer(world, camera, {.far_m = far_m});
  std::vector<float> inverse_depth;
  std::vector<std::uint32_t> triangles;
  renderer.render_triangles(X_WC, inverse_depth, triangles);
  Agreement agreement;
  for (int v = 3; v < camera.height; v += 13) {
    for (int u = 2; u < camera.width; u += 11) {
      const Vec3 ray = camera.unproject(u, v, 1.0);
      const Hit hit = scene.cast(X_WC.p, (X_WC.R * ray).normalized(), 2 * far_m);
      const double z = hit.valid() ? hit.distance_m / ray.norm() : 0;
      if (z > 0 && z < 0.03) continue;
      const std::size_t i = index_of(camera, u, v);
      const double q = static_cast<double>(inverse_depth[i]);
      ++agreement.pixels;
      const bool nothing = z == 0 || z > far_m;
      EXPECT_EQ(q == 0, triangles[i] == Renderer::kNoTriangle);
      if (nothing || q == 0) {
        agreement.other_surface += nothing != (q == 0);
        continue;
      }
      agreement.other_surface += world.mesh.object_of_triangle[triangles[i]] != hit.object;
      agreement.other_depth += std::abs(1 / q - z) > 5e-3 * (1 + z / 10);
    }
  }
  return agreement;
}

TEST(RendererTriangles, AreThoseThatEmbreesRaysMeet) {
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    const worlds::World forest = small_forest(seed);
    const Scene scene(forest);
    RandomStream random(seed, "poses");
    for (int i = 0; i < 2; ++i) {
      const Pose X_WC = flying_pose(forest, random) * forward_camera();
      const Agreement agreement = compare_with_embree(forest, scene, X_WC, 60);
      EXPECT_LT(agreement.other_surface, agreement.pixels / 100);
      EXPECT_LT(agreement.other_depth, agreement.pixels / 100);
    }
  }
}

TEST(RendererTriangles, LeaveTheDepthsAsTheyAreWithoutThem) {
  const worlds::World world = small_forest(4);
  Renderer renderer(world, kCamera, {});
  RandomStream random(4, "poses");
  std::vector<float> alone, with;
  std::vector<std::uint32_t> triangles;
  for (int i = 0; i < 4; ++i) {
    const Pose X_WC = flying_pose(world, random) * forward_camera();
    renderer.render_inverse_depth(X_WC, alone);
    renderer.render_triangles(X_WC, with, triangles);
    EXPECT_EQ(alone, with);
  }
}

// A sample of the left eye, put into W by its depth, falls in the right eye on the same surface at
// the same depth, or behind something nearer.
TEST(InfraredShader, SamplesOfOneEyeAreFoundAgainInTheOther) {
  const worlds::World world = small_forest(3);
  const Scene scene(world);
  InfraredShader shader({}, world, scene, kCamera);
  RandomStream random(3, "poses");
  InfraredScene left, right;
  const PinholeCamera fine = shader.sample_camera();
  for (int i = 0; i < 2; ++i) {
    const Pose X_WC = flying_pose(world, random) * forward_camera();
    const Pose X_WR = X_WC * Pose{Mat3::Identity(), Vec3(0.05, 0, 0)};
    Renderer renderer(world, fine, {.far_m = 60});
    std::vector<float> depth_l, depth_r;
    std::vector<std::uint32_t> seen_l, seen_r;
    renderer.render_triangles(X_WC, depth_l, seen_l);
    renderer.render_triangles(X_WR, depth_r, seen_r);
    int points = 0, found = 0, behind = 0;
    for (int v = 10; v < fine.height - 10; v += 17) {
      for (int u = 300; u < fine.width - 10; u += 13) {
        const double q = static_cast<double>(depth_l[index_of(fine, u, v)]);
        if (q == 0) continue;
        const Vec3 p_R = X_WR.inverse() * (X_WC * fine.unproject(u, v, 1 / q));
        const double ur = fine.cx + fine.fx * p_R.x() / p_R.z();
        EXPECT_NEAR(u - ur, fine.fx * 0.05 * q, 1e-3);  // f B / Z
        const int column = static_cast<int>(std::lround(ur));
        const double qr = static_cast<double>(depth_r[index_of(fine, column, v)]);
        ++points;
        found += std::abs(qr - q) < 0.02 * q;
        behind += qr > 1.02 * q;
      }
    }
    EXPECT_GT(points, 2000);
    EXPECT_GT(found, points * 7 / 10);
    EXPECT_GT(found + behind, points * 97 / 100);  // the rest lies beside an edge
  }
}

/// A wall with the class's texture, square to the camera.
InfraredScene drawn_wall(InfraredShader& shader, const Pose& X_WC) {
  InfraredScene scene;
  shader.draw(X_WC, scene);
  return scene;
}

TEST(InfraredShader, TheRightImageIsTheLeftOneShiftedByTheDisparity) {
  constexpr double kBaseline = 0.05;
  for (const int disparity : {2, 6, 15}) {
    const double z = kCamera.fx * kBaseline / disparity;
    const worlds::World world = plane_world({z, 0, 0}, Vec3::UnitX(), 30);
    const Scene scene(world);
    InfraredShader shader({}, world, scene, kCamera);
    const Pose X_WC = forward_camera();
    const InfraredScene left = drawn_wall(shader, X_WC);
    const InfraredScene right =
        drawn_wall(shader, X_WC * Pose{Mat3::Identity(), Vec3(kBaseline, 0, 0)});
    const auto mean_difference = [&](int shift) {
      double sum = 0, mean = 0;
      int n = 0;
      for (int v = 40; v < 440; v += 3) {
        for (int u = 100; u < 800; u += 3, ++n) {
          const double l = static_cast<double>(left.light_lx[index_of(kCamera, u, v)]);
          sum += std::abs(l - static_cast<double>(right.light_lx[index_of(kCamera, u - shift, v)]));
          mean += l;
        }
      }
      return sum / mean;
    };
    EXPECT_LT(mean_difference(disparity), 0.005) << disparity;
    EXPECT_GT(mean_difference(disparity + 1), 5 * mean_difference(disparity)) << disparity;
    EXPECT_GT(mean_difference(disparity - 1), 5 * mean_difference(disparity)) << disparity;
  }
}

TEST(InfraredShader, SunlitSurfacesAreBrighterThanThoseInShadow) {
  const worlds::World world = small_forest(5);
  const Scene scene(world);
  InfraredLightConfig light;
  InfraredShader with(light, world, scene, kCamera);
  light.sun = false;
  InfraredShader without(light, world, scene, kCamera);
  RandomStream random(5, "poses");
  InfraredScene sunny, dull;
  with.draw(flying_pose(world, random) * forward_camera(), sunny);
  RandomStream again(5, "poses");
  without.draw(flying_pose(world, again) * forward_camera(), dull);
  double sum_sunny = 0, sum_dull = 0;
  int darker = 0, ground = 0;
  for (std::size_t i = 0; i < sunny.light_lx.size(); ++i) {
    if (sunny.inverse_depth[i] == 0) continue;
    sum_sunny += static_cast<double>(sunny.light_lx[i]);
    sum_dull += static_cast<double>(dull.light_lx[i]);
    ++ground;
    darker += sunny.light_lx[i] < 0.999F * dull.light_lx[i];
  }
  EXPECT_GT(sum_sunny, 1.5 * sum_dull);
  EXPECT_LT(darker, ground / 100);
}

// Where the sun strikes at a slant, a texel of its map covers much depth: nothing may speckle.
TEST(InfraredShader, ASlopeInTheSunDoesNotShadeItself) {
  for (const double tilt : {0.0, 0.1, 0.2}) {
    const Vec3 normal(-std::sin(tilt), 0, std::cos(tilt));
    const worlds::World world = plane_world({0, 0, -1.5}, normal, 30);
    const Scene scene(world);
    InfraredLightConfig light;
    light.sun_azimuth_rad = 0.3;
    light.sun_elevation_rad = 0.35;
    InfraredShader with(light, world, scene, kCamera);
    light.sun = false;
    InfraredShader without(light, world, scene, kCamera);
    InfraredScene sunny, dull;
    with.draw(forward_camera(), sunny);
    without.draw(forward_camera(), dull);
    float least = 1e9F, most = 0;
    for (int v = 330; v < 470; ++v) {
      for (int u = 100; u < 750; ++u) {
        const std::size_t i = index_of(kCamera, u, v);
        const float ratio = sunny.light_lx[i] / dull.light_lx[i];
        least = std::min(least, ratio);
        most = std::max(most, ratio);
      }
    }
    EXPECT_GT(least, 1.2F) << tilt;
    EXPECT_LT(most, 1.3F * least) << tilt;
  }
}

TEST(InfraredShader, TheGarageIsLitByItsLampsAlone) {
  worlds::GarageRecipe recipe;
  recipe.length_m = 50;
  recipe.width_m = 30;
  const worlds::World world = worlds::build(recipe, 1);
  const Scene scene(world);
  InfraredLightConfig light;
  InfraredShader lit(light, world, scene, kCamera);
  light.lamps = false;
  InfraredShader dark(light, world, scene, kCamera);
  const Pose X_WB{so3::from_yaw(0), Vec3(40, 0, recipe.floor_z_m + 1.5)};
  InfraredScene with, without;
  lit.draw(X_WB * forward_camera(), with);
  dark.draw(X_WB * forward_camera(), without);
  const auto mean = [](const InfraredScene& s) {
    double sum = 0;
    for (const float lux : s.light_lx) sum += static_cast<double>(lux);
    return sum / static_cast<double>(s.light_lx.size());
  };
  EXPECT_LT(mean(without), 0.1 * mean(with));
  // Seen light is illuminance times albedo: floors of 15 to 75 lx and lamps in the picture.
  EXPECT_GT(mean(with), 3);
  EXPECT_LT(mean(with), 300);
}

TEST(InfraredShader, GivesTheSameBitsAgain) {
  const worlds::World world = small_forest(6);
  const Scene scene(world);
  InfraredShader first({}, world, scene, kCamera), second({}, world, scene, kCamera);
  RandomStream random(6, "poses");
  const Pose a = flying_pose(world, random) * forward_camera();
  const Pose b = flying_pose(world, random) * forward_camera();
  InfraredScene one, other, again;
  first.draw(a, one);
  second.draw(b, other);
  second.draw(a, again);
  EXPECT_EQ(one.light_lx, again.light_lx);
  EXPECT_EQ(one.inverse_depth, again.inverse_depth);
  EXPECT_NE(one.light_lx, other.light_lx);
}

}  // namespace
}  // namespace arex::sim
