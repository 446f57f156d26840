#include "synthetic_flight.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace arex::test {
namespace {

SyntheticConfig noisy(double pixel_std, std::uint64_t seed) {
  SyntheticConfig config;
  config.pixel_std = pixel_std;
  config.seed = seed;
  config.imu = SensorNoise{};
  config.imu.vibration = 0;
  return config;
}

VisualInertialConfig knowing(double pixel_std) {
  VisualInertialConfig config = synthetic_defaults();
  config.window.pixel_std = pixel_std;
  // Each eye has noise of its own here, and an outlier is one by more than that.
  config.window.disparity_std = std::sqrt(2.0) * pixel_std;
  config.window.outlier_px = std::max(config.window.outlier_px, 3 * pixel_std);
  return config;
}

TEST(SyntheticFlight, IsExactWithoutNoise) {
  SyntheticConfig config;
  config.seed = 2;
  const SyntheticFlight flight = synthesise(config);
  const SyntheticRun run = fly(flight, knowing(0.02));
  // What 200 Hz leave of the motion between two samples.
  EXPECT_LT(run.ate_m, 2e-3);
  EXPECT_LT(run.worst_yaw_rad, 2e-4);
  EXPECT_TRUE(run.faults.empty());
  EXPECT_EQ(run.fast.back().status, OdometryStatus::kOk);
}

/// Mean of the errors in percent of the path, and of the NEES, over three seeds.
struct Mean {
  double percent = 0, nees = 0;
};
Mean mean_of(double pixel_std, bool first_estimates = true) {
  Mean mean;
  constexpr int kSeeds = 3;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const SyntheticFlight flight = synthesise(noisy(pixel_std, seed));
    VisualInertialConfig config = knowing(pixel_std);
    config.window.first_estimates = first_estimates;
    const SyntheticRun run = fly(flight, config);
    mean.percent += 100 * run.ate_m / flight.path_m / kSeeds;
    mean.nees += run.nees_position / kSeeds;
    EXPECT_EQ(run.fast.back().status, OdometryStatus::kOk);
    EXPECT_LT(run.worst_yaw_rad, 0.02);
    EXPECT_TRUE(run.faults.empty()) << run.faults.front();
  }
  return mean;
}

// Perfect association; position NEES has three degrees of freedom.
TEST(SyntheticFlight, IsAccurateAndConsistentAtATenthOfAPixel) {
  const Mean mean = mean_of(0.1);
  EXPECT_LT(mean.percent, 0.1);
  EXPECT_LT(mean.nees, 10);
}

TEST(SyntheticFlight, IsAccurateAndConsistentAtThreeTenthsOfAPixel) {
  const Mean mean = mean_of(0.3);
  EXPECT_LT(mean.percent, 0.2);
  EXPECT_LT(mean.nees, 10);
}

TEST(SyntheticFlight, IsAccurateAndConsistentAtAPixel) {
  const Mean mean = mean_of(1.0);
  EXPECT_LT(mean.percent, 0.6);
  EXPECT_LT(mean.nees, 10);
}

TEST(SyntheticFlight, StaysRegularWithoutFirstEstimates) {
  EXPECT_LT(mean_of(0.1, false).nees, 30);
}

TEST(SyntheticFlight, NeedsTheRightEyeOnEveryFourthImageOnly) {
  SyntheticConfig config = noisy(0.3, 4);
  config.right_every = 4;
  const SyntheticFlight flight = synthesise(config);
  const SyntheticRun run = fly(flight, knowing(0.3));
  EXPECT_LT(100 * run.ate_m / flight.path_m, 0.35);
}

// Frames that are no keyframes are forgotten; were these the ones that both eyes saw, each second
// estimate would know of no disparity.
TEST(SyntheticFlight, KeepsTheFramesThatBothEyesSaw) {
  SyntheticConfig config = noisy(0.3, 4);
  config.right_every = 2;
  const SyntheticFlight flight = synthesise(config);
  const SyntheticRun run = fly(flight, knowing(0.3));
  int keyframes = 0, seen_by_both = 0;
  for (std::size_t i = 0; i < run.updates.size(); ++i) {
    if (!run.updates[i].window.keyframe) continue;
    ++keyframes;
    seen_by_both += flight.frames[i].features.front().right.has_value();
  }
  EXPECT_GT(keyframes, 30);
  EXPECT_EQ(seen_by_both, keyframes);
}

TEST(SyntheticFlight, FindsItsClockAndTellsIt) {
  for (const double offset_s : {-0.01, 0.01}) {
    SyntheticConfig config = noisy(0.3, 5);
    config.clock_offset_s = offset_s;
    const SyntheticFlight flight = synthesise(config);
    const SyntheticRun run = fly(flight, knowing(0.3));
    EXPECT_NEAR(run.updates.back().camera.t_d, -offset_s, 0.0015);
    EXPECT_LT(100 * run.ate_m / flight.path_m, 0.35);
    ASSERT_FALSE(run.faults.empty());
    // Told as soon as it is sure, which is before it is as near as above.
    const std::string& told = run.faults.front();
    EXPECT_EQ(told.substr(0, 13), "camera clock ") << told;
    EXPECT_NEAR(std::stod(told.substr(13)), 10, 1.5) << told;
    EXPECT_TRUE(told.ends_with(offset_s > 0 ? " ms ahead" : " ms behind")) << told;
  }
}

TEST(SyntheticFlight, FindsItsMountAndTellsIt) {
  for (const double error_rad : {-0.0175, 0.0175}) {
    SyntheticConfig config = noisy(0.3, 6);
    config.mount_error_rad = Vec3(0, 0, error_rad);  // about the optical axis
    const SyntheticFlight flight = synthesise(config);
    const SyntheticRun run = fly(flight, knowing(0.3));
    const Mat3 found = camera_mount().R.transpose() * run.updates.back().camera.X_BC.R;
    EXPECT_LT((so3::Log(found) - config.mount_error_rad).norm(), 0.005);
    ASSERT_FALSE(run.faults.empty());
    EXPECT_EQ(run.faults.front().substr(0, 19), "camera mount turned");
  }
}

TEST(SyntheticFlight, GivesTheSameEachTime) {
  const SyntheticFlight flight = synthesise(noisy(0.3, 7));
  const SyntheticRun once = fly(flight, knowing(0.3)), again = fly(flight, knowing(0.3));
  ASSERT_EQ(once.fast.size(), again.fast.size());
  EXPECT_EQ(once.fast.back().X_OB.p, again.fast.back().X_OB.p);
  EXPECT_EQ(once.fast.back().covariance, again.fast.back().covariance);
}

}  // namespace
}  // namespace arex::test
