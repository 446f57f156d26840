#include "sensors/infrared_projector.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "../sensors_depth/depth_scenes.h"
#include "sensors/d430_stereo.h"
#include "sensors/infrared_imager.h"
#include "sensors/infrared_shader.h"

namespace arex::sim {
namespace {

const PinholeCamera kCamera = D430Config{}.camera();
constexpr double kBaseline = 0.05;

/// Nothing lights but the projector.
InfraredLightConfig dots_alone() {
  InfraredLightConfig light;
  light.sun = false;
  light.sky_lx = 0;
  light.projector = true;
  return light;
}

std::size_t at(int u, int v) { return static_cast<std::size_t>(v * kCamera.width + u); }

/// The mean of |a(u, v) - b(u - shift, v)| over that of a.
double difference(const std::vector<float>& a, const std::vector<float>& b, int shift) {
  double sum = 0, mean = 0;
  for (int v = 60; v < 420; ++v) {
    for (int u = 100; u < 750; ++u) {
      sum += static_cast<double>(std::abs(a[at(u, v)] - b[at(u - shift, v)]));
      mean += static_cast<double>(a[at(u, v)]);
    }
  }
  return sum / mean;
}

TEST(DotProjector, SpreadsItsPowerOverItsField) {
  const DotProjector projector(dots_alone());
  double inside = 0, outside = 0, most = 0;
  constexpr int kSide = 3000;
  for (int i = 0; i < kSide; ++i) {
    for (int j = 0; j < kSide; ++j) {
      const double a = -1.2 + 2.4 * i / kSide, b = -1.2 + 2.4 * j / kSide;
      const double lx = projector.at(static_cast<float>(a), static_cast<float>(b));
      const bool within = std::atan(std::abs(a)) < 43.0 / 180 * std::numbers::pi &&
                          std::atan(std::abs(b)) < 28.5 / 180 * std::numbers::pi;
      (within ? inside : outside) += lx * (2.4 / kSide) * (2.4 / kSide);
      most = std::max(most, lx);
    }
  }
  // 0.36 W, 100 lx for 1 W/m^2, at a depth of 1 m.
  EXPECT_NEAR(inside, 36, 0.5);
  EXPECT_LT(outside, 0.05);
  EXPECT_GT(most, 10 * static_cast<double>(projector.mean_lx()));
}

TEST(DotProjector, LightsAWallLessTheFurtherItIs) {
  double nearest = 0;
  for (const double z : {1.0, 2.0, 4.0}) {
    const worlds::World world = plane_world({z, 0, 0}, Vec3::UnitX(), 30);
    const Scene scene(world);
    InfraredShader shader(dots_alone(), world, scene, kCamera);
    InfraredScene seen;
    shader.draw(forward_camera(), seen);
    ASSERT_EQ(seen.steady_lx.size(), seen.light_lx.size());
    EXPECT_EQ(*std::max_element(seen.light_lx.begin(), seen.light_lx.end()), 0);
    double sum = 0;
    int n = 0;
    for (int v = 140; v < 340; ++v) {
      for (int u = 200; u < 648; ++u, ++n) sum += static_cast<double>(seen.steady_lx[at(u, v)]);
    }
    const double albedo = static_cast<double>(world.objects[0].reflectivity);
    const double expected =
        albedo * static_cast<double>(DotProjector(dots_alone()).mean_lx()) / (z * z);
    // A face's albedo is its object's but for a few percent.
    EXPECT_NEAR(sum / n / expected, 1, 0.1) << z;
    if (nearest == 0) nearest = sum / n * z * z;
    EXPECT_NEAR(sum / n * z * z / nearest, 1, 0.02) << z;
  }
}

TEST(DotProjector, DotsLieOnTheWallForBothEyesAndFlyAlongWithThem) {
  for (const int disparity : {4, 10}) {
    const double z = kCamera.fx * kBaseline / disparity;
    const worlds::World world = plane_world({z, 0, 0}, Vec3::UnitX(), 30);
    const Scene scene(world);
    InfraredShader shader(dots_alone(), world, scene, kCamera);
    const Pose X_WC = forward_camera();
    InfraredScene left, right, moved;
    shader.draw(X_WC, left);
    shader.draw(X_WC * Pose{Mat3::Identity(), Vec3(kBaseline, 0, 0)}, right, in_turn,
                DotProjector::kBesideLeftEye_m - kBaseline);
    EXPECT_LT(difference(left.steady_lx, right.steady_lx, disparity), 0.01);
    EXPECT_GT(difference(left.steady_lx, right.steady_lx, disparity + 3), 0.5);
    // Along the wall nothing moves in the image.
    shader.draw(X_WC * Pose{Mat3::Identity(), Vec3(0.3, 0.1, 0)}, moved);
    EXPECT_LT(difference(left.steady_lx, moved.steady_lx, 0), 0.01);
  }
}

TEST(DotProjector, IsDarkUnlessItIsAskedFor) {
  const worlds::World world = plane_world({2, 0, 0}, Vec3::UnitX(), 30);
  const Scene scene(world);
  InfraredShader shader({}, world, scene, kCamera);
  InfraredScene seen;
  shader.draw(forward_camera(), seen);
  EXPECT_TRUE(seen.steady_lx.empty());
}

// The light of things is smeared, that of the dots is not: they stay where they are.
TEST(DotProjector, DotsStaySharpWhileTheCameraMoves) {
  InfraredSensorConfig config;
  config.noise_free = true;
  config.vignetting = 0;
  config.blur_kernel = 0;
  InfraredImager imager(config, kCamera);
  InfraredScene scene;
  scene.light_lx.assign(at(0, kCamera.height), 10);
  scene.inverse_depth.assign(at(0, kCamera.height), 1);
  scene.steady_lx.assign(at(0, kCamera.height), 0);
  scene.steady_lx[at(400, 200)] = 50;
  std::vector<std::uint8_t> grey;
  imager.expose(scene, {0.02, 1}, {{3, 0, 0}, Vec3::Zero()}, 1, grey);
  EXPECT_NEAR(imager.received()[at(400, 200)], 60, 1e-3);
  EXPECT_NEAR(imager.received()[at(401, 200)], 10, 1e-3);
}

}  // namespace
}  // namespace arex::sim
