#include "sensors/d430.h"

#include <gtest/gtest.h>

#include <cmath>
#include <thread>

#include "depth_scenes.h"

namespace arex::sim {
namespace {

TEST(D430, AFrameDependsOnNothingButItsSeedStampAndPose) {
  const worlds::World world = small_forest(1);
  const Pose X_BC = VehicleConfig{}.X_BC();
  D430 every({}, world, X_BC, 7), sparse({}, world, X_BC, 7), other_seed({}, world, X_BC, 8);
  RandomStream random(1, "poses");
  for (Stamp frame = 0; frame < 6; ++frame) {
    const Stamp stamp = frame * kNanosecondsPerSecond / 30;
    const Pose X_WB = flying_pose(world, random);
    const DepthImagePtr image = every.capture(stamp, X_WB);
    EXPECT_EQ(image->stamp, stamp);
    EXPECT_EQ(image->camera.width, 848);
    if (frame % 3 != 2) continue;  // this device is read at 10 Hz, and on another thread
    DepthImagePtr late;
    std::thread([&] { late = sparse.capture(stamp, X_WB); }).join();
    EXPECT_EQ(image->depth_m, late->depth_m);
    EXPECT_NE(image->depth_m, other_seed.capture(stamp, X_WB)->depth_m);
    EXPECT_NE(image->depth_m, every.capture(stamp + 1, X_WB)->depth_m);
  }
}

TEST(D430, LooksWhereItIsMounted) {
  // A wall 3 m ahead of B's origin; the left imager sits 0.14 m ahead of it.
  const worlds::World world = plane_world({3, 0, 0}, Vec3::UnitX(), 20);
  D430Config config;
  config.noise_free = true;
  D430 device(config, world, VehicleConfig{}.X_BC(), 1);
  const DepthImagePtr image = device.capture(0, {});
  EXPECT_NEAR(static_cast<double>(image->at(424, 240)), 2.86, 1e-4);
  // Turned left by 30 degrees, the wall recedes to the left of the image.
  const DepthImagePtr turned = device.capture(0, {so3::from_yaw(0.5), Vec3::Zero()});
  EXPECT_GT(turned->at(200, 240), turned->at(600, 240));
  // Pitched down (nose towards the floor), the wall recedes at the bottom.
  const DepthImagePtr pitched = device.capture(0, {so3::Exp({0, 0.5, 0}), Vec3::Zero()});
  EXPECT_GT(pitched->at(424, 400), pitched->at(424, 80));
}

TEST(D430, NoisyFrameOfAWallFollowsTheModel) {
  const worlds::World world = plane_world({3, 0, 0}, Vec3::UnitX(), 20);
  D430Config config;
  config.disparity_bias_px = config.disparity_bias_spread_px = 0;
  D430 device(config, world, forward_camera(), 3);
  const DepthImagePtr image = device.capture(0, {});
  double squares = 0;
  int n = 0;
  for (int v = 0; v < 480; ++v) {
    for (int u = 20; u < 848; ++u) {
      const double z = static_cast<double>(image->at(u, v));
      ASSERT_GT(z, 0);
      squares += (z - 3) * (z - 3);
      ++n;
    }
  }
  EXPECT_NE(image->camera.fx, 422.6);  // this unit's own
  const double model = 9 * 0.08 / (image->camera.fx * 0.050);
  EXPECT_NEAR(std::sqrt(squares / n) / model, 1, 0.05);
}

TEST(D430, KeepsItsViewWhileItHardlyMoves) {
  const worlds::World world = plane_world({3, 0, 0}, Vec3::UnitX(), 20);
  D430 device({}, world, forward_camera(), 3);
  const auto rms_between = [&](const Pose& a, const Pose& b) {
    const DepthImagePtr first = device.capture(0, a), second = device.capture(1, b);
    double squares = 0;
    int n = 0;
    for (int v = 0; v < 480; ++v) {
      for (int u = 40; u < 848; ++u) {
        squares += std::pow(static_cast<double>(first->at(u, v) - second->at(u, v)), 2);
        ++n;
      }
    }
    return std::sqrt(squares / n);
  };
  const Pose here, nearby{Mat3::Identity(), {0, 0.01, 0}}, away{Mat3::Identity(), {0, 0.3, 0}};
  EXPECT_LT(rms_between(here, nearby), 0.017);
  EXPECT_GT(rms_between(here, away), 0.035);
  EXPECT_LT(rms_between(away, away), 0.017);
}

}  // namespace
}  // namespace arex::sim
