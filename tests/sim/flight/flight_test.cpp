#include <gtest/gtest.h>

#include <functional>
#include <numbers>

#include "closed_loop.h"
#include "math/so3.h"

namespace arex::sim {
namespace {

using test::ClosedLoop;
using test::ErrorStatistics;

constexpr double kDegree = std::numbers::pi / 180;
constexpr std::uint64_t kSeeds[] = {1, 2, 3};
const Vec3 kLightWind(1.6, -1.2, 0);  // 2 m/s, with the gusts of the specification

ClosedLoop::Options options_in(const Vec3& wind) {
  ClosedLoop::Options options;
  options.physics.wind.mean_mps = wind;
  options.physics.wind.turbulence_scale = wind.norm() > 0 ? 1 : 0;
  return options;
}

/// Where to be at a time after the start, s.
using Reference = std::function<TrajectorySetpoint(double)>;

/// Flies a reference for a time. Calls `see` with the time and the setpoint after each tick.
void fly(ClosedLoop& loop, double seconds, const Reference& reference,
         const std::function<void(double, const TrajectorySetpoint&)>& see) {
  const Stamp start = loop.physics.truth().stamp;
  for (double t = 0; t < seconds; t = to_seconds(loop.physics.truth().stamp - start)) {
    const TrajectorySetpoint setpoint = reference(t);
    loop.step(setpoint);
    see(t, setpoint);
    ASSERT_EQ(loop.physics.collision(), nullptr) << t;
  }
}

/// Arms, climbs to 1.5 m over the start and waits there for three seconds.
void take_off(ClosedLoop& loop, double tolerance_m = 0.2) {
  ASSERT_TRUE(loop.start());
  TimedPath path({}, Vec3::Zero(), 0);
  path.climb_to(1.5);
  path.wait(3);
  const auto reference = [&](double t) { return path.sample(t); };
  fly(loop, path.duration_s(), reference, [&](double, const TrajectorySetpoint& setpoint) {
    ASSERT_LT((loop.odometry().X_OB.p - setpoint.p_OB).norm(), tolerance_m);
  });
  ASSERT_EQ(loop.autopilot.state(), AutopilotState::kFlying);
}

TrajectorySetpoint hover_point() {
  TrajectorySetpoint setpoint;
  setpoint.p_OB = {0, 0, 1.5};
  return setpoint;
}

TEST(Flight, BeliefsAreThoseOfTheModel) {
  const MotorConfig motor;
  const RotorConfig rotor;
  const AutopilotConfig autopilot;
  const VehicleConfig vehicle;
  EXPECT_EQ(autopilot.motor.torque_constant, motor.torque_constant_nm_per_a);
  EXPECT_EQ(autopilot.motor.resistance_ohm, motor.resistance_ohm);
  EXPECT_EQ(autopilot.motor.no_load_current_a, motor.no_load_current_a);
  EXPECT_EQ(autopilot.ahrs.drag_s_per_m, rotor.drag_s_per_m);
  EXPECT_NEAR(autopilot.motor.zero_thrust_pitch_m,
              rotor.zero_thrust_advance_ratio * rotor.diameter_m / (2 * std::numbers::pi), 1e-5);
  EXPECT_EQ(vehicle.thrust_coefficient, rotor.thrust_coefficient);
  EXPECT_EQ(vehicle.torque_ratio_m, rotor.torque_ratio_m);
  // Rate gains are the inertia times 18, 18 and 6 1/s, rounded.
  const Mat3 inertia = load_airframe().inertia_kgm2;
  const Vec3 gains = inertia.diagonal().cwiseProduct(Vec3(18, 18, 6));
  EXPECT_LT((autopilot.control.rate_p - gains).norm(), 0.01);
}

TEST(Flight, HoversOnItsOwnSensors) {
  for (const Vec3& wind : {Vec3(Vec3::Zero()), kLightWind}) {
    for (const std::uint64_t seed : kSeeds) {
      ClosedLoop loop(options_in(wind), seed);
      ASSERT_NO_FATAL_FAILURE(take_off(loop));
      ErrorStatistics position, tilt;
      fly(
          loop, 30, [](double) { return hover_point(); },
          [&](double, const TrajectorySetpoint& setpoint) {
            position.add((loop.odometry().X_OB.p - setpoint.p_OB).norm());
            tilt.add(loop.tilt_error());
          });
      EXPECT_LT(position.rms(), wind.norm() > 0 ? 0.03 : 0.01);
      // The accelerometer's bias leaves 0.3 degrees, 1 sigma on each axis, in any levelling.
      EXPECT_LT(tilt.max(), 1.2 * kDegree);
      RecordProperty("hover_rms_mm", static_cast<int>(1e3 * position.rms()));
    }
  }
}

TEST(Flight, PdAloneStandsOffInTheWindByItsForceOverTheGain) {
  ClosedLoop::Options options = options_in(kLightWind);
  options.physics.wind.turbulence_scale = 0;
  options.tracker.observe_disturbance = false;
  for (const std::uint64_t seed : kSeeds) {
    ClosedLoop loop(options, seed);
    ASSERT_NO_FATAL_FAILURE(take_off(loop));
    Vec3 mean = Vec3::Zero();
    fly(
        loop, 10, [](double) { return hover_point(); },
        [&](double, const TrajectorySetpoint& setpoint) {
          mean += 1e-4 * (loop.odometry().X_OB.p - setpoint.p_OB);
        });
    // Rotor drag at 2 m/s and hover thrust, and the airframe's, along the wind.
    const RotorConfig rotor;
    const DragConfig drag;
    const double speed = kLightWind.norm();
    const double force =
        rotor.drag_s_per_m * 1.9 * kGravity * speed +
        0.5 * drag.air_density_kgpm3 * drag.drag_area_m2.head<2>().mean() * speed * speed;
    // The rest is what the tilt error adds: its degree is 3 cm.
    const double tilt_share =
        1.9 * kGravity * loop.tilt_error() / options.tracker.position_gain.x();
    const double expected = force / options.tracker.position_gain.x();
    EXPECT_NEAR(mean.head<2>().norm(), expected, tilt_share + 0.01);
    EXPECT_GT(mean.head<2>().norm(), 0.03);
  }
}

TEST(Flight, StepOfOneMetreSettlesWithoutLargeOvershoot) {
  for (const std::uint64_t seed : kSeeds) {
    for (int axis = 0; axis < 3; ++axis) {
      ClosedLoop loop(options_in(Vec3::Zero()), seed);
      ASSERT_NO_FATAL_FAILURE(take_off(loop));
      TrajectorySetpoint target = hover_point();
      target.p_OB += Vec3::Unit(axis);
      double reached_s = -1, furthest = 0;
      ErrorStatistics settled, across;
      fly(
          loop, 8, [&](double) { return target; },
          [&](double t, const TrajectorySetpoint& setpoint) {
            const Vec3 moved = loop.odometry().X_OB.p - hover_point().p_OB;
            furthest = std::max(furthest, moved[axis]);
            if (reached_s < 0 && moved[axis] > 0.9) reached_s = t;
            across.add((moved - moved[axis] * Vec3::Unit(axis)).norm());
            if (t > 6) settled.add((loop.odometry().X_OB.p - setpoint.p_OB).norm());
          });
      EXPECT_GT(reached_s, 0) << axis;
      EXPECT_LT(reached_s, 2.0) << axis;
      EXPECT_LT(furthest, 1.25) << axis;
      EXPECT_LT(across.max(), 0.12) << axis;
      EXPECT_LT(settled.max(), 0.03) << axis;
    }
  }
}

TEST(Flight, FollowsACircleNoseAhead) {
  constexpr double kRadius = 3, kSpeed = 1.5, kRate = kSpeed / kRadius;
  // The phase starts from rest: constant angular acceleration for two seconds.
  const auto circle = [&](double t) {
    const double up = std::min(t, 2.0);
    const double phase = kRate * (up * up / 4 + (t - up));
    const double rate = kRate * up / 2, acceleration = t < 2 ? kRate / 2 : 0;
    const Vec3 out(std::sin(phase), -std::cos(phase), 0),
        along(std::cos(phase), std::sin(phase), 0);
    TrajectorySetpoint s = hover_point();
    s.p_OB += kRadius * (out + Vec3(0, 1, 0));
    s.v_OB = kRadius * rate * along;
    s.a_OB = kRadius * (acceleration * along - rate * rate * out);
    s.yaw_rad = so3::wrap(phase);
    s.yaw_rate_radps = rate;
    return s;
  };
  for (const Vec3& wind : {Vec3(Vec3::Zero()), kLightWind}) {
    for (const std::uint64_t seed : kSeeds) {
      ClosedLoop loop(options_in(wind), seed);
      ASSERT_NO_FATAL_FAILURE(take_off(loop));
      ErrorStatistics position, yaw;
      fly(loop, 30, circle, [&](double, const TrajectorySetpoint& setpoint) {
        position.add((loop.odometry().X_OB.p - setpoint.p_OB).norm());
        yaw.add(so3::wrap(so3::yaw(loop.odometry().X_OB.R) - setpoint.yaw_rad));
      });
      EXPECT_LT(position.rms(), 0.08);
      EXPECT_LT(yaw.rms(), 4 * kDegree);
    }
  }
}

/// Four legs with turns, from take-off to disarming.
struct Mission {
  double tracking_rms = 0, touchdown_speed = 0, landing_error = 0, disarm_delay_s = 0;
  double tilt_error_max = 0;
  double contact_delay_s = 0;  ///< from the first touch to its detection
  bool disarmed = false, collided = false;
};
Mission fly_mission(ClosedLoop& loop) {
  TimedPath path({}, Vec3::Zero(), 0);
  path.climb_to(1.5);
  for (const Vec3& corner : {Vec3(6, 0, 1.5), Vec3(6, 6, 2.0), Vec3(0, 6, 1.0), Vec3(0, 0, 1.5)}) {
    path.fly_to(corner);
  }
  path.land_to(-1.5);
  Mission out;
  ErrorStatistics tracking;
  const Stamp start = loop.physics.truth().stamp;
  double touchdown_s = 0, t = 0;
  while (loop.autopilot.armed() && t < path.duration_s() + 5) {
    const TrajectorySetpoint setpoint = path.sample(t);
    const double sink = -loop.odometry().v_OB.z();
    loop.step(setpoint);
    t = to_seconds(loop.physics.truth().stamp - start);
    const Vec3 error = loop.odometry().X_OB.p - setpoint.p_OB;
    const bool touching = !loop.physics.contacts().empty();
    if (t > 3 && touching && touchdown_s == 0) {
      touchdown_s = t;
      out.touchdown_speed = sink;
    }
    if (touchdown_s > 0 && out.contact_delay_s == 0 &&
        (loop.autopilot.ground_contact() || !loop.autopilot.armed())) {
      out.contact_delay_s = t - touchdown_s;
    }
    if (t > 0.5 && touchdown_s == 0) tracking.add(error.norm());
    if (touchdown_s == 0) out.tilt_error_max = std::max(out.tilt_error_max, loop.tilt_error());
    out.collided |= loop.physics.collision() != nullptr;
  }
  out.tracking_rms = tracking.rms();
  out.landing_error = loop.odometry().X_OB.p.head<2>().norm();
  out.disarm_delay_s = t - touchdown_s;
  out.disarmed = !loop.autopilot.armed();
  return out;
}

TEST(Flight, TakesOffFliesLegsLandsAndDisarms) {
  for (const Vec3& wind : {Vec3(Vec3::Zero()), kLightWind}) {
    for (const std::uint64_t seed : kSeeds) {
      ClosedLoop loop(options_in(wind), seed);
      ASSERT_TRUE(loop.start());
      const Mission m = fly_mission(loop);
      EXPECT_LT(m.tracking_rms, 0.07);
      EXPECT_FALSE(m.collided);
      EXPECT_TRUE(m.disarmed);
      EXPECT_LT(m.touchdown_speed, 0.6);
      EXPECT_LT(m.landing_error, 0.15);
      EXPECT_LT(m.disarm_delay_s, 3.0);
      EXPECT_LT(m.contact_delay_s, 1.0);  // PX4's detector takes as long
      EXPECT_LT(m.tilt_error_max, 1.2 * kDegree);
      EXPECT_TRUE(loop.physics.landed());
    }
  }
}

TEST(Flight, LandsOnASlopeAndInStrongWindWithoutTippingOver) {
  struct Case {
    double slope_rad;
    Vec3 wind;
  };
  // Leaning into this wind on its feet, the vehicle would tip over while the thrust is taken away.
  for (const Case& c : {Case{8 * kDegree, Vec3::Zero()}, Case{0, Vec3(4.8, -3.6, 0)}}) {
    for (const std::uint64_t seed : kSeeds) {
      ClosedLoop::Options options = options_in(c.wind);
      options.ground_slope_rad = c.slope_rad;
      ClosedLoop loop(options, seed);
      ASSERT_TRUE(loop.start());
      const Mission m = fly_mission(loop);
      EXPECT_TRUE(m.disarmed);
      EXPECT_FALSE(m.collided);
      EXPECT_LT(m.landing_error, 0.3);
      EXPECT_LT(m.contact_delay_s, 1.0) << c.slope_rad;
      EXPECT_TRUE(loop.physics.landed());
      EXPECT_NEAR(std::acos(loop.physics.truth().X_WB.R(2, 2)), c.slope_rad, 1 * kDegree);
    }
  }
}

TEST(Flight, ThePapersPdAloneFliesTheLegsInLightWindToo) {
  for (const std::uint64_t seed : kSeeds) {
    ClosedLoop::Options options = options_in(kLightWind);
    options.tracker.observe_disturbance = false;
    ClosedLoop loop(options, seed);
    ASSERT_TRUE(loop.start());
    const Mission m = fly_mission(loop);
    EXPECT_LT(m.tracking_rms, 0.15);
    EXPECT_TRUE(m.disarmed);
    EXPECT_FALSE(m.collided);
  }
}

TEST(Flight, ComesDownByItselfWhenTheStackFallsSilent) {
  for (const std::uint64_t seed : kSeeds) {
    ClosedLoop loop(options_in(kLightWind), seed);
    ASSERT_NO_FATAL_FAILURE(take_off(loop));
    double t = 0, impact = 0;
    for (; t < 15 && loop.autopilot.armed(); t += 1e-3) {
      loop.step_silent();
      if (loop.physics.contacts().empty()) impact = -loop.odometry().v_OB.z();
    }
    EXPECT_FALSE(loop.autopilot.armed());
    EXPECT_LT(impact, 0.9);
    EXPECT_TRUE(loop.physics.landed());
  }
}

/// Jumps of the setpoint far up and down and sideways, for half a minute.
struct Dives {
  int contact_ticks = 0;
  double fastest_mps = 0;     ///< downwards
  double axial_mps = 0;       ///< fastest air from below, along B's z, without vertical motion
  double surplus = 0;         ///< thrust it adds, part of the weight
  bool stayed_flying = true;  ///< as the autopilot sees it
};
Dives dive(ClosedLoop& loop, std::uint64_t seed) {
  Dives out;
  RandomStream random(seed, "dives");
  TrajectorySetpoint setpoint = hover_point();
  const RotorConfig rotor;
  int left = 0;
  for (int i = 0; i < 30000; ++i) {
    if (left-- <= 0) {
      left = random.uniform_int(200, 2500);
      setpoint.p_OB = {random.uniform(-8, 8), random.uniform(-8, 8), random.uniform(8, 40)};
    }
    loop.step(setpoint);
    const Truth& truth = loop.physics.truth();
    out.fastest_mps = std::max(out.fastest_mps, -truth.v_WB.z());
    const double axial = -truth.X_WB.R.col(2).dot(truth.v_WB - loop.physics.wind_W());
    if (std::abs(truth.v_WB.z()) < LandDetectorConfig{}.still_speed_mps && axial > out.axial_mps) {
      out.axial_mps = axial;
      double surplus = 0;  // kT w v / (D J0 / 2 pi)
      for (const double speed : truth.rotor_radps) {
        surplus += rotor.thrust_coefficient * speed * axial * 2 * std::numbers::pi /
                   (rotor.diameter_m * rotor.zero_thrust_advance_ratio);
      }
      out.surplus = surplus / (VehicleConfig{}.mass_kg * kGravity);
    }
    out.stayed_flying &= loop.autopilot.state() == AutopilotState::kFlying;
    out.contact_ticks += loop.autopilot.ground_contact();
  }
  return out;
}

TEST(Flight, LandDetectionIsSilentInDivesThroughRealAir) {
  for (const Vec3& wind : {kLightWind, Vec3(4, -3, 0)}) {
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
      ClosedLoop loop(options_in(wind), seed);
      ASSERT_NO_FATAL_FAILURE(take_off(loop, 0.5));
      const Dives dives = dive(loop, seed);
      EXPECT_TRUE(dives.stayed_flying) << seed;
      EXPECT_EQ(dives.contact_ticks, 0) << seed;
      EXPECT_GT(dives.fastest_mps, 4.0);
      EXPECT_LT(loop.tilt_error(), 3 * kDegree);
    }
  }
}

TEST(Flight, WithoutBelievedInflowBrakingLooksLikeGround) {
  int contact_ticks = 0;
  double surplus = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    ClosedLoop::Options options = options_in(kLightWind);
    options.autopilot.motor.zero_thrust_pitch_m = 1e9;
    ClosedLoop loop(options, seed);
    ASSERT_NO_FATAL_FAILURE(take_off(loop));
    const Dives dives = dive(loop, seed);
    contact_ticks += dives.contact_ticks;
    surplus = std::max(surplus, dives.surplus);
  }
  EXPECT_GT(contact_ticks, 0);
  EXPECT_GT(surplus, LandDetectorConfig{}.contact_fraction);
}

