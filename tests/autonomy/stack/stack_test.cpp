#include "stack/stack.h"

#include <gtest/gtest.h>

#include "math/so3.h"
#include "support/analytic_world.h"

namespace arex {
namespace {

constexpr Stamp kTick = kNanosecondsPerTick;
constexpr Stamp kFrame = 100 * kTick;

/// The flight software on mocap, in the hall or elsewhere: its vehicle is where the setpoint is,
/// and its sensors tell what the test wants.
class HallFlight {
 public:
  explicit HallFlight(const StackConfig& config,
                      test::AnalyticWorld world = test::AnalyticWorld::hall())
      : stack_(config, jobs_, 1), world_(std::move(world)) {}

  /// Flies on; `X_OO` is what the odometry's frame has slipped by: estimates are X_OO times true.
  void run(double seconds, const Pose& X_OO = {}) {
    for (const Stamp end = now_ + from_seconds(seconds); now_ < end; now_ += kTick) {
      stack_.begin(now_);
      if (now_ % (5 * kTick) == 0) {
        AutopilotStatus autopilot;
        autopilot.attitude.R_AB = X_.R;
        autopilot.ready = autopilot.follows = true;
        autopilot.armed = stack_.view().state != MissionState::kInitialise;
        autopilot.landed = !autopilot.armed;
        stack_.add_autopilot(autopilot);
        if (tracked_) stack_.add_mocap({now_, X_OO * X_, Vec3::Zero()});
      }
      if (now_ % kFrame == 0 && now_ > 0) {
        const test::AnalyticMotion still{{(Vec4() << X_.p, so3::yaw(X_.R)).finished()}, 1, 1000};
        stack_.add_scan(std::make_shared<LidarScan>(
            test::simulate_scan(world_, still, VehicleConfig{}.X_BL(), now_ - kFrame,
                                test::SensorNoise::none(), 1, 8)));
      }
      jobs_.advance(now_);
      const TrajectorySetpoint before = stack_.view().setpoint;
      if (const auto command = stack_.tick()) command_ = *command;
      largest_step_m_ =
          std::max(largest_step_m_, (stack_.view().setpoint.p_OB - before.p_OB).norm());
      X_ = X_OO.inverse() *
           Pose{so3::from_yaw(stack_.view().setpoint.yaw_rad), stack_.view().setpoint.p_OB};
    }
  }

