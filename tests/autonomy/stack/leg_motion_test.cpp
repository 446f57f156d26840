#include "stack/leg_motion.h"

#include <gtest/gtest.h>

#include "autonomy/planning/test_grid.h"
#include "math/so3.h"

namespace arex {
namespace {

constexpr Stamp kPeriod = kNanosecondsPerSecond / 100;
using Kind = MotionRequest::Kind;

Odometry at(const Vec3& p_OB, double yaw_rad = 0) {
  Odometry odometry;
  odometry.status = OdometryStatus::kOk;
  odometry.X_OB = {so3::from_yaw(yaw_rad), p_OB};
  return odometry;
}

TEST(LegMotion, WithoutAPositionToHoldTheSetpointGoesWithTheVehicle) {
  for (const Kind kind : {Kind::kLevel, Kind::kDescend}) {
    LegMotion legs(TimedPathConfig{}, CautionConfig{});
    for (int k = 0; k < 300; ++k) {
      const Vec3 p(0.01 * k, -0.02 * k, 1 + 0.001 * k);
      const TrajectorySetpoint setpoint =
          legs.update(k * kPeriod, {kind, Vec3::Zero()}, at(p, 0.01 * k), true);
      ASSERT_LT((setpoint.p_OB - p).norm(), 1e-9);
      ASSERT_NEAR(setpoint.yaw_rad, 0.01 * k, 1e-9);
      ASSERT_EQ(setpoint.v_OB, Vec3::Zero().eval());
    }
  }
}

TEST(LegMotion, AfterAJumpTheLegIsFlownFromWhereTheVehicleIs) {
  LegMotion legs(TimedPathConfig{}, CautionConfig{});
  const MotionRequest leg{Kind::kLeg, {10, 0, 1}};
  Stamp now = 0;
  for (; now < from_seconds(4); now += kPeriod) (void)legs.update(now, leg, at({2, 0, 1}), true);
  TrajectorySetpoint found;
  found.p_OB = {3, 2, 1};
  found.yaw_rad = 0.1;
  legs.start_again(found);
  const TrajectorySetpoint first = legs.update(now, leg, at(found.p_OB, 0.1), true);
  EXPECT_LT((first.p_OB - found.p_OB).norm(), 1e-9);
  EXPECT_LT(first.v_OB.norm(), 1e-9);
  TrajectorySetpoint last = first;
  for (int k = 0; k < 2000; ++k) {
    now += kPeriod;
    const TrajectorySetpoint next = legs.update(now, leg, at(last.p_OB), true);
    ASSERT_LT((next.p_OB - last.p_OB).norm(), 0.02);  // 1.5 m/s
    last = next;
  }
  EXPECT_LT((last.p_OB - leg.goal_O).norm(), 1e-6);
}

TEST(LegMotion, StopsBeforeWhatStandsInTheWay) {
  LegMotion legs(TimedPathConfig{}, CautionConfig{});
  test::TestGrid grid(120, 60, 20, 0.1, {-1, -3, 0});
  grid.add_obstacle({70, 29, 0}, {71, 31, 19}, 3);  // a post at x = 6 m
  const MotionRequest leg{Kind::kLeg, {10, 0, 1}};
  Stamp now = 0;
  Vec3 p(0, 0, 1);
  const auto fly = [&](double seconds) {
    for (const Stamp end = now + from_seconds(seconds); now < end; now += kPeriod) {
      p = legs.update(now, leg, at(p), true).p_OB;
      legs.look_ahead(grid.view(), 0.305);
    }
  };
  fly(20);
  EXPECT_TRUE(legs.blocked());
  EXPECT_GT(p.x(), 2.5);
  EXPECT_LT(p.x(), 6 - 0.305);
  grid.forget({66, 25, 0}, {75, 35, 19});  // it has gone away
  fly(20);
  EXPECT_FALSE(legs.blocked());
  EXPECT_LT((p - leg.goal_O).norm(), 1e-6);
}

}  // namespace
}  // namespace arex
