#include "physics/physics.h"

#include <cmath>

#include "fixtures.h"
#include "messages/vehicle.h"

namespace arex::sim {
namespace {

using fixtures::holding_throttle;
using fixtures::level;
using fixtures::without_air;

constexpr double kTick_s = 1e-3;
constexpr std::array<double, 4> kStopped{};

TEST(Airframe, ModelAgreesWithTheReferenceAndWithWhatTheStackBelieves) {
  const Airframe airframe = load_airframe();
  const VehicleConfig belief;
  EXPECT_NEAR(airframe.mass_kg, belief.mass_kg, 1e-12);
  EXPECT_EQ(BodyConfig{}.mass_kg, airframe.mass_kg);  // its default is the model's
  Mat3 inertia;
  inertia << 0.0137, 0, -0.0020, 0, 0.0126, 0, -0.0020, 0, 0.0213;
  EXPECT_LT((airframe.inertia_kgm2 - inertia).norm(), 1e-9);
  EXPECT_EQ(airframe.p_BBcm.head<2>(), Vec2::Zero()) << "trimmed";
  const std::array<Vec3, 4> signs{Vec3{1, -1, 1}, {-1, 1, 1}, {1, 1, 1}, {-1, -1, 1}};
  for (std::size_t i = 0; i < signs.size(); ++i) {
    EXPECT_LT((airframe.p_BR[i] - signs[i].cwiseProduct(belief.rotor_offset_m)).norm(), 1e-12);
  }
  EXPECT_LT((airframe.X_BL.R - belief.X_BL().R).norm(), 1e-9);
  EXPECT_LT((airframe.X_BL.p - belief.X_BL().p).norm(), 1e-12);
  EXPECT_LT((airframe.X_BC.R - belief.X_BC().R).norm(), 1e-9);
  EXPECT_LT((airframe.X_BC.p - belief.X_BC().p).norm(), 1e-12);
  EXPECT_LE(airframe.radius_m, belief.radius_m);
  EXPECT_LT(belief.radius_m - airframe.radius_m, 1e-3);
  EXPECT_EQ(airframe.standing_height_m, belief.ground_offset_m);
  const RotorConfig rotor;
  EXPECT_EQ(rotor.thrust_coefficient, belief.thrust_coefficient);
  EXPECT_EQ(rotor.torque_ratio_m, belief.torque_ratio_m);
}

TEST(Airframe, TakesTheMassInertiaAndMountsOfTheScenario) {
  PhysicsConfig config = without_air();
  config.body.mass_kg = 2.6;
  config.body.inertia_scale = 1.5;
  config.body.lidar_mount.offset_m = {0.01, -0.02, 0.03};
  config.body.camera_mount.rotation_rad = {0, 0.1, 0};
  const worlds::World nothing;
  Physics heavy(config, nothing, level(0, 0, 50), 1);
  Physics nominal(without_air(), nothing, level(0, 0, 50), 1);
  const Airframe model = load_airframe();
  EXPECT_EQ(heavy.airframe().mass_kg, 2.6);
  EXPECT_LT((heavy.airframe().inertia_kgm2 - 1.5 * model.inertia_kgm2).norm(), 1e-9);
  EXPECT_LT((heavy.airframe().X_BL.p - model.X_BL.p - Vec3(0.01, -0.02, 0.03)).norm(), 1e-12);
  EXPECT_LT((heavy.airframe().X_BC.R - so3::Exp({0, 0.1, 0}) * model.X_BC.R).norm(), 1e-12);
  // All four rotors spin alike: no torque but about z, and the same F = m (a + g) for both. Without
  // current they slow down by a few percent in this millisecond.
  const std::array<double, 4> spinning{700, 700, 700, 700};
  for (Physics* physics : {&heavy, &nominal}) {
    physics->set_state(level(0, 0, 50), Vec3::Zero(), Vec3::Zero(), spinning);
    physics->step({});
  }
  const double force = 4 * RotorConfig{}.thrust_coefficient * 700 * 700;
  const double lifted = 2.6 * (heavy.truth().a_WB.z() + kGravity);
  EXPECT_NEAR(lifted, force, 0.05 * force);
  EXPECT_NEAR(1.9 * (nominal.truth().a_WB.z() + kGravity), lifted, 1e-3 * force);
}

TEST(Airframe, GeometryIsThatOfThePaper) {
  const Airframe airframe = load_airframe();
  const auto& hubs = airframe.p_BR;
  EXPECT_NEAR((hubs[0] - hubs[1]).norm(), 0.380, 1e-3) << "wheelbase";
  EXPECT_NEAR((hubs[2] - hubs[3]).norm(), 0.380, 1e-3);
  const double front = std::acos(hubs[0].normalized().dot(hubs[2].normalized()));
  EXPECT_NEAR(front * 180 / std::numbers::pi, 120, 0.1) << "angle between the front arms";
  double lowest = 0, highest = 0;
  int discs = 0;
  for (const worlds::CollisionShape& shape : airframe.shapes) {
    if (shape.object == static_cast<std::uint32_t>(AirframePart::kRotor)) {
      EXPECT_NEAR(2 * shape.size.x(), RotorConfig{}.diameter_m, 1e-3);
      ++discs;
    }
    // Distances to far planes give the extent along z, whatever the shape.
    if (shape.kind == worlds::CollisionShape::Kind::kCapsule) {
      const double half = shape.size.y() * std::abs(shape.X_WS.R(2, 2)) + shape.size.x();
      lowest = std::min(lowest, shape.X_WS.p.z() - half);
    } else if (shape.kind == worlds::CollisionShape::Kind::kBox) {
      highest = std::max(highest, shape.X_WS.p.z() + shape.size.z());
    }
  }
  EXPECT_EQ(discs, 4);
  EXPECT_NEAR(-lowest, VehicleConfig{}.ground_offset_m, 1e-4) << "stands on its legs";
  EXPECT_NEAR(highest - lowest, 0.220, 0.005) << "height of the envelope";
}

TEST(Physics, FallsFreely) {
  const worlds::World world;
  Physics physics(without_air(), world, level(1, 2, 100), 1);
  for (int i = 1; i <= 2000; ++i) {
    physics.step({});
    const double t = i * kTick_s;
    const Truth& truth = physics.truth();
    EXPECT_EQ(truth.stamp, i * kNanosecondsPerTick);
    ASSERT_NEAR(truth.v_WB.z(), -kGravity * t, 1e-9);
    // Semi-implicit Euler is half a tick late: exactly g dt t / 2.
    ASSERT_NEAR(truth.X_WB.p.z(), 100 - 0.5 * kGravity * t * (t + kTick_s), 1e-9);
    ASSERT_NEAR(truth.a_WB.z(), -kGravity, 1e-6);
  }
}

TEST(Physics, TumblesWithConservedMomentumAboutItsCentreOfMass) {
  const worlds::World world;
  for (const Vec3& spin : {Vec3(2, 0.1, 0.3), Vec3(-0.5, 3, 1), Vec3(1, 1, -4)}) {
    Physics physics(without_air(), world, level(0, 0, 50), 1);
    physics.set_state(level(0, 0, 50, 0.4), {1, -2, 3}, spin, kStopped);
    const Airframe& airframe = physics.airframe();
    const auto momentum = [&](const Truth& truth) -> Vec3 {
      return truth.X_WB.R * (airframe.inertia_kgm2 * truth.w_WB_B);
    };
    const auto centre = [&](const Truth& truth) -> Vec3 { return truth.X_WB * airframe.p_BBcm; };
    const auto centre_velocity = [&](const Truth& truth) -> Vec3 {
      return truth.v_WB + truth.X_WB.R * truth.w_WB_B.cross(airframe.p_BBcm);
    };
    const Vec3 h0 = momentum(physics.truth()), p0 = centre(physics.truth()),
               v0 = centre_velocity(physics.truth());
    for (int i = 0; i < 1000; ++i) physics.step({});
    // First-order integrator: errors of about |w|^2 dt t.
    const double bound = spin.squaredNorm() * kTick_s;
    EXPECT_LT((momentum(physics.truth()) - h0).norm(), bound * h0.norm());
    const Vec3 g(0, 0, -kGravity);
    EXPECT_LT((centre_velocity(physics.truth()) - v0 - g).norm(), bound);
    EXPECT_LT((centre(physics.truth()) - p0 - v0 - 0.5 * g).norm(), 0.006 + bound);
  }
}

TEST(Physics, RatesAreTheDerivativesOfTheState) {
  const worlds::World world;
  PhysicsConfig config;
  config.wind.mean_mps = {3, 1, 0};
  Physics physics(config, world, level(0, 0, 50), 5);
  physics.set_state(level(0, 0, 50), {1, 0, 0}, {0.2, -0.4, 0.6}, {700, 720, 730, 690});
  Truth before = physics.truth();
  for (int i = 0; i < 200; ++i) {
    physics.step({{0.5, 0.6, 0.55, 0.5}});
    const Truth& now = physics.truth();
    EXPECT_LT(((now.X_WB.p - before.X_WB.p) / kTick_s - now.v_WB).norm(), 1e-9);
    const Vec3 turned = so3::Log(before.X_WB.R.transpose() * now.X_WB.R);
    EXPECT_LT((turned / kTick_s - now.w_WB_B).norm(), 1e-9);
    EXPECT_LT((now.v_WB - before.v_WB - kTick_s * now.a_WB).norm(), 1e-12);
    EXPECT_LT((now.w_WB_B - before.w_WB_B - kTick_s * now.alpha_WB_B).norm(), 1e-12);
    before = now;
  }
}

TEST(Physics, HoversAtTheReferenceSpeedAndPower) {
  const worlds::World world;
  const PhysicsConfig config;
  const double speed = 716;
  Physics physics(config, world, level(0, 0, 10), 1);
  physics.set_state(level(0, 0, 10), Vec3::Zero(), Vec3::Zero(), {speed, speed, speed, speed});
  double power = 0;
  for (int i = 0; i < 500; ++i) {
    const double u = holding_throttle(config, speed, physics.battery().voltage_v);
    physics.step({{u, u, u, u}});
    power = physics.battery().voltage_v * physics.battery().current_a;
  }
  const Truth& truth = physics.truth();
  // Thrust within 3 % of the weight, power within 3 % of 258 W.
  EXPECT_LT(truth.a_WB.norm(), 0.03 * kGravity);
  EXPECT_NEAR(power, 258, 0.03 * 258);
  EXPECT_LT(truth.alpha_WB_B.norm(), 1e-9) << "equal rotors turn nothing";
}

/// Angular acceleration of B while the rotors hold these speeds.
Vec3 angular_acceleration(const std::array<double, 4>& speeds) {
  const worlds::World world;
  PhysicsConfig config = without_air();
  config.battery.resistance_ohm = 1e-9;  // so that each rotor's throttle is its own affair
  Physics physics(config, world, level(0, 0, 10), 1);
  physics.set_state(level(0, 0, 10), Vec3::Zero(), Vec3::Zero(), speeds);
  MotorCommand command;
  for (std::size_t i = 0; i < 4; ++i) {
    command.throttle[i] =
        holding_throttle(config, speeds[i], physics.powertrain().open_circuit_v());
  }
  physics.step(command);
  return physics.truth().alpha_WB_B;
}

TEST(Physics, EachRotorTurnsTheVehicleAsItsPlaceAndSenseSay) {
  const RotorConfig rotor;
  const Airframe airframe = load_airframe();
  // Roll, pitch, yaw for more speed; x forward, y left, z up. Order as in MotorCommand.
  const std::array<Vec3, 4> signs{Vec3{-1, -1, -1}, {1, 1, -1}, {1, -1, 1}, {-1, 1, 1}};
  const double speed = 716, step = 5;
  for (std::size_t i = 0; i < 4; ++i) {
    std::array<double, 4> up{speed, speed, speed, speed}, down = up;
    up[i] += step;
    down[i] -= step;
    const Vec3 slope = (angular_acceleration(up) - angular_acceleration(down)) / (2 * step);
    const double thrust_slope = 2 * rotor.thrust_coefficient * speed;
    Vec3 torque = (airframe.p_BR[i] - airframe.p_BBcm).cross(Vec3(0, 0, thrust_slope));
    torque.z() += signs[i].z() * rotor.torque_ratio_m * thrust_slope;
    const Vec3 expected = airframe.inertia_kgm2.inverse() * torque;
    EXPECT_LT((slope - expected).norm(), 1e-3 * expected.norm()) << "rotor " << i;
    const Vec3 turned = airframe.inertia_kgm2 * slope;
    for (int axis = 0; axis < 3; ++axis) EXPECT_GT(turned[axis] * signs[i][axis], 0) << i;
  }
}

TEST(Physics, SpinningUpRotorsTurnsTheBodyTheOtherWay) {
  // No air: all torque a rotor gets from the body is angular momentum of its own.
  const worlds::World world;
  PhysicsConfig config = without_air();
  config.rotor.thrust_coefficient = 1e-12;
  Physics physics(config, world, level(0, 0, 10), 1);
  for (int i = 0; i < 40; ++i) physics.step({{0.3, 0.3, 0, 0}});
  const Truth& truth = physics.truth();
  const double rotors = config.rotor.inertia_kgm2 * (truth.rotor_radps[0] + truth.rotor_radps[1]);
  const Vec3 body = physics.airframe().inertia_kgm2 * truth.w_WB_B;
  EXPECT_GT(rotors, 0.01);
  EXPECT_NEAR(body.z() + rotors, 0, 1e-3 * rotors);
}

TEST(Physics, FallsAtTheTerminalVelocityOfItsDrag) {
  const worlds::World world;
  const PhysicsConfig config;
  Physics physics(config, world, level(0, 0, 1000), 1);
  const double terminal = std::sqrt(2 * physics.airframe().mass_kg * kGravity /
                                    (config.drag.air_density_kgpm3 * config.drag.drag_area_m2.z()));
  for (int i = 1; i <= 10'000; ++i) {
    physics.step({});
    if (i % 1000 != 0) continue;
    const double expected = terminal * std::tanh(kGravity * i * kTick_s / terminal);
    EXPECT_NEAR(-physics.truth().v_WB.z(), expected, 2e-3 * expected);
  }
}

TEST(Physics, RotorDragAndInflowGrowWithTheAirSpeed) {
  const worlds::World world;
  PhysicsConfig config;
  config.drag.air_density_kgpm3 = 0;  // rotors alone
  const double speed = 716;
  const auto acceleration = [&](const Vec3& velocity) -> Vec3 {
    Physics physics(config, world, level(0, 0, 10), 1);
    physics.set_state(level(0, 0, 10), velocity, Vec3::Zero(), {speed, speed, speed, speed});
    const double u = holding_throttle(config, speed, physics.battery().voltage_v);
    physics.step({{u, u, u, u}});
    const Truth& truth = physics.truth();
    return truth.a_WB + truth.alpha_WB_B.cross(physics.airframe().p_BBcm);
  };
  const Vec3 still = acceleration(Vec3::Zero());
  const double thrust_per_kg = still.z() + kGravity;
  EXPECT_NEAR(acceleration({3, 0, 0}).x(), -config.rotor.drag_s_per_m * 3 * thrust_per_kg, 1e-6);
  EXPECT_NEAR(acceleration({0, -2, 0}).y(), config.rotor.drag_s_per_m * 2 * thrust_per_kg, 1e-6);
  // Advance ratio 1 m/s / (114 Hz * 0.2286 m) takes J/0.62 of the thrust.
  const double advance = 1.0 / (speed / (2 * std::numbers::pi) * config.rotor.diameter_m);
  EXPECT_NEAR((acceleration({0, 0, 1}) - still).z() / thrust_per_kg,
              -advance / config.rotor.zero_thrust_advance_ratio, 1e-2 * advance);
}

TEST(Physics, WindPushesThroughDrag) {
  const worlds::World world;
  PhysicsConfig config;
  config.wind.mean_mps = {4, -3, 0};
  config.wind.turbulence_scale = 0;
  Physics physics(config, world, level(0, 0, 10), 1);
  physics.step({});
  const Vec3 expected = 0.5 * config.drag.air_density_kgpm3 * 5 *
                        config.drag.drag_area_m2.cwiseProduct(config.wind.mean_mps) /
                        physics.airframe().mass_kg;
  const Airframe& airframe = physics.airframe();
  const Truth& truth = physics.truth();
  const Vec3 at_centre = truth.a_WB + truth.alpha_WB_B.cross(airframe.p_BBcm);
  EXPECT_LT((at_centre - expected - Vec3(0, 0, -kGravity)).norm(), 1e-9);
}

TEST(Physics, SameSeedSameBits) {
  const worlds::World world = fixtures::rolling_world(0.2);
  PhysicsConfig config;
  config.wind.mean_mps = {2, 0, 0};
  const auto fly = [&](std::uint64_t seed) {
    Physics physics(config, world, level(0, 0, 1.0), seed);
    for (int i = 0; i < 3000; ++i) {
      const double u = i < 1500 ? 0.55 : 0.3;  // up, then down into the ground
      physics.step({{u, u + 0.001, u, u}});
    }
    return physics.truth();
  };
  const Truth a = fly(3), b = fly(3), c = fly(4);
  EXPECT_EQ(a.X_WB.p, b.X_WB.p);
  EXPECT_EQ(a.X_WB.R, b.X_WB.R);
  EXPECT_EQ(a.v_WB, b.v_WB);
  EXPECT_EQ(a.w_WB_B, b.w_WB_B);
  EXPECT_EQ(a.rotor_radps, b.rotor_radps);
  EXPECT_NE(a.X_WB.p, c.X_WB.p);
}

}  // namespace
}  // namespace arex::sim
