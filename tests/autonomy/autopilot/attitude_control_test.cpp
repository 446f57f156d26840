#include "autopilot/attitude_control.h"

#include <gtest/gtest.h>

#include <numbers>

#include "autopilot/allocation.h"
#include "autopilot/motor_model.h"
#include "math/random.h"
#include "quad_oracle.h"

namespace arex {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// Attitude and rate loop around the oracle, fed with its true attitude: the control law alone.
class Loop {
 public:
  explicit Loop(const test::QuadOracle::Options& options)
      : quad(1, options),
        motor_({}, {}),
        allocation_(VehicleConfig{}),
        rate_(config),
        filter_(1000, config.gyro_cutoff_hz) {
    quad.p.z() = 100;
  }
  void step(const Mat3& R_desired) {
    const Vec3 w = filter_.update(quad.w);
    const Stamp tick = quad.stamp / kNanosecondsPerTick;
    if (tick % 4 == 0) setpoint = attitude_rate_setpoint(config, quad.R, R_desired, 0);
    if (tick % 2 == 0) {
      const Vec3 torque = rate_.update(setpoint, w);
      const auto result = allocation_.allocate({quad.mass_kg() * kGravity, torque},
                                               motor_.idle_thrust(), motor_.full_thrust(15));
      rate_.integrate(result.achieved.torque_nm);
      for (std::size_t i = 0; i < 4; ++i) {
        command_.throttle[i] =
            motor_.throttle(result.rotor_thrust_n[static_cast<Eigen::Index>(i)], 15);
      }
    }
    quad.step(command_);
  }

  AttitudeControlConfig config;
  test::QuadOracle quad;
  Vec3 setpoint = Vec3::Zero();

