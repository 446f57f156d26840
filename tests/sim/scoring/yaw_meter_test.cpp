#include "scoring/yaw_meter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "math/so3.h"

namespace arex::sim {
namespace {

constexpr double kRight = std::numbers::pi / 2;

/// Turns about the world's vertical, whichever way the vehicle leans.
void turn(YawMeter& meter, double rate_radps, double seconds, double roll_rad = 0) {
  Truth truth;
  truth.X_WB.R = so3::Exp({roll_rad, 0, 0});
  truth.w_WB_B = truth.X_WB.R.transpose() * Vec3(0, 0, rate_radps);
  const int ticks = static_cast<int>(std::lround(seconds / kSecondsPerTick));
  for (int i = 0; i < ticks; ++i) meter.add(truth);
}

TEST(YawMeter, SumsTurnsOfEitherHandAboutTheVertical) {
  for (const double roll : {0.0, 0.5}) {
    YawMeter meter;
    turn(meter, 1, kRight, roll);
    turn(meter, -2, kRight / 2, roll);
    EXPECT_NEAR(meter.turned_rad(), 2 * kRight, 5e-3) << roll;
    EXPECT_NEAR(meter.fastest_radps(), 2, 1e-9) << roll;
    EXPECT_EQ(meter.spins(), 0) << roll;
  }
  YawMeter rolling;
  Truth truth;
  truth.w_WB_B = Vec3(3, 0, 0);
  for (int i = 0; i < 1000; ++i) rolling.add(truth);
  EXPECT_EQ(rolling.turned_rad(), 0);
  EXPECT_EQ(rolling.spins(), 0);
}

TEST(YawMeter, CountsASpinOnceUntilItHasEnded) {
  YawMeter meter;
  turn(meter, 1.9, 1);  // a planned turn that overshoots
  EXPECT_EQ(meter.spins(), 0);
  turn(meter, 3.4, 0.4);
  turn(meter, 1.9, 0.1);  // not yet over
  turn(meter, 3.4, 0.4);
  EXPECT_EQ(meter.spins(), 1);
  turn(meter, 0.5, 0.1);
  turn(meter, -3.4, 0.4);
  EXPECT_EQ(meter.spins(), 2);
}

}  // namespace
}  // namespace arex::sim
