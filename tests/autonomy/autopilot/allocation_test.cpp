#include "autopilot/allocation.h"

#include <gtest/gtest.h>

#include "autopilot/motor_model.h"
#include "math/random.h"

namespace arex {
namespace {

constexpr double kLow = 0.2, kHigh = 13.0;

/// Wrench of rotor thrusts from first principles: force and reaction torque of each rotor at its
/// place. Order as MotorCommand says: front right, rear left (counter-clockwise), front left, rear
/// right (clockwise).
Vec4 wrench_of(const VehicleConfig& vehicle, const Vec4& thrust) {
  const double x = vehicle.rotor_offset_m.x(), y = vehicle.rotor_offset_m.y();
  const Vec3 hubs[] = {{x, -y, 0}, {-x, y, 0}, {x, y, 0}, {-x, -y, 0}};
  const double turns[] = {1, 1, -1, -1};
  Vec4 sum = Vec4::Zero();
  for (int i = 0; i < 4; ++i) {
    const Vec3 force(0, 0, thrust[i]);
    const Vec3 torque =
        hubs[i].cross(force) - Vec3(0, 0, turns[i] * vehicle.torque_ratio_m * thrust[i]);
    sum += Vec4(force.z(), torque.x(), torque.y(), torque.z());
  }
  return sum;
}

TEST(Allocation, EffectivenessMatchesFiniteDifferencesOfTheRotors) {
  const VehicleConfig vehicle;
  const Allocation allocation(vehicle);
  const Vec4 hover = Vec4::Constant(4.66);
  for (int i = 0; i < 4; ++i) {
    const Vec4 step = 1e-3 * Vec4::Unit(i);
    const Vec4 numeric =
        (wrench_of(vehicle, hover + step) - wrench_of(vehicle, hover - step)) / 2e-3;
    EXPECT_LT((allocation.effectiveness().col(i) - numeric).norm(), 1e-10);
  }
}

TEST(Allocation, MixIsTheMoorePenroseInverse) {
  const Allocation allocation{VehicleConfig{}};
  const auto& B = allocation.effectiveness();
  const auto& M = allocation.mix();
  EXPECT_LT((B * M * B - B).norm(), 1e-12);
  EXPECT_LT((M * B * M - M).norm(), 1e-10);
  EXPECT_LT((B * M - (B * M).transpose()).norm(), 1e-12);
  EXPECT_LT((M * B - (M * B).transpose()).norm(), 1e-12);
}

TEST(Allocation, SignsOfRollPitchAndYaw) {
  const Allocation allocation{VehicleConfig{}};
  enum { kFrontRight, kRearLeft, kFrontLeft, kRearRight };
  const auto thrusts = [&](const Vec3& torque) {
    return allocation.allocate({18.6, torque}, kLow, kHigh).rotor_thrust_n;
  };
  const Vec4 roll = thrusts({0.3, 0, 0});  // right side down: the left rotors lift
  EXPECT_GT(std::min(roll[kFrontLeft], roll[kRearLeft]),
            std::max(roll[kFrontRight], roll[kRearRight]));
  const Vec4 pitch = thrusts({0, 0.3, 0});  // nose down: the rear rotors lift
  EXPECT_GT(std::min(pitch[kRearLeft], pitch[kRearRight]),
            std::max(pitch[kFrontLeft], pitch[kFrontRight]));
  const Vec4 yaw = thrusts({0, 0, 0.05});  // to the left: the clockwise rotors work harder
  EXPECT_GT(std::min(yaw[kFrontLeft], yaw[kRearRight]), std::max(yaw[kFrontRight], yaw[kRearLeft]));
}

TEST(Allocation, UnsaturatedDemandIsMetExactly) {
  const Allocation allocation{VehicleConfig{}};
  RandomStream random(1, "allocation");
  for (int i = 0; i < 1000; ++i) {
    const Wrench demand{
        random.uniform(14, 30),
        {random.uniform(-.6, .6), random.uniform(-.4, .4), random.uniform(-.05, .05)}};
    const auto result = allocation.allocate(demand, kLow, kHigh);
    EXPECT_NEAR(result.achieved.thrust_n, demand.thrust_n, 1e-12);
    EXPECT_LT((result.achieved.torque_nm - demand.torque_nm).norm(), 1e-12);
  }
}

/// Which demands give way, over random demands far beyond the range.
TEST(Allocation, SaturationGivesUpYawThenThrustThenTiltTorqueInProportion) {
  const VehicleConfig vehicle;
  const Allocation allocation(vehicle);
  int yaw_cut = 0, thrust_moved = 0, tilt_scaled = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    RandomStream random(seed, "allocation");
    for (int i = 0; i < 2000; ++i) {
      const Wrench demand{
          random.uniform(-5, 60),
          {random.uniform(-4, 4), random.uniform(-2.5, 2.5), random.uniform(-0.6, 0.6)}};
      const auto [thrust, achieved] = allocation.allocate(demand, kLow, kHigh);
      ASSERT_GE(thrust.minCoeff(), kLow);
      ASSERT_LE(thrust.maxCoeff(), kHigh);
      ASSERT_LT((wrench_of(vehicle, thrust) - Vec4(achieved.thrust_n, achieved.torque_nm.x(),
                                                   achieved.torque_nm.y(), achieved.torque_nm.z()))
                    .norm(),
                1e-11);
      // Yaw keeps its sign and never grows.
      const double yaw_share = achieved.torque_nm.z() / demand.torque_nm.z();
      ASSERT_GE(yaw_share, -1e-9);
      ASSERT_LE(yaw_share, 1 + 1e-9);
      // Roll and pitch keep their ratio.
      const double cross = achieved.torque_nm.x() * demand.torque_nm.y() -
                           achieved.torque_nm.y() * demand.torque_nm.x();
      ASSERT_NEAR(cross, 0, 1e-10);
      const Vec2 tilt = demand.torque_nm.head<2>();
      const double tilt_share = achieved.torque_nm.head<2>().norm() / tilt.norm();
      // What roll and pitch alone span, by hand: each rotor's lever is its offset.
      const double span = 0.5 * (std::abs(tilt.x()) / vehicle.rotor_offset_m.y() +
                                 std::abs(tilt.y()) / vehicle.rotor_offset_m.x());
      ASSERT_NEAR(tilt_share, std::min(1.0, (kHigh - kLow) / span), 1e-9);

      const double room = 2 * std::min(span, kHigh - kLow);
      const double best =
          std::clamp(demand.thrust_n, 4 * kLow + room, std::max(4 * kHigh - room, 4 * kLow + room));
      ASSERT_NEAR(achieved.thrust_n, best, 1e-9);
      if (std::abs(achieved.thrust_n - demand.thrust_n) > 1e-9) {
        ++thrust_moved;
      } else if (yaw_share < 1 - 1e-9) {
        ++yaw_cut;
        // No more yaw would have fitted: a rotor stands at its bound.
        ASSERT_LT(std::min(thrust.minCoeff() - kLow, kHigh - thrust.maxCoeff()), 1e-9);
      }
      tilt_scaled += tilt_share < 1 - 1e-9;
    }
  }
  EXPECT_GT(yaw_cut, 100);
  EXPECT_GT(thrust_moved, 100);
  EXPECT_GT(tilt_scaled, 100);
}

TEST(MotorModel, ThrottleHoldsTheThrustAndInvertsFullThrust) {
  const MotorBelief belief;
  const VehicleConfig vehicle;
  const MotorModel motor(belief, vehicle);
  for (const double voltage : {13.2, 14.8, 16.8}) {
    for (const double thrust : {0.3, 4.66, 9.0}) {
      // The motor's own equations, at the speed that gives this thrust.
      const double speed = std::sqrt(thrust / vehicle.thrust_coefficient);
      const double volts = motor.throttle(thrust, voltage) * voltage;
      const double current = (volts - belief.torque_constant * speed) / belief.resistance_ohm;
      EXPECT_NEAR(belief.torque_constant * (current - belief.no_load_current_a),
                  vehicle.torque_ratio_m * thrust, 1e-12);
    }
    EXPECT_NEAR(motor.throttle(motor.full_thrust(voltage), voltage), 1.0, 1e-12);
  }
}

TEST(MotorModel, FullThrottleGivesTheReferencesThrustToWeight) {
  const MotorBelief belief;
  const VehicleConfig vehicle;
  const MotorModel motor(belief, vehicle);
  const auto thrust_to_weight = [&](double open_circuit_v) {
    double voltage = open_circuit_v;  // sags by 28 mohm times the current of four motors
    for (int i = 0; i < 50; ++i) {
      const double current =
          motor.full_thrust(voltage) * vehicle.torque_ratio_m / belief.torque_constant +
          belief.no_load_current_a;
      voltage = 0.5 * (voltage + open_circuit_v - 0.028 * (4 * current / 0.96 + 28 / voltage));
    }
    return 4 * motor.full_thrust(voltage) / (vehicle.mass_kg * kGravity);
  };
  EXPECT_NEAR(thrust_to_weight(16.8), 2.8, 0.06);
  EXPECT_NEAR(thrust_to_weight(14.8), 2.3, 0.06);
}

}  // namespace
}  // namespace arex
