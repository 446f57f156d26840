#include "autopilot/autopilot.h"

#include <gtest/gtest.h>

#include <functional>
#include <numbers>

#include "config/config.h"
#include "math/so3.h"
#include "quad_oracle.h"

namespace arex {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
using State = AutopilotState;

/// The autopilot and its sensors around the oracle, in lockstep.
class Flight {
 public:
  explicit Flight(std::uint64_t seed, const test::QuadOracle::Options& options = {})
      : quad(seed, options), autopilot(AutopilotConfig{}, VehicleConfig{}) {
    quad.gyro_bias = {0.003, -0.002, 0.004};
  }

  /// Runs for a time; `command` is asked every 10 ms and may stay silent.
  using Source = std::function<bool(AttitudeCommand&)>;
  void run(double seconds, const Source& source) {
    for (int i = 0; i < static_cast<int>(seconds * 1000); ++i) step(source);
  }
  /// Until `done`, at most for a time; whether it came.
  bool run_until(double seconds, const Source& source, const std::function<bool()>& done) {
    for (int i = 0; i < static_cast<int>(seconds * 1000); ++i) {
      step(source);
      if (done()) return true;
    }
    return false;
  }
  void step(const Source& source) {
    const Stamp tick = quad.stamp / kNanosecondsPerTick;
    if (tick % 10 == 0) {
      AttitudeCommand command;
      command.stamp = quad.stamp;
      command.R_AB_desired = so3::from_yaw(quad.options.initial_yaw_rad);
      if (source(command)) autopilot.command(command);
    }
    autopilot.add_imu(quad.imu());
    if (tick % 10 == 0) autopilot.add_magnetometer(quad.magnetometer());
    if (tick % 20 == 0 && barometer_works) autopilot.add_barometer(quad.barometer());
    if (tick % 20 == 0) autopilot.add_battery(quad.battery());
    motors = autopilot.tick(quad.stamp);
    quad.step(motors);
  }
  /// Stays upright and holds a vertical speed with the oracle's true state.
  [[nodiscard]] Source climb(double speed_mps) const {
    return [this, speed_mps](AttitudeCommand& c) {
      c.mode = AutopilotMode::kAttitude;
      c.thrust_n = quad.mass_kg() * (kGravity + 4 * (speed_mps - quad.v.z()));
      return true;
    };
  }
  void take_off(double height_m) {
    run(2.5, disarmed);
    run_until(20, climb(1.0), [&] { return quad.p.z() >= height_m; });
  }
  [[nodiscard]] bool rotors_stopped() const { return motors.throttle == std::array<double, 4>{}; }

  static bool disarmed(AttitudeCommand& command) {
    command.mode = AutopilotMode::kDisarmed;
    return true;
  }
  static bool silent(AttitudeCommand&) { return false; }

