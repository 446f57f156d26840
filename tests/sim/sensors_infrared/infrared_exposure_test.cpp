#include "sensors/infrared_exposure.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace arex::sim {
namespace {

/// Grey value of an even scene of this illuminance, without noise.
double grey_of(const InfraredSensorConfig& config, double lux, const InfraredExposure& exposure) {
  const double electrons =
      std::min(lux * config.sensitivity_e_per_lx_s * exposure.exposure_s, config.full_well_e);
  return std::min(255.0, electrons * exposure.gain * 255 / config.full_well_e);
}

/// Frames until the mean stays within 10 % of its target; -1: it does not within 40.
int frames_to_settle(const InfraredSensorConfig& config, AutoExposure& exposure, double lux) {
  int settled = -1;
  for (int i = 0; i < 40; ++i) {
    const InfraredExposure taken = exposure.next();
    const double grey = grey_of(config, lux, taken);
    if (std::abs(grey / config.mean_target - 1) > 0.1) {
      settled = -1;
    } else if (settled < 0) {
      settled = i;
    }
    exposure.add(grey, taken);
  }
  return settled;
}

// The ramp of the garage: from 20 lx to 20,000 and back, at 10 Hz within a second.
TEST(AutoExposure, SettlesWithinASecondAfterStepsOfLight) {
  const InfraredSensorConfig config;
  AutoExposure exposure(config);
  EXPECT_GE(frames_to_settle(config, exposure, 20), 0);
  for (const double lux : {20'000.0, 20.0, 300.0, 3.0, 5'000.0}) {
    const int frames = frames_to_settle(config, exposure, lux);
    EXPECT_GE(frames, 0) << lux;
    EXPECT_LE(frames, 9) << lux;
  }
}

TEST(AutoExposure, ApproachesWithoutOvershoot) {
  const InfraredSensorConfig config;
  AutoExposure exposure(config);
  double last = 0;
  for (int i = 0; i < 30; ++i) {
    const double grey = grey_of(config, 8, exposure.next());
    EXPECT_GE(grey, last);
    EXPECT_LE(grey, config.mean_target * 1.05);
    last = grey;
    exposure.add(grey, exposure.next());
  }
  EXPECT_NEAR(last, config.mean_target, 0.05 * config.mean_target);
}

TEST(AutoExposure, UsesGainOnlyAtTheLimitOfExposure) {
  InfraredSensorConfig config;
  config.exposure_limit_s = 0.003;
  config.exposure_s = 0.003;
  AutoExposure exposure(config);
  for (const double lux : {0.0, 1.0, 10.0, 100.0, 1e3, 1e4, 1e5, 1e6}) {
    frames_to_settle(config, exposure, lux);
    const InfraredExposure& next = exposure.next();
    EXPECT_LE(next.exposure_s, config.exposure_limit_s);
    EXPECT_GE(next.exposure_s, config.min_exposure_s);
    EXPECT_LE(next.gain, config.gain_limit);
    EXPECT_GE(next.gain, 1);
    if (next.gain > 1.02) EXPECT_DOUBLE_EQ(next.exposure_s, config.exposure_limit_s);
  }
}

TEST(AutoExposure, StaysWhereItIsPutWithoutIt) {
  InfraredSensorConfig config;
  config.auto_exposure = false;
  config.exposure_s = 0.002;
  config.gain = 3;
  AutoExposure exposure(config);
  exposure.add(255, exposure.next());
  exposure.add(0, exposure.next());
  EXPECT_EQ(exposure.next().exposure_s, 0.002);
  EXPECT_EQ(exposure.next().gain, 3);
}

TEST(AutoExposure, LooksAtTheMiddleOfTheImage) {
  std::vector<std::uint8_t> grey(80 * 40, 10);
  for (int v = 10; v < 30; ++v) {
    for (int u = 20; u < 60; ++u) grey[static_cast<std::size_t>(80 * v + u)] = 200;
  }
  EXPECT_DOUBLE_EQ(central_mean(grey, 80, 40), 200);
}

}  // namespace
}  // namespace arex::sim