/// Twelve seconds of climb and hover on a frame whose load has this inertia over the plate's.
struct FrameRun {
  double gyro_rms = 0, position_rms = 0;  ///< of the last six seconds
};
FrameRun hover_on_frame(double coupling, std::uint64_t seed) {
  ClosedLoop::Options options = options_in(Vec3::Zero());
  options.physics.frame.load_ratio = coupling;
  ClosedLoop loop(options, seed);
  EXPECT_TRUE(loop.start());
  ErrorStatistics rate, position;
  for (int i = 0; i < 12000; ++i) {
    loop.step(hover_point());
    if (i < 6000) continue;
    rate.add(loop.autopilot.attitude().w_AB_B.norm());
    position.add((loop.odometry().X_OB.p - hover_point().p_OB).norm());
  }
  return {rate.rms(), position.rms()};
}

// A rotor's acceleration turns the body in yaw without the lag of thrust: demanded yaw torque is
// overdriven eightfold at 80 Hz, and the loop turns round by half a turn there. The frame's mode
// multiplies that by coupling / (2 * 0.03), so that the loop is unstable from a coupling of about
// 0.7 on; roll and pitch stay a factor of ten below.
TEST(Flight, WeakFrameIsShakenByTheRateLoopThatHearsItAndAHealthyOneIsNot) {
  for (const std::uint64_t seed : kSeeds) {
    const FrameRun stiff = hover_on_frame(0, seed), sound = hover_on_frame(0.25, seed);
    const FrameRun weak = hover_on_frame(2, seed);
    EXPECT_LT(sound.gyro_rms, 3 * stiff.gyro_rms);
    EXPECT_LT(sound.position_rms, 0.01);
    EXPECT_GT(weak.gyro_rms, 10 * stiff.gyro_rms);  // which rotors shake, too
    EXPECT_GT(weak.position_rms, 0.1);
  }
}

}  // namespace
}  // namespace arex::sim