  test::QuadOracle quad;
  Autopilot autopilot;
  MotorCommand motors;
  bool barometer_works = true;
};

TEST(AutopilotConfig, DefaultsKeepTheirOwnRules) {
  AutopilotConfig config;
  ConfigNode empty;
  empty.kind = ConfigNode::Kind::kMap;
  EXPECT_NO_THROW(read_config(empty, config));
  EXPECT_GT(list_parameters(config).size(), 40U);
}

TEST(Autopilot, ArmsOnlyAfterInitialisationAndOnCommand) {
  Flight flight(1);
  const auto hover = flight.climb(0);
  flight.run(1.5, hover);
  EXPECT_FALSE(flight.autopilot.armed());
  EXPECT_TRUE(flight.rotors_stopped());
  flight.run(0.6, Flight::disarmed);
  EXPECT_EQ(flight.autopilot.state(), State::kStandby);
  EXPECT_TRUE(flight.rotors_stopped());
  flight.run(0.1, hover);
  EXPECT_TRUE(flight.autopilot.armed());
  EXPECT_EQ(flight.autopilot.state(), State::kSpinUp);
  for (const double throttle : flight.motors.throttle) {
    EXPECT_GT(throttle, 0.02);
    EXPECT_LT(throttle, 0.25);
  }
  EXPECT_EQ(flight.quad.p.z(), 0);
  flight.run(0.4, Flight::silent);
  flight.run(0.3, Flight::silent);  // commands have stopped on the ground: disarm
  EXPECT_FALSE(flight.autopilot.armed());
}

TEST(Autopilot, DoesNotInitialiseWhileMovedOrArmWhileTilted) {
  Autopilot moved(AutopilotConfig{}, VehicleConfig{});
  Autopilot tilted(AutopilotConfig{}, VehicleConfig{});
  const Mat3 R = so3::Exp({0.6, 0, 0});
  for (Stamp t = 0; t < 6 * kNanosecondsPerSecond; t += kNanosecondsPerTick) {
    moved.add_imu({t, {0.3 * std::sin(3 * to_seconds(t)), 0, 0}, {0, 0, kGravity}});
    tilted.add_imu({t, Vec3::Zero(), R.transpose() * Vec3(0, 0, kGravity)});
    const Vec3 field(0.2, 0, -0.4);
    moved.add_magnetometer({t, field});
    tilted.add_magnetometer({t, R.transpose() * field});
    AttitudeCommand command;
    command.stamp = t;
    command.mode = AutopilotMode::kAttitude;
    command.thrust_n = 20;
    moved.command(command);
    tilted.command(command);
    moved.tick(t);
    tilted.tick(t);
  }
  EXPECT_EQ(moved.state(), State::kInitialising);
  EXPECT_EQ(tilted.state(), State::kStandby);
  EXPECT_LT(so3::angle(tilted.attitude().R_AB.transpose() * R), 0.01 * kDegree);
}

TEST(Autopilot, TakesOffHoversAndTracksAttitude) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    test::QuadOracle::Options options;
    options.initial_yaw_rad = 0.7;
    options.wind_mps = {1.5, -1, 0};
    options.disturbance_torque_nm = {0.03, -0.04, 0.005};  // a centre of mass beside the middle
    Flight flight(seed, options);
    flight.take_off(5);
    EXPECT_EQ(flight.autopilot.state(), State::kFlying);
    flight.run(5, flight.climb(0));
    EXPECT_LT(so3::angle(flight.quad.R.transpose() * so3::from_yaw(0.7)), 1.0 * kDegree);
    EXPECT_NEAR(flight.autopilot.ahrs().velocity().z(), flight.quad.v.z(), 0.1);
    EXPECT_NEAR(flight.autopilot.ahrs().height_m(), flight.quad.p.z(), 0.5);

    const Mat3 R_desired = so3::from_yaw(0.7) * so3::Exp({0.15, -0.2, 0});
    const auto hover = flight.climb(0);
    flight.run(1.5, [&](AttitudeCommand& c) {
      c.R_AB_desired = R_desired;
      return hover(c);
    });
    EXPECT_LT(so3::angle(flight.quad.R.transpose() * R_desired), 1.5 * kDegree);
    // The estimate is good to about a degree in tilt; the loop holds it much closer.
    EXPECT_LT(so3::angle(flight.autopilot.attitude().R_AB.transpose() * R_desired), 1.0 * kDegree);
  }
}

TEST(Autopilot, DescendsLevelAndDisarmsWhenCommandsStop) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    Flight flight(seed);
    flight.take_off(3);
    flight.run(0.4, Flight::silent);
    EXPECT_EQ(flight.autopilot.state(), State::kFlying);
    flight.run(0.2, Flight::silent);
    EXPECT_EQ(flight.autopilot.state(), State::kDescending);
    flight.run(2, Flight::silent);
    EXPECT_NEAR(flight.quad.v.z(), -0.5, 0.15);
    EXPECT_GT(flight.quad.R(2, 2), std::cos(2 * kDegree));
    EXPECT_TRUE(flight.run_until(15, Flight::silent, [&] { return !flight.autopilot.armed(); }));
    EXPECT_EQ(flight.quad.p.z(), 0);
    EXPECT_LT(flight.quad.touchdown_speed, 0.8);
    EXPECT_TRUE(flight.rotors_stopped());
  }
}

