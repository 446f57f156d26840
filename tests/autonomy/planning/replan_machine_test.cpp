#include "planning/replan_machine.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "autonomy/planning/test_grid.h"
#include "math/so3.h"
#include "support/pillar_field.h"

namespace arex {
namespace {

constexpr Stamp kPeriod = 10 * kNanosecondsPerTick;  // the controller's 100 Hz
constexpr int kTickEvery = 5;                        // 20 Hz

/// A vehicle that tracks its setpoints perfectly, and what the machine did with it.
class Flight {
 public:
  Flight(ReplanMachine& machine, const Vec3& start) : machine_(machine) {
    odometry_.X_OB.p = start;
    odometry_.status = OdometryStatus::kOk;
  }

  void step(const GridView& grid) {
    now_ += kPeriod;
    odometry_.stamp = now_;
    if (count_++ % kTickEvery == 0) {
      machine_.tick(grid, odometry_, now_);
      for (const PlannerEvent& event : machine_.take_events()) events_.push_back(event);
    }
    if (machine_.state() == ReplanState::kInit) return;
    const TrajectorySetpoint next = machine_.setpoint(now_);
    const double h = to_seconds(kPeriod);
    if (flying_) {  // position, velocity and acceleration may not jump beyond their own integrals
      p_jump_ = std::max(p_jump_, (next.p_OB - last_.p_OB - h * last_.v_OB).norm());
      v_jump_ = std::max(v_jump_, (next.v_OB - last_.v_OB).norm() / h);
      a_jump_ = std::max(a_jump_, (next.a_OB - last_.a_OB).norm());
    }
    last_ = next;
    flying_ = true;
    touched_ |= grid.inflated(next.p_OB);
    occupied_ |= (grid.at(next.p_OB) & GridView::kOccupied) != 0;
    fastest_ = std::max(fastest_, next.v_OB.norm());
    odometry_.X_OB = {so3::from_yaw(next.yaw_rad), next.p_OB};
    odometry_.v_OB = next.v_OB;
  }
  /// Until the target is reached, given up, or time is over.
  void run(const GridView& grid, double seconds) {
    for (int i = 0; i < static_cast<int>(seconds / to_seconds(kPeriod)); ++i) {
      step(grid);
      if (!machine_.has_target() || machine_.needs_target()) return;
    }
  }
  [[nodiscard]] int count(PlannerEventKind kind) const {
    return static_cast<int>(std::count_if(events_.begin(), events_.end(),
                                          [&](const auto& event) { return event.kind == kind; }));
  }

