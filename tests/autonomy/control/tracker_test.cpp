#include "control/tracker.h"

#include <gtest/gtest.h>

#include "config/config.h"
#include "math/random.h"
#include "math/so3.h"

namespace arex {
namespace {

constexpr double kWeight = 1.9 * kGravity;

TrackerConfig pure_pd() {
  TrackerConfig config;
  config.observe_disturbance = false;
  return config;
}

Odometry at(const Vec3& p, const Vec3& v, const Mat3& R = Mat3::Identity()) {
  Odometry odometry;
  odometry.X_OB = {R, p};
  odometry.v_OB = v;
  return odometry;
}

TEST(Tracker, EquilibriumAsksForTheWeightUpright) {
  Tracker tracker({}, {});
  TrajectorySetpoint setpoint;
  setpoint.p_OB = {1, 2, 3};
  setpoint.yaw_rad = 0.9;
  setpoint.yaw_rate_radps = 0.2;
  const auto out = tracker.update(setpoint, at({1, 2, 3}, Vec3::Zero()), true);
  EXPECT_LT((out.force_O - Vec3(0, 0, kWeight)).norm(), 1e-12);
  EXPECT_NEAR(out.thrust_n, kWeight, 1e-12);
  EXPECT_LT((out.R_OB_desired - so3::from_yaw(0.9)).norm(), 1e-12);
  EXPECT_EQ(out.yaw_rate_radps, 0.2);
}

TEST(Tracker, ErrorsGiveThePdForceAndThrustIsItsPartAlongBodyZ) {
  const TrackerConfig config = pure_pd();
  Tracker tracker(config, {});
  RandomStream random(1, "tracker");
  for (int i = 0; i < 200; ++i) {
    TrajectorySetpoint setpoint;
    setpoint.p_OB = random.normal3();
    setpoint.v_OB = random.normal3();
    setpoint.a_OB = random.normal3();
    setpoint.yaw_rad = random.uniform(-3, 3);
    const Vec3 e_p = 0.2 * random.normal3(), e_v = 0.2 * random.normal3();
    const Mat3 R = so3::Exp(0.2 * random.normal3());
    const auto out =
        tracker.update(setpoint, at(setpoint.p_OB - e_p, setpoint.v_OB - e_v, R), true);
    const Vec3 force = Vec3(0, 0, kWeight) + config.position_gain.cwiseProduct(e_p) +
                       config.velocity_gain.cwiseProduct(e_v) + 1.9 * setpoint.a_OB;
    ASSERT_LT((out.force_O - force).norm(), 1e-12);
    EXPECT_NEAR(out.thrust_n, force.dot(R.col(2)), 1e-12);
    EXPECT_LT((out.R_OB_desired.col(2) - force.normalized()).norm(), 1e-12);
    EXPECT_LT((out.R_OB_desired.transpose() * out.R_OB_desired - Mat3::Identity()).norm(), 1e-12);
    // The nose's horizontal direction is off by the lean only: x has no part across the heading.
    const Vec3 left(-std::sin(setpoint.yaw_rad), std::cos(setpoint.yaw_rad), 0);
    EXPECT_NEAR(out.R_OB_desired.col(0).dot(out.R_OB_desired.col(2)), 0, 1e-12);
    EXPECT_GT(out.R_OB_desired.col(1).dot(left), 0);
    EXPECT_NEAR(out.R_OB_desired.col(1).dot(
                    Vec3(std::cos(setpoint.yaw_rad), std::sin(setpoint.yaw_rad), 0)),
                0, 1e-12);
  }
}

TEST(Tracker, TiltAndLiftStayWithinLimits) {
  const TrackerConfig config;
  RandomStream random(2, "tracker");
  Tracker tracker(config, {});
  for (int i = 0; i < 2000; ++i) {
    TrajectorySetpoint setpoint;
    setpoint.p_OB = 10 * random.normal3();
    const auto out = tracker.update(setpoint, at(Vec3::Zero(), 3 * random.normal3()), true);
    const double tilt = std::atan2(out.force_O.head<2>().norm(), out.force_O.z());
    ASSERT_LE(tilt, config.tilt_limit_rad + 1e-9);
    ASSERT_GE(out.force_O.z(), config.min_lift_fraction * kWeight - 1e-9);
    ASSERT_LE(out.force_O.z(), config.max_lift_fraction * kWeight + 1e-9);
    ASSERT_GE(out.thrust_n, 0);
  }
}

/// A point mass whose force follows the demand with the inner loop's lag, in a constant wind force.
struct PointMass {
  Vec3 p = Vec3::Zero(), v = Vec3::Zero(), force{0, 0, kWeight};
  void step(const Vec3& demand, const Vec3& disturbance, double lag_s) {
    for (int i = 0; i < 10; ++i) {
      force += (demand - force) * 1e-3 / lag_s;
      v += (force + disturbance - Vec3(0, 0, kWeight)) / 1.9 * 1e-3;
      p += v * 1e-3;
    }
  }
};

TEST(Tracker, PdStandsOffByForceOverGainAndTheObserverTakesItAway) {
  const Vec3 wind_force(0.8, -0.5, -0.6);
  for (const bool observe : {false, true}) {
    TrackerConfig config;
    config.observe_disturbance = observe;
    Tracker tracker(config, {});
    PointMass mass;
    for (int i = 0; i < 2000; ++i) {
      const auto out = tracker.update({}, at(mass.p, mass.v), true);
      mass.step(out.force_O, wind_force, 0.15);
    }
    if (observe) {
      EXPECT_LT(mass.p.norm(), 1e-4);
      EXPECT_LT((tracker.disturbance_n() - wind_force).norm(), 1e-3);
    } else {
      const Vec3 offset = wind_force.cwiseQuotient(config.position_gain);
      EXPECT_LT((mass.p - offset).norm(), 1e-4);
    }
  }
}

TEST(Tracker, ObserverIsBoundedAndStandsStillOnTheGround) {
  const TrackerConfig config;
  Tracker tracker(config, {});
  TrajectorySetpoint setpoint;
  for (int i = 0; i < 1000; ++i)
    (void)tracker.update(setpoint, at(Vec3::Zero(), Vec3::Zero()), false);
  EXPECT_EQ(tracker.disturbance_n().norm(), 0);
  for (int i = 0; i < 3000; ++i) {  // held fast while asked to climb
    setpoint.p_OB.z() = 5;
    (void)tracker.update(setpoint, at(Vec3::Zero(), Vec3::Zero()), true);
  }
  EXPECT_NEAR(tracker.disturbance_n().z(), -config.observer_limit_n, 1e-9);
  tracker.reset();
  EXPECT_EQ(tracker.disturbance_n().norm(), 0);
}

TEST(HeadingBetween, FindsTheYawAndLeavesBothTiltsOut) {
  RandomStream random(3, "heading");
  for (int i = 0; i < 200; ++i) {
    const double yaw = random.uniform(-3.1, 3.1);
    const Mat3 R_OB = so3::Exp({0, 0, random.uniform(-3, 3)}) * so3::Exp(0.3 * random.normal3());
    const Mat3 exact = heading_between(so3::from_yaw(yaw) * R_OB, R_OB);
    EXPECT_LT((exact - so3::from_yaw(yaw)).norm(), 1e-12);
    // A small tilt error of either estimate leaves a pure yaw, changed to second order only.
    const Vec3 tilt(0.03 * random.normal(), 0.03 * random.normal(), 0);
    const Mat3 R_AO = heading_between(so3::Exp(tilt) * so3::from_yaw(yaw) * R_OB, R_OB);
    EXPECT_NEAR(R_AO(2, 2), 1, 1e-15);
    EXPECT_LT(so3::angle(R_AO.transpose() * so3::from_yaw(yaw)), tilt.squaredNorm() + 1e-9);
  }
}

TEST(TrackerConfig, DefaultsKeepTheirOwnRules) {
  TrackerConfig config;
  ConfigNode empty;
  empty.kind = ConfigNode::Kind::kMap;
  EXPECT_NO_THROW(read_config(empty, config));
}

}  // namespace
}  // namespace arex