TEST(Autopilot, FollowsAgainWhenCommandsComeBack) {
  Flight flight(1);
  flight.take_off(3);
  flight.run(1, Flight::silent);
  EXPECT_EQ(flight.autopilot.state(), State::kDescending);
  flight.run(0.5, flight.climb(0));
  EXPECT_EQ(flight.autopilot.state(), State::kFlying);
}

TEST(Autopilot, RefusesToDisarmInTheAir) {
  Flight flight(1);
  flight.take_off(2);
  flight.run(0.1, Flight::disarmed);
  EXPECT_EQ(flight.autopilot.state(), State::kDescending);
  EXPECT_FALSE(flight.rotors_stopped());
  EXPECT_TRUE(flight.run_until(12, Flight::disarmed, [&] { return !flight.autopilot.armed(); }));
  EXPECT_EQ(flight.quad.p.z(), 0);
}

TEST(Autopilot, DisarmsOnTouchdownAndRearmsOnlyAfterRelease) {
  Flight flight(2);
  flight.take_off(1.5);
  const auto land = [&](AttitudeCommand& c) {  // a position loop that pulls ever further down
    flight.climb(-0.4)(c);
    if (flight.quad.p.z() <= 0.01) c.thrust_n = 0.3 * flight.quad.mass_kg() * kGravity;
    return true;
  };
  EXPECT_TRUE(flight.run_until(10, land, [&] { return !flight.autopilot.armed(); }));
  EXPECT_EQ(flight.quad.p.z(), 0);
  flight.run(2, flight.climb(1));
  EXPECT_FALSE(flight.autopilot.armed());
  flight.run(0.1, Flight::disarmed);
  flight.run(0.1, flight.climb(1));
  EXPECT_TRUE(flight.autopilot.armed());
}

TEST(Autopilot, NoticesItsLandingWithoutABarometer) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    Flight flight(seed);
    flight.take_off(1.5);
    flight.barometer_works = false;
    flight.run(20, flight.climb(0));  // long enough for the vertical speed to be anything
    const auto land = [&](AttitudeCommand& c) {
      flight.climb(-0.4)(c);
      if (flight.quad.p.z() <= 0.01) c.thrust_n = 0.3 * flight.quad.mass_kg() * kGravity;
      return true;
    };
    EXPECT_TRUE(flight.run_until(15, land, [&] { return !flight.autopilot.armed(); })) << seed;
    EXPECT_EQ(flight.quad.p.z(), 0);
  }
}

TEST(Autopilot, LandDetectionIsSilentInFreeFlight) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    Flight flight(seed);
    RandomStream random(seed, "dives");
    flight.take_off(3);
    flight.barometer_works = seed <= 6;
    flight.quad.p.z() = 500;  // room below; the barometer's gate has to cope as well
    double thrust = 1, tilt_x = 0, tilt_y = 0;
    int left = 0;
    const auto dive = [&](AttitudeCommand& c) {
      c.mode = AutopilotMode::kAttitude;
      if (left-- <= 0) {  // dives, catches and hops of random length, thrust down to nothing
        left = random.uniform_int(10, 150);
        const double speed = flight.quad.v.z();
        thrust = speed < -6 ? random.uniform(1.2, 2.0) : random.uniform(0.0, 1.1);
        tilt_x = random.uniform(-0.7, 0.7);
        tilt_y = random.uniform(-0.7, 0.7);
      }
      c.R_AB_desired = so3::Exp({tilt_x, tilt_y, 0});
      c.thrust_n = thrust * flight.quad.mass_kg() * kGravity;
      return true;
    };
    double lowest = 0;
    for (int i = 0; i < 300 && flight.quad.p.z() > 10; ++i) {
      flight.run(0.1, dive);
      lowest = std::min(lowest, flight.quad.v.z());
      ASSERT_EQ(flight.autopilot.state(), State::kFlying) << seed << " after " << i;
    }
    EXPECT_LT(lowest, -5);
  }
}

}  // namespace
}  // namespace arex
