#include "sensors/infrared_pair.h"

#include <gtest/gtest.h>

#include <thread>

#include "../sensors_depth/depth_scenes.h"
#include "jobs/job_queue.h"
#include "worlds/garage.h"

namespace arex::sim {
namespace {

InfraredShot shot_at(const worlds::World& world, RandomStream& random, Stamp stamp) {
  InfraredShot shot;
  shot.stamp = stamp;
  shot.X_WB = flying_pose(world, random);
  shot.v_WB = random.normal3();
  shot.w_WB_B = 0.5 * random.normal3();
  shot.exposure = {0.0005, 1.5};
  return shot;
}

TEST(InfraredPair, AFrameDependsOnNothingButItsSeedAndShot) {
  const worlds::World world = small_forest(1);
  const Scene scene(world);
  const Pose X_BC = VehicleConfig{}.X_BC();
  const D430Config unit = D430Config{}.as_built(7);
  InfraredPair every({}, unit, world, scene, X_BC, 7), sparse({}, unit, world, scene, X_BC, 7);
  InfraredPair other_seed({}, unit, world, scene, X_BC, 8);
  RandomStream random(1, "shots");
  for (Stamp frame = 0; frame < 4; ++frame) {
    InfraredShot shot = shot_at(world, random, frame * kNanosecondsPerSecond / 10);
    const auto image = every.capture(shot);
    EXPECT_EQ(image->time_ns, shot.stamp);
    EXPECT_EQ(image->width, 848);
    EXPECT_EQ(image->left.size(), 848U * 480U);
    EXPECT_EQ(image->camera.f_px, unit.focal_px);
    EXPECT_NE(image->left, image->right);
    if (frame % 2 == 0) continue;  // this pair is read at half the rate, and on another thread
    StereoImagePtr late;
    std::thread([&] { late = sparse.capture(shot); }).join();
    EXPECT_EQ(image->left, late->left);
    EXPECT_EQ(image->right, late->right);
    EXPECT_NE(image->left, other_seed.capture(shot)->left);
    InfraredShot longer = shot;
    longer.exposure.exposure_s *= 2;
    EXPECT_NE(image->left, every.capture(longer)->left);
    // Without the right eye the left one's image is the same.
    shot.right = false;
    const auto alone = every.capture(shot);
    EXPECT_EQ(image->left, alone->left);
    EXPECT_TRUE(alone->right.empty());
  }
}

TEST(InfraredPair, AFrameIsTheSameInHoweverManyStripsAndOnHoweverManyThreads) {
  worlds::GarageRecipe garage;
  garage.length_m = 50;
  garage.width_m = 30;
  for (const worlds::World& world : {small_forest(2), worlds::build(garage, 2)}) {
    const Scene scene(world);
    const Pose X_BC = VehicleConfig{}.X_BC();
    const D430Config unit = D430Config{}.as_built(3);
    InfraredPair whole({}, unit, world, scene, X_BC, 3);
    for (const int threads : {2, 3}) {
      JobQueue jobs(threads);
      const auto lane = jobs.add_lane("infrared");
      InfraredPair cut({}, unit, world, scene, X_BC, 3, 2 * threads);
      const auto split = [&](std::size_t count, const std::function<void(std::size_t)>& piece) {
        jobs.split(count, piece);
      };
      RandomStream random(2, "shots");
      for (Stamp frame = 0; frame < 3; ++frame) {
        const InfraredShot shot = shot_at(world, random, frame * kNanosecondsPerSecond / 10);
        const auto image = whole.capture(shot);
        StereoImagePtr together;
        jobs.schedule(lane, frame, [&]() -> JobQueue::Delivery {
          together = cut.capture(shot, split);
          return nullptr;
        });
        jobs.advance(frame);
        EXPECT_EQ(image->left, together->left);
        EXPECT_EQ(image->right, together->right);
      }
    }
  }
}

TEST(InfraredPair, LooksWhereTheDepthCameraLooks) {
  // A lit wall ahead of the mount, nothing behind it.
  const worlds::World world = plane_world({4, 0, 0}, Vec3::UnitX(), 3);
  const Scene scene(world);
  const Pose X_BC = VehicleConfig{}.X_BC();
  InfraredPair pair({}, D430Config{}.as_built(1), world, scene, X_BC, 1);
  InfraredShot shot;
  static_cast<void>(pair.capture(shot));
  const auto middle = static_cast<std::size_t>(240 * 848 + 424);
  EXPECT_NEAR(1 / static_cast<double>(pair.left_scene().inverse_depth[middle]), 3.86, 1e-3);
  shot.X_WB.R = so3::from_yaw(3.1);
  static_cast<void>(pair.capture(shot));
  EXPECT_EQ(pair.left_scene().inverse_depth[middle], 0);
}

TEST(InfraredPair, ErrorsOfClockAndMountAreInTheImageOnly) {
  const worlds::World world = plane_world({4, 0, 0}, Vec3::UnitX(), 3);
  const Scene scene(world);
  const Pose X_BC = VehicleConfig{}.X_BC();
  InfraredConfig config;
  config.clock_offset_s = 0.01;
  config.mount_error_rad = {0.02, 0, 0};
  config.sensor.noise_free = true;
  InfraredPair off(config, D430Config{}.as_built(1), world, scene, X_BC, 1);
  config.mount_error_rad.setZero();
  InfraredPair right(config, D430Config{}.as_built(1), world, scene, X_BC, 1);
  InfraredShot shot;
  shot.stamp = kNanosecondsPerSecond;
  const auto image = off.capture(shot);
  EXPECT_EQ(image->time_ns, shot.stamp + 10'000'000);
  EXPECT_NE(image->left, right.capture(shot)->left);
  // A camera that looks 0.02 rad too high sees what one turned by as much sees.
  shot.X_WB.R = X_BC.R * so3::Exp({0.02, 0, 0}) * X_BC.R.transpose();
  shot.X_WB.p = X_BC.p - shot.X_WB.R * X_BC.p;
  const auto turned = right.capture(shot);
  int different = 0;
  for (std::size_t i = 0; i < image->left.size(); ++i) {
    different += std::abs(image->left[i] - turned->left[i]) > 1;
  }
  EXPECT_LT(different, 500);
}

}  // namespace
}  // namespace arex::sim