  ReplanMachine& machine_;
  Odometry odometry_;
  Stamp now_ = 0;
  int count_ = 0;
  TrajectorySetpoint last_;
  bool flying_ = false, touched_ = false, occupied_ = false;
  double p_jump_ = 0, v_jump_ = 0, a_jump_ = 0, fastest_ = 0;
  std::vector<PlannerEvent> events_;
};

ReplanMachine make_machine(std::uint64_t seed = 1) {
  return {ReplanConfig(), LocalPlannerConfig(), YawConfig(), seed};
}

TEST(ReplanMachine, FliesThroughPillarsContinuously) {
  support::PillarFieldOptions options;
  options.pillars = 60;
  options.inflation_m = 0.5;
  const LocalPlannerConfig planner;
  int flights = 0;
  for (std::uint64_t i = 0; i < 8; ++i) {
    const support::PillarField field(options, 3, i);
    const GridView grid = field.view();
    const auto drawn = support::draw_case(grid, RandomStream(3, "fsm").fork(i), 15.0);
    if (!drawn.valid) continue;
    ReplanMachine machine = make_machine(i);
    Flight flight(machine, drawn.start);
    flight.step(grid);
    machine.set_target(drawn.goal, {}, flight.now_);
    flight.run(grid, 60);
    EXPECT_EQ(flight.count(PlannerEventKind::kTargetReached), 1);
    EXPECT_GT(machine.counts().plans, 3);
    EXPECT_FALSE(flight.touched_);
    EXPECT_LT((flight.last_.p_OB - drawn.goal).norm(), 0.3);
    EXPECT_LT(flight.p_jump_, 1e-3);
    EXPECT_LT(flight.v_jump_, 1.05 * planner.max_acceleration_mps2);
    // One control period of the steepest build-up: a limit swing per timing knot span.
    EXPECT_LT(flight.a_jump_,
              2.1 * planner.max_acceleration_mps2 * 0.01 / planner.timing_knot_span_s);
    EXPECT_LT(flight.fastest_, 1.05 * planner.max_speed_mps);
    ++flights;
  }
  EXPECT_GE(flights, 6);
}

TEST(ReplanMachine, FliesSlowlyWhileTheOdometryIsDegenerate) {
  const test::TestGrid grid(240, 60, 20);
  const ReplanConfig config;
  ReplanMachine machine = make_machine();
  Flight flight(machine, {1.05, 3.05, 1.05});
  const auto fly = [&](double seconds) {
    for (int i = 0; i < static_cast<int>(seconds / to_seconds(kPeriod)); ++i) {
      flight.step(grid.view());
    }
    return flight.last_.v_OB.norm();
  };
  flight.step(grid.view());
  machine.set_target({22.0, 3.0, 1.0}, {}, flight.now_);
  EXPECT_GT(fly(3.0), 1.7);
  flight.odometry_.status = OdometryStatus::kDegenerate;
  fly(1.0);  // from 2 m/s it takes 0.4 s at the acceleration limit
  flight.fastest_ = 0;
  EXPECT_GT(fly(5.0), 0.6);
  EXPECT_LE(flight.fastest_, 1.05 * config.degenerate_speed_mps);
  flight.odometry_.status = OdometryStatus::kOk;
  EXPECT_GT(fly(2.0), 1.6);
  flight.run(grid.view(), 30);
  EXPECT_EQ(flight.count(PlannerEventKind::kTargetReached), 1);
  EXPECT_EQ(flight.count(PlannerEventKind::kEmergencyStop), 0);
  EXPECT_LT(flight.p_jump_, 1e-3);
  EXPECT_LT(flight.v_jump_, 1.05 * LocalPlannerConfig().max_acceleration_mps2);
}

TEST(ReplanMachine, SameStampsGiveTheSameFlight) {
  support::PillarFieldOptions options;
  const support::PillarField field(options, 4, 0);
  const auto drawn = support::draw_case(field.view(), RandomStream(4, "fsm"), 12.0);
  std::array<std::vector<Vec3>, 2> flown;
  for (auto& path : flown) {
    ReplanMachine machine = make_machine();
    Flight flight(machine, drawn.start);
    flight.step(field.view());
    machine.set_target(drawn.goal, {}, flight.now_);
    for (int i = 0; i < 800; ++i) {
      flight.step(field.view());
      path.push_back(flight.last_.p_OB);
    }
  }
  EXPECT_EQ(flown[0], flown[1]);
}

TEST(ReplanMachine, AvoidsOrStopsForWhatAppears) {
  for (const double distance : {0.75, 1.2, 2.0, 3.0}) {
    test::TestGrid grid(160, 80, 20);
    ReplanMachine machine = make_machine();
    Flight flight(machine, {1.05, 4.05, 1.05});
    flight.step(grid.view());
    machine.set_target({14.0, 4.05, 1.05}, {}, flight.now_);
    while (flight.last_.p_OB.x() < 5.0) flight.step(grid.view());
    const int x = static_cast<int>(std::ceil((flight.last_.p_OB.x() + distance) / 0.1)) + 3;
    grid.add_obstacle({x, 36, 0}, {x + 2, 44, 19}, 3);
    flight.touched_ = false;
    flight.run(grid.view(), 60);
    EXPECT_EQ(flight.count(PlannerEventKind::kTargetReached), 1) << distance;
    EXPECT_FALSE(flight.occupied_) << distance;
    EXPECT_FALSE(flight.touched_) << distance;
    EXPECT_LT(flight.p_jump_, 1e-3);
  }
}

TEST(ReplanMachine, StopsWhenAWallAppearsAndSaysWhy) {
  test::TestGrid grid(160, 80, 20);
  ReplanMachine machine = make_machine();
  Flight flight(machine, {1.05, 4.05, 1.05});
  flight.step(grid.view());
  machine.set_target({14.0, 4.05, 1.05}, {}, flight.now_);
  while (flight.last_.p_OB.x() < 5.0) flight.step(grid.view());
  const int x = static_cast<int>(std::ceil((flight.last_.p_OB.x() + 1.3) / 0.1));
  grid.mark({x, 0, 0}, {x + 10, 79, 19}, GridView::kInflated);
  flight.run(grid.view(), 60);
  EXPECT_FALSE(flight.touched_);
  EXPECT_GE(flight.count(PlannerEventKind::kEmergencyStop), 1);
  EXPECT_GE(flight.count(PlannerEventKind::kBackOff), 1);
  EXPECT_EQ(flight.count(PlannerEventKind::kAskForTarget), 1);
  EXPECT_TRUE(machine.needs_target());
  EXPECT_EQ(machine.cause(), StuckCause::kNoPath);
  // Another target is flown to.
  machine.set_target({2.0, 6.0, 1.05}, {}, flight.now_);
  flight.run(grid.view(), 60);
  EXPECT_EQ(flight.count(PlannerEventKind::kTargetReached), 1);
}

TEST(ReplanMachine, FliesBackAllTheWayOutOfAPocketThatClosesBehindIt) {
  test::TestGrid grid(160, 80, 20);
  ReplanMachine machine = make_machine();
  Flight flight(machine, {1.05, 4.05, 1.05});
  flight.step(grid.view());
  machine.set_target({9.05, 4.05, 1.05}, {}, flight.now_);
  flight.run(grid.view(), 30);
  ASSERT_EQ(flight.count(PlannerEventKind::kTargetReached), 1);
  // Inflation, all around it and 5 m of the way that it came; nothing stands on the way itself.
  grid.mark({30, 0, 0}, {84, 79, 19}, GridView::kInflated);
  grid.mark({95, 0, 0}, {159, 79, 19}, GridView::kInflated);
  machine.set_target({1.05, 7.05, 1.05}, {}, flight.now_);
  flight.run(grid.view(), 60);
  EXPECT_EQ(flight.count(PlannerEventKind::kTargetReached), 2);
  EXPECT_GE(flight.count(PlannerEventKind::kBackOff), 3);
  EXPECT_FALSE(flight.occupied_);
  EXPECT_LT(flight.p_jump_, 1e-3);
}

TEST(ReplanMachine, DoesNotFlyBackForATargetThatIsShutIn) {
  test::TestGrid grid(160, 80, 20);
  ReplanMachine machine = make_machine();
  Flight flight(machine, {1.05, 4.05, 1.05});
  flight.step(grid.view());
  machine.set_target({9.05, 4.05, 1.05}, {}, flight.now_);
  flight.run(grid.view(), 30);
  grid.mark({105, 0, 0}, {110, 79, 19}, GridView::kInflated);
  machine.set_target({14.05, 4.05, 1.05}, {}, flight.now_);
  flight.run(grid.view(), 60);
  EXPECT_TRUE(machine.needs_target());
  EXPECT_EQ(flight.count(PlannerEventKind::kBackOff), 1);
  EXPECT_GT(flight.last_.p_OB.x(), 6.5);
}

TEST(ReplanMachine, EscapesFromAnInflationThatGrowsOverIt) {
  test::TestGrid grid(100, 100, 20);
  ReplanMachine machine = make_machine();
  Flight flight(machine, {3.05, 5.05, 1.05});
  flight.step(grid.view());
  grid.add_obstacle({33, 48, 0}, {35, 53, 19}, 6);  // 0.25 m ahead: nearer than the true radius
  ASSERT_TRUE(grid.view().inflated(flight.last_.p_OB));
  machine.set_target({8.0, 5.05, 1.05}, {}, flight.now_);
  flight.run(grid.view(), 60);
  EXPECT_GE(flight.count(PlannerEventKind::kEscape), 1);
  EXPECT_EQ(flight.count(PlannerEventKind::kTargetReached), 1);
  EXPECT_FALSE(flight.occupied_);
}

TEST(ReplanMachine, FliesOnOutOfAnInflationThatGrazesIt) {
  test::TestGrid grid(160, 80, 20);
  ReplanMachine machine = make_machine();
  Flight flight(machine, {1.05, 4.05, 1.05});
  flight.step(grid.view());
  machine.set_target({14.0, 4.05, 1.05}, {}, flight.now_);
  while (flight.last_.p_OB.x() < 5.0) flight.step(grid.view());
  const int x = static_cast<int>(flight.last_.p_OB.x() / 0.1);
  grid.add_obstacle({x, 45, 0}, {x + 1, 47, 19}, 5);  // 0.45 m aside: inside 0.5, outside 0.3
  ASSERT_TRUE(grid.view().inflated(flight.last_.p_OB));
  flight.run(grid.view(), 60);
  EXPECT_EQ(flight.count(PlannerEventKind::kEmergencyStop), 0);
  EXPECT_EQ(flight.count(PlannerEventKind::kTargetReached), 1);
}

TEST(ReplanMachine, PlansOnFromWithinTheInflationWithoutComingNearer) {
  for (const int aside : {3, 4}) {  // whole cells between the path's and the obstacle's
    test::TestGrid grid(160, 80, 20);
    ReplanMachine machine = make_machine();
    Flight flight(machine, {1.05, 4.05, 1.05});
    flight.step(grid.view());
    machine.set_target({14.0, 4.05, 1.05}, {}, flight.now_);
    while (flight.last_.p_OB.x() < 5.0) flight.step(grid.view());
    const int x = static_cast<int>(flight.last_.p_OB.x() / 0.1);
    // A hedge along the way: the trajectory in force would stay inside its inflation for long.
    grid.add_obstacle({x - 2, 41 + aside, 0}, {x + 60, 43 + aside, 19}, 5);
    ASSERT_TRUE(grid.view().inflated(flight.last_.p_OB));
    double nearest = 1e9;
    for (int i = 0; i < 2000 && machine.has_target(); ++i) {
      flight.step(grid.view());
      nearest = std::min(nearest, clearance(grid.view(), flight.last_.p_OB, 1.0));
    }
    EXPECT_EQ(flight.count(PlannerEventKind::kEmergencyStop), 0) << aside;
    EXPECT_EQ(flight.count(PlannerEventKind::kPlanFailed), 0) << aside;
    EXPECT_EQ(flight.count(PlannerEventKind::kTargetReached), 1) << aside;
    EXPECT_GE(nearest, LocalPlannerConfig().vehicle_radius_m - 1e-3) << aside;
  }
}

TEST(ReplanMachine, DemandsTheAccelerationOfTheMomentAtWhichItActs) {
  const test::TestGrid grid(160, 80, 20);
  ReplanMachine machine = make_machine();
  Flight flight(machine, {1.05, 4.05, 1.05});
  flight.step(grid.view());
  machine.set_target({14.0, 4.05, 1.05}, {}, flight.now_);
  while (flight.last_.v_OB.norm() < 0.5) flight.step(grid.view());
  const double t = to_seconds(flight.now_ - machine.trajectory_start());
  const TrajectorySetpoint ahead = machine.setpoint(flight.now_, 0.15);
  EXPECT_EQ(ahead.p_OB, machine.trajectory().position(t));
  EXPECT_LT((ahead.a_OB - machine.trajectory().state(t + 0.15).a).norm(), 1e-9);
  EXPECT_GT((ahead.a_OB - machine.trajectory().state(t).a).norm(), 1e-3);
}

TEST(ReplanMachine, HoldsWhenOdometryIsLost) {
  const test::TestGrid grid(160, 80, 20);
  ReplanMachine machine = make_machine();
  Flight flight(machine, {1.05, 4.05, 1.05});
  flight.step(grid.view());
  machine.set_target({14.0, 4.05, 1.05}, {}, flight.now_);
  while (flight.last_.p_OB.x() < 5.0) flight.step(grid.view());
  flight.odometry_.status = OdometryStatus::kLost;
  for (int i = 0; i < 300; ++i) flight.step(grid.view());
  EXPECT_EQ(machine.cause(), StuckCause::kOdometryLost);
  EXPECT_LT(flight.last_.v_OB.norm(), 1e-6);
  EXPECT_LT(flight.last_.p_OB.x(), 6.5);
}

TEST(ReplanMachine, GivesUpATargetThatItGetsNoNearerTo) {
  const test::TestGrid grid(160, 80, 20);
  ReplanMachine machine = make_machine();
  Flight flight(machine, {1.05, 4.05, 1.05});
  const Vec3 held = flight.odometry_.X_OB.p;
  flight.step(grid.view());
  machine.set_target({14.0, 4.05, 1.05}, {}, flight.now_);
  for (int i = 0; i < 3000 && !machine.needs_target(); ++i) {
    flight.step(grid.view());
    flight.odometry_.X_OB.p = held;  // by a gust, say: plans succeed, the vehicle stays
  }
  EXPECT_EQ(machine.cause(), StuckCause::kNoProgress);
  EXPECT_NEAR(to_seconds(flight.now_), ReplanConfig().target_timeout_s, 1.0);
}

TEST(ReplanMachine, ALongWayRoundIsProgress) {
  // 44 m of guide, 22 s and more, to a target 2 m away: never nearer to it for most of that.
  const test::TestGrid grid(260, 80, 20);
  ReplanConfig config;
  config.target_timeout_s = 3.0;
  ReplanMachine machine(config, LocalPlannerConfig(), YawConfig(), 1);
  Flight flight(machine, {1.55, 3.05, 1.05});
  flight.step(grid.view());
  machine.set_target({1.55, 5.05, 1.05},
                     {{1.55, 3.05, 1.05}, {23, 3.05, 1.05}, {23, 5.05, 1.05}, {1.55, 5.05, 1.05}},
                     flight.now_);
  flight.run(grid.view(), 90);
  EXPECT_EQ(flight.count(PlannerEventKind::kTargetReached), 1) << to_string(machine.cause());
}

// The way turns out longer once: honest. A guide that changes sides each time the vehicle gets near
// would look like progress for ever.
TEST(ReplanMachine, FlyingToAndFroIsNoProgress) {
  const test::TestGrid grid(160, 80, 20);
  ReplanMachine machine = make_machine();
  Flight flight(machine, {4.05, 4.05, 1.05});
  flight.step(grid.view());
  const Vec3 target(8.05, 9.5, 1.05);  // beyond the grid, behind a wall
  const std::vector<Vec3> left{{1.55, 4.05, 1.05}, {1.55, 7, 1.05}},
      right{{14.55, 4.05, 1.05}, {14.55, 7, 1.05}};
  machine.set_target(target, left, flight.now_);
  bool to_left = true;
  for (int i = 0; i < 30000 && !machine.needs_target(); ++i) {
    flight.step(grid.view());
    const Vec3& p = flight.odometry_.X_OB.p;
    if ((p - (to_left ? left : right).front()).norm() < 1.5) {
      to_left = !to_left;
      std::vector<Vec3> guide = to_left ? left : right;
      guide.insert(guide.begin(), p);
      machine.set_guide(std::move(guide));
    }
  }
  EXPECT_EQ(machine.cause(), StuckCause::kNoPath);
  EXPECT_LT(to_seconds(flight.now_), 150);
}

TEST(ReplanMachine, GivesUpABlockedTargetOnlyIfItStillIsBlockedOnArrival) {
  for (const bool ghost : {false, true}) {
    test::TestGrid grid(120, 80, 20);
    const Eigen::Vector3i low(84, 34, 0), high(96, 46, 19);  // about the target
    grid.mark(low, high, GridView::kInflated);
    ReplanMachine machine = make_machine();
    Flight flight(machine, {3.05, 4.05, 1.05});
    flight.step(grid.view());
    machine.set_target({9.05, 4.05, 1.05}, {}, flight.now_);
    while (flight.last_.p_OB.x() < 7.5 && flight.now_ < from_seconds(20)) flight.step(grid.view());
    if (ghost) {
      grid.forget(low, high);
      grid.mark(low, high, GridView::kKnown);
    }
    flight.run(grid.view(), 20);
    EXPECT_EQ(flight.count(PlannerEventKind::kTargetReached), ghost);
    EXPECT_EQ(flight.count(PlannerEventKind::kAskForTarget), !ghost);
    EXPECT_EQ(machine.cause() == StuckCause::kGoalInInflation, !ghost);
  }
}

TEST(ReplanMachine, FollowsAGuideAroundWhatTheGridDoesNotShow) {
  const test::TestGrid grid(300, 300, 30, 0.1, {-15, -15, 0});
  ReplanMachine machine = make_machine();
  Flight flight(machine, {-10, -10, 1.5});
  flight.step(grid.view());
  machine.set_target({10, 10, 1.5}, {{-10, -10, 1.5}, {10, -10, 1.5}, {10, 10, 1.5}}, flight.now_);
  double nearest_corner = 1e9;
  for (int i = 0; i < 6000 && machine.has_target(); ++i) {
    flight.step(grid.view());
    nearest_corner = std::min(nearest_corner, (flight.last_.p_OB - Vec3(10, -10, 1.5)).norm());
  }
  EXPECT_EQ(flight.count(PlannerEventKind::kTargetReached), 1);
  EXPECT_LT(nearest_corner, 4.0);
}

/// How far from its guide's height a vehicle comes that flies down a ramp of 30 degrees, which
/// leaves its flat grid after two metres; m.
double height_error_on_a_ramp(bool follow_ground) {
  ReplanConfig config;
  config.follow_ground = follow_ground;
  ReplanMachine machine(config, LocalPlannerConfig(), YawConfig(), 1);
  const double slope = std::tan(M_PI / 6);
  const auto way = [&](double x) { return Vec3(x, 0, 1.5 - slope * std::clamp(x, 0.0, 12.0)); };
  std::vector<Vec3> guide;
  for (double x = -2; x <= 15; x += 0.5) guide.push_back(way(x));
  Flight flight(machine, guide.front());
  const auto around = [](const Vec3& p) {  // 3 m high, as the vehicle's own is
    const Vec3 low = ((p - Vec3(8, 8, 1.5)) / 0.1).array().round() * 0.1;
    return test::TestGrid(160, 160, 30, 0.1, low);
  };
  flight.step(around(guide.front()).view());
  machine.set_target(guide.back(), guide, flight.now_);
  double off = 0;
  for (int i = 0; i < 4000 && machine.has_target() && !machine.needs_target(); ++i) {
    const Vec3 p = flight.odometry_.X_OB.p;
    flight.step(around(p).view());
    off = std::max(off, std::abs(flight.last_.p_OB.z() - way(flight.last_.p_OB.x()).z()));
  }
  EXPECT_EQ(flight.count(PlannerEventKind::kTargetReached), 1);
  return off;
}

TEST(ReplanMachine, FollowsAGuideDownARampAsFarAsTheGridShowsIt) {
  // At 1.5 m above a ramp the inflation begins 0.7 m below.
  EXPECT_LT(height_error_on_a_ramp(true), 0.7);
  EXPECT_GT(height_error_on_a_ramp(false), 1.0);
}

TEST(ReplanMachine, AsPrintedItFliesStraightAndTurnsTowardsTheTargetAtOnce) {
  const test::TestGrid grid(300, 300, 30, 0.1, {-15, -15, 0});
  YawConfig yaw;
  yaw.mode = YawMode::kTowardsTarget;
  ReplanMachine machine(ReplanConfig(), LocalPlannerConfig(), yaw, 1);
  const Vec3 start(10, 10, 1.5), target(-10, -10, 1.5);  // behind: heading is +x
  Flight flight(machine, start);
  flight.step(grid.view());
  machine.set_target(target, {}, flight.now_);
  const Vec3 way = (target - start).normalized();
  for (int i = 0; i < 6000 && machine.has_target(); ++i) {
    const Vec3 before = flight.last_.p_OB;
    flight.step(grid.view());
    EXPECT_LT((before - start).cross(way).norm(), 0.1);
    if ((target - before).norm() < 0.5) continue;
    EXPECT_NEAR(so3::wrap(flight.last_.yaw_rad - std::atan2(-1, -1)), 0, 0.1);
  }
  EXPECT_EQ(flight.count(PlannerEventKind::kTargetReached), 1);
}

TEST(ReplanMachine, LooksBeforeItFliesAndNeverOutrunsWhatItKnows) {
  test::TestGrid grid(160, 80, 20);
  grid.forget({0, 0, 0}, {159, 79, 19});
  const LocalPlannerConfig planner;
  ReplanMachine machine = make_machine();
  Flight flight(machine, {13.05, 4.05, 1.05});
  grid.mark({110, 0, 0}, {150, 79, 19}, GridView::kKnown);
  flight.step(grid.view());
  machine.set_target({2.0, 4.05, 1.05}, {}, flight.now_);  // behind: heading is +x
  int known_to = 110;
  double worst = 0;
  for (int i = 0; i < 4000 && machine.has_target(); ++i) {
    flight.step(grid.view());
    if (flight.last_.v_OB.norm() > 0.2) {
      const double heading = std::atan2(flight.last_.v_OB.y(), flight.last_.v_OB.x());
      EXPECT_LT(std::abs(so3::wrap(heading - flight.last_.yaw_rad)), 1.0);
    }
    const double v = flight.last_.v_OB.norm();
    if (v > planner.unknown_speed_mps * 1.1) {
      const double braking = v * v / (2 * planner.max_acceleration_mps2);
      worst = std::max(worst, braking - (flight.last_.p_OB.x() - 0.1 * known_to));
    }
    // The map grows 2 m ahead every second.
    if (i % 100 == 99 && known_to > 0) {
      const int next = std::max(0, static_cast<int>(flight.last_.p_OB.x() * 10) - 20);
      if (next < known_to) {
        grid.mark({next, 0, 0}, {known_to, 79, 19}, GridView::kKnown);
        known_to = next;
      }
    }
  }
  EXPECT_EQ(flight.count(PlannerEventKind::kTargetReached), 1);
  EXPECT_LT(worst, 0.05);
}

TEST(ReplanMachine, BrakesBeforeSpaceThatTurnsOutUnknownAndThenFliesOn) {
  test::TestGrid grid(160, 80, 20);
  ReplanMachine machine = make_machine();
  Flight flight(machine, {2.05, 4.05, 1.05});
  flight.step(grid.view());
  machine.set_target({13.05, 4.05, 1.05}, {}, flight.now_);
  while (flight.last_.p_OB.x() < 8.0 && machine.has_target()) flight.step(grid.view());
  // The target is in sight and planned to, then the map forgets what is a metre ahead.
  const double speed = flight.last_.v_OB.norm();
  ASSERT_GT(speed, 1.5);
  grid.forget({88, 0, 0}, {159, 79, 19});
  flight.run(grid.view(), 4);
  EXPECT_TRUE(machine.has_target());
  EXPECT_LT(flight.last_.v_OB.norm(), LocalPlannerConfig().unknown_speed_mps * 1.1);
  grid.mark({0, 0, 0}, {159, 79, 19}, GridView::kKnown);  // a look is enough
  flight.run(grid.view(), 20);
  EXPECT_EQ(flight.count(PlannerEventKind::kAskForTarget), 0);
  EXPECT_EQ(flight.count(PlannerEventKind::kTargetReached), 1);
}

}  // namespace
}  // namespace arex