  JobQueue jobs_{1};
  Stack stack_;
  test::AnalyticWorld world_;
  Stamp now_ = 0;
  Pose X_;  ///< of the vehicle in the true O
  double largest_step_m_ = 0;
  bool tracked_ = true;  ///< its pose comes
  AttitudeCommand command_;
};

StackConfig goals(std::vector<Vec3> points) {
  StackConfig config;
  config.odometry.source = "mocap";
  config.mapping.local.use_depth = false;
  config.mission.kind = MissionConfig::Kind::kGoals;
  config.mission.waypoints_m = std::move(points);
  config.mission.settle_s = 0.5;
  return config;
}

std::string events_of(Stack& stack, EventKind kind) {
  std::string text;
  for (const Event& event : stack.take_events()) {
    if (event.kind == kind) text += event.detail + ";";
  }
  return text;
}

// The pose slips by more than a metre and half a radian in one step: what was mapped before lies in
// the wrong place, and so do the plan and its setpoint.
TEST(Stack, AfterAJumpTheMapIsForgottenAndTheFlightGoesOnFromWhereItIs) {
  HallFlight flight(goals({{8, 0, 1.5}, {0, 0, 1.5}}));
  flight.run(8);
  ASSERT_EQ(flight.stack_.view().state, MissionState::kFly);
  ASSERT_TRUE(flight.stack_.view().grid);
  const Vec3 before = flight.X_.p;
  const Pose slip{so3::from_yaw(0.3), {1.0, -0.6, 0.1}};
  flight.run(0.02, slip);
  // Nothing of before is left ...
  EXPECT_FALSE(flight.stack_.view().grid);
  // ... the vehicle is asked to stay where it is ...
  EXPECT_LT((flight.X_.p - before).norm(), 0.05);
  EXPECT_LT((flight.stack_.view().setpoint.p_OB - slip * before).norm(), 0.05);
  // ... and goes on when there is a map again.
  flight.largest_step_m_ = 0;
  flight.run(40, slip);
  EXPECT_LT(flight.largest_step_m_, 0.05);
  EXPECT_TRUE(flight.stack_.view().grid);
  EXPECT_EQ(flight.stack_.view().stuck, "");
  EXPECT_EQ(flight.stack_.view().targets.size(), 2U);
}

// Without a pose it hovers level on what it weighs, and goes on with what it was about when the
// pose is back in time; after that it comes down, and says that it was lost.
TEST(Stack, WithoutOdometryItHoversLevelAndGoesOnOrComesDown) {
  StackConfig config = goals({{8, 0, 1.5}});
  config.mission.kind = MissionConfig::Kind::kWaypoints;
  HallFlight flight(config);
  flight.run(4);
  ASSERT_EQ(flight.stack_.view().state, MissionState::kFly);
  flight.tracked_ = false;
  flight.run(0.5);
  EXPECT_EQ(flight.stack_.view().state, MissionState::kLost);
  EXPECT_EQ(flight.command_.mode, AutopilotMode::kAttitude);
  EXPECT_NEAR(flight.command_.thrust_n, config.vehicle.mass_kg * kGravity, 1e-9);
  flight.tracked_ = true;
  flight.run(0.1);
  EXPECT_EQ(flight.stack_.view().state, MissionState::kFly);
  EXPECT_FALSE(flight.stack_.view().lost);
  flight.run(10);
  EXPECT_EQ(flight.stack_.view().targets.size(), 1U);
  // Once more, for too long.
  HallFlight again(config);
  again.run(4);
  again.tracked_ = false;
  again.run(config.mission.lost_hover_s + 0.5);
  EXPECT_EQ(again.command_.mode, AutopilotMode::kDescend);
  EXPECT_EQ(again.stack_.view().state, MissionState::kLost);
  again.tracked_ = true;  // it does not change its mind
  again.run(0.5);
  EXPECT_EQ(again.command_.mode, AutopilotMode::kDescend);
}

TEST(Stack, AYawBurstTurnsOnTheSpotAsFastAsAsked) {
  StackConfig config = goals({});
  config.mission.kind = MissionConfig::Kind::kYawBurst;
  config.mission.yaw_rates_radps = {0.5, 1.5};
  config.mission.yaw_burst_s = 2;
  HallFlight flight(config);
  double fastest = 0, turned = 0, furthest = 0;
  for (int k = 0; k < 200 && flight.stack_.view().state != MissionState::kLand; ++k) {
    const double yaw = so3::yaw(flight.X_.R);
    flight.run(0.1);
    if (flight.stack_.view().state != MissionState::kFly) continue;
    fastest = std::max(fastest, flight.stack_.view().setpoint.yaw_rate_radps);
    turned += so3::wrap(so3::yaw(flight.X_.R) - yaw);
    furthest = std::max(furthest, flight.X_.p.head<2>().norm());
  }
  EXPECT_EQ(flight.stack_.view().state, MissionState::kLand);
  EXPECT_NEAR(fastest, 1.5, 1e-6);
  EXPECT_GT(turned, 2 * 0.5 + 2 * 1.5 - 1);
  EXPECT_LT(furthest, 0.01);
}

// Down the entry by straight legs, then it explores: from there the explorer is asked.
TEST(Stack, EntersByLegsAndThenAsksTheExplorer) {
  StackConfig config = goals({});
  config.mission.kind = MissionConfig::Kind::kExplore;
  config.mission.entry_m = {{2, 0, 1.5}, {4, 1, 1.5}};
  HallFlight flight(config);
  bool entered = false;
  for (int k = 0; k < 300 && flight.stack_.view().state != MissionState::kExplore; ++k) {
    flight.run(0.1);
    entered |= flight.stack_.view().state == MissionState::kEntry;
    EXPECT_TRUE(flight.stack_.take_decisions().empty());
  }
  EXPECT_TRUE(entered);
  ASSERT_EQ(flight.stack_.view().state, MissionState::kExplore);
  EXPECT_LT((flight.X_.p - Vec3(4, 1, 1.5)).norm(), 0.3);
  flight.run(3);
  EXPECT_FALSE(flight.stack_.take_decisions().empty());
}

TEST(Stack, AStepSmallerThanTheMapsMarginChangesNothing) {
  HallFlight flight(goals({{8, 0, 1.5}}));
  flight.run(8);
  const auto grid = flight.stack_.view().grid;
  flight.run(0.02, {Mat3::Identity(), {0.1, 0, 0}});
  EXPECT_EQ(flight.stack_.view().grid, grid);
}

// The last waypoint is above a car: it says so, and flies on to where the ground is free.
TEST(Stack, LandsBesideNotOnWhatStandsBelowItsLastWaypoint) {
  for (const auto kind : {MissionConfig::Kind::kGoals, MissionConfig::Kind::kWaypoints}) {
    SCOPED_TRACE(static_cast<int>(kind));
    StackConfig config = goals({{4, 5, 1.5}, {4, -5, 1.5}, {10, 0, 2.5}});
    config.mission.kind = kind;
    config.mission.takeoff_height_m = 2.5;
    HallFlight flight(config, test::AnalyticWorld::parked_car());
    while (flight.stack_.view().state != MissionState::kLand && flight.now_ < from_seconds(90)) {
      flight.run(0.1);
    }
    ASSERT_EQ(flight.stack_.view().state, MissionState::kLand);
    EXPECT_EQ(flight.stack_.view().stuck, "");
    const Vec2 off =
        ((flight.X_.p.head<2>() - Vec2(10, 0)).cwiseAbs() - Vec2(2.2, 0.9)).cwiseMax(0);
    EXPECT_GT(off.norm(), 0.6);  // the vehicle and its margin
    EXPECT_NE(events_of(flight.stack_, EventKind::kRecovery).find("not clear to land"),
              std::string::npos);
  }
}

TEST(Stack, NamesASourceThatHasFallenSilentBeforeTakeOff) {
  StackConfig config = goals({{1, 0, 1}});
  config.mission.ready_timeout_s = 2;
  JobQueue jobs(1);
  Stack stack(config, jobs, 1);
  AutopilotStatus autopilot;
  autopilot.ready = true;
  for (Stamp now = 0; now < from_seconds(4); now += kTick) {
    stack.begin(now);
    stack.add_autopilot(autopilot);
    if (now < from_seconds(0.3)) stack.add_mocap({now, Pose{}, Vec3::Zero()});
    (void)stack.tick();
  }
  EXPECT_EQ(stack.view().stuck, "not_ready: no_mocap");
  EXPECT_NE(events_of(stack, EventKind::kStuck).find("not_ready"), std::string::npos);
}

}  // namespace
}  // namespace arex