 private:
  MotorModel motor_;
  Allocation allocation_;
  RateControl rate_;
  LowPass filter_;
  MotorCommand command_;
};

TEST(AttitudeRateSetpoint, IsProportionalForSmallErrorsAboutEachAxis) {
  const AttitudeControlConfig config;
  RandomStream random(3, "attitude");
  for (int i = 0; i < 20; ++i) {
    const Mat3 R = so3::Exp(random.normal3());
    for (int axis = 0; axis < 3; ++axis) {
      const double error = 1e-4;
      const Vec3 rate =
          attitude_rate_setpoint(config, R, R * so3::Exp(error * Vec3::Unit(axis)), 0);
      const Vec3 expected = config.attitude_p[axis] * error * Vec3::Unit(axis);
      EXPECT_LT((rate - expected).norm(), 1e-6 * config.attitude_p[axis]);
    }
  }
}

TEST(AttitudeRateSetpoint, StaysWithinLimitsAndTurnsTheThrustFirst) {
  const AttitudeControlConfig config;
  RandomStream random(4, "attitude");
  for (int i = 0; i < 2000; ++i) {
    const Mat3 R = so3::Exp(random.normal3()), R_desired = so3::Exp(random.normal3());
    const Vec3 rate = attitude_rate_setpoint(config, R, R_desired, random.normal());
    EXPECT_LE(rate.head<2>().cwiseAbs().maxCoeff(), config.tilt_rate_limit_radps);
    EXPECT_LE(std::abs(rate.z()), config.yaw_rate_limit_radps);
  }
  // A heading error alone, however large, asks for no roll or pitch.
  for (const double yaw : {-3.1, -1.0, 0.5, 3.1}) {
    const Vec3 rate = attitude_rate_setpoint(config, Mat3::Identity(), so3::from_yaw(yaw), 0);
    EXPECT_LT(rate.head<2>().norm(), 1e-9);
    EXPECT_GT(rate.z() * yaw, 0);
  }
}

TEST(AttitudeRateSetpoint, YawRateIsAboutTheVertical) {
  const AttitudeControlConfig config;
  const Mat3 R = so3::Exp({0.4, -0.3, 1.0});
  const Vec3 rate = attitude_rate_setpoint(config, R, R, 0.7);
  EXPECT_LT((R * rate - Vec3(0, 0, 0.7)).norm(), 1e-7);
}

TEST(LimitTilt, BoundsTheTiltAndKeepsItsDirection) {
  RandomStream random(5, "tilt");
  for (int i = 0; i < 500; ++i) {
    const Mat3 R = so3::Exp(1.5 * random.normal3());
    const Mat3 limited = limit_tilt(R, 0.7);
    const double before = std::acos(std::clamp(R(2, 2), -1.0, 1.0));
    const double after = std::acos(std::clamp(limited(2, 2), -1.0, 1.0));
    EXPECT_NEAR(after, std::min(before, 0.7), 1e-9);
    EXPECT_NEAR(R(0, 2) * limited(1, 2) - R(1, 2) * limited(0, 2), 0, 1e-12);
    EXPECT_GE(R(0, 2) * limited(0, 2), -1e-12);
  }
}

/// 10 % to 90 % rise, overshoot and error after 3 s of a step about one axis.
struct Response {
  double rise_s = 0, overshoot = 0, final_error = 0;
};
Response step_response(int axis, double angle, const Vec3& disturbance) {
  test::QuadOracle::Options options;
  options.disturbance_torque_nm = disturbance;
  Loop loop(options);
  for (int i = 0; i < 4000; ++i) loop.step(Mat3::Identity());  // the integral finds the torque
  const Mat3 R_desired = so3::Exp(angle * Vec3::Unit(axis));
  Response out;
  double t10 = -1, t90 = -1;
  for (int i = 0; i < 3000; ++i) {
    loop.step(R_desired);
    const double reached = so3::Log(loop.quad.R)[axis] / angle;
    if (t10 < 0 && reached > 0.1) t10 = i * 1e-3;
    if (t90 < 0 && reached > 0.9) t90 = i * 1e-3;
    out.overshoot = std::max(out.overshoot, reached - 1);
  }
  out.rise_s = t90 - t10;
  out.final_error = so3::angle(loop.quad.R.transpose() * R_desired);
  return out;
}

TEST(AttitudeControl, StepsAreFastWithoutLargeOvershootOrError) {
  const Vec3 disturbances[] = {Vec3::Zero(), Vec3(0.06, -0.05, 0.01)};
  for (const Vec3& disturbance : disturbances) {
    for (const double angle : {10 * kDegree, -30 * kDegree}) {
      for (int axis = 0; axis < 3; ++axis) {
        const Response r = step_response(axis, angle, disturbance);
        // One over the loop's gain would be a rise of 2.2 / P.
        EXPECT_LT(r.rise_s, axis < 2 ? 0.35 : 0.8) << axis << " " << angle;
        EXPECT_LT(r.overshoot, 0.15) << axis << " " << angle;
        EXPECT_LT(r.final_error, 0.5 * kDegree) << axis << " " << angle;
      }
    }
  }
}

TEST(AttitudeControl, IntegralTakesUpAConstantTorqueExactly) {
  test::QuadOracle::Options options;
  options.disturbance_torque_nm = {0.08, -0.06, 0.02};
  Loop loop(options);
  for (int i = 0; i < 8000; ++i) loop.step(Mat3::Identity());
  EXPECT_LT(so3::angle(loop.quad.R), 0.1 * kDegree);
  EXPECT_LT(loop.quad.w.norm(), 0.005);
}

TEST(AttitudeControl, RecoversFromUpsideDown) {
  Loop loop({});
  loop.quad.R = so3::Exp({3.0, 0, 0});
  for (int i = 0; i < 3000; ++i) loop.step(Mat3::Identity());
  EXPECT_LT(so3::angle(loop.quad.R), 2 * kDegree);
}

TEST(RateControl, IntegratorHoldsWhereTheTorqueIsNotToBeHad) {
  const AttitudeControlConfig config;
  RateControl control(config);
  control.reset(Vec3::Zero());
  for (int i = 0; i < 500; ++i) {
    const Vec3 demand = control.update({1, 1, 1}, Vec3::Zero());
    control.integrate({demand.x(), 0.1 * demand.y(), demand.z()});
  }
  EXPECT_NEAR(control.integral_nm().x(), 0.3, 1e-9);  // at its bound
  EXPECT_EQ(control.integral_nm().y(), 0);
  EXPECT_NEAR(control.integral_nm().z(), 2 * config.rate_p.z(), 1e-3);
}

TEST(LowPass, PassesConstantsAndHalvesThePowerAtTheCutoff) {
  LowPass filter(1000, 60);
  filter.reset({1, 2, 3});
  EXPECT_LT((filter.update({1, 2, 3}) - Vec3(1, 2, 3)).norm(), 1e-12);
  double power = 0;
  for (int i = 0; i < 3000; ++i) {
    const double in = std::sin(2 * std::numbers::pi * 60 * i * 1e-3);
    const double out = filter.update(Vec3(in, 0, 0)).x();
    if (i >= 2000) power += out * out / 500;
  }
  EXPECT_NEAR(power, 0.5, 0.005);
}

}  // namespace
}  // namespace arex
