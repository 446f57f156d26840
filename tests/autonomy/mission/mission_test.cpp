#include "mission/mission.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <utility>

namespace arex {
namespace {

/// A vehicle that is wherever its last request asks it to be.
class Pilot {
 public:
  explicit Pilot(const MissionConfig& config)
      : mission(config, [this](EventKind kind, const std::string& detail) {
          if (kind == EventKind::kMissionState) states.push_back(detail);
          if (kind == EventKind::kOperator) answers.push_back(detail);
          if (kind == EventKind::kRecovery || kind == EventKind::kStuck) troubles.push_back(detail);
        }) {}

  /// Obeys for so many seconds, 50 steps a second.
  void fly(double seconds) {
    for (int k = 0; k < seconds * 50; ++k) step();
  }

  void step() {
    now += kNanosecondsPerSecond / 50;
    Mission::Inputs inputs;
    inputs.now = now;
    inputs.odometry.status = OdometryStatus::kOk;
    inputs.odometry.X_OB.p = p_O;
    inputs.autopilot_ready = true;
    inputs.armed = armed;
    const bool navigates = served == request && request.kind == MotionRequest::Kind::kGoTo;
    inputs.progress = navigates ? progress : MotionProgress::kUnderWay;
    inputs.cause = "no_path";
    inputs.below = below;
    inputs.at_reserve = at_reserve;
    if (heartbeat && now % kNanosecondsPerSecond == 0) mission.hear({}, now);
    if (mission.landing_query()) {
      queries.push_back(*mission.landing_query());
      mission.answer(places.empty() ? std::nullopt : std::optional(places.front()));
      if (!places.empty()) places.erase(places.begin());
    }
    request = mission.update(inputs);
    served = request;
    armed = request.kind != MotionRequest::Kind::kNone;
    if (request.kind == MotionRequest::Kind::kLand) {
      landed_at = p_O.head<2>();
      armed = false;
    } else if (progress != MotionProgress::kFailed && request.kind != MotionRequest::Kind::kHold) {
      p_O = request.goal_O;
    }
  }

  void ask(OperatorCommand::Kind kind, const Vec3& goal_O = Vec3::Zero()) {
    mission.hear({OperatorCommand{kind, goal_O}}, now);
  }
  void decide(const Decision& decision) { mission.decide(decision); }

  Stamp now = 0;
  Vec3 p_O = Vec3::Zero();
  bool armed = false;
  MotionRequest request, served;
  MotionProgress progress = MotionProgress::kArrived;
  Vec2 landed_at = Vec2::Constant(1e9);
  LandingGround below = LandingGround::kClear;  ///< where it would come down
  std::vector<LandingPlace> places;             ///< answers, in order
  std::vector<LandingQuery> queries;
  bool at_reserve = false;  ///< of the battery
  bool heartbeat = false;   ///< of the operator
  std::vector<std::string> states, troubles, answers;
  Mission mission;
};

MissionConfig exploration(bool land_at_start) {
  MissionConfig config;
  config.kind = MissionConfig::Kind::kExplore;
  using LandAtStart = MissionConfig::LandAtStart;
  config.land_at_start = land_at_start ? LandAtStart::kTrue : LandAtStart::kFalse;
  config.entry_m = {{5, 0, 1.5}};
  return config;
}

Decision target(const Vec3& goal_O, int sequence) {
  Decision decision;
  decision.kind = DecisionKind::kNewTarget;
  decision.sequence = sequence;
  decision.goal_O = goal_O;
  return decision;
}

Decision stop() {
  Decision decision;
  decision.kind = DecisionKind::kStop;
  decision.stop_reason = StopReason::kNoCandidates;
  return decision;
}

/// Takes off, enters, reaches one target and hears that this was all.
void explore(Pilot& pilot, const Decision& last) {
  pilot.fly(10);
  ASSERT_EQ(pilot.mission.state(), MissionState::kExplore);
  pilot.decide(target({20, 3, 1.5}, 7));
  pilot.fly(1);
  ASSERT_EQ(pilot.mission.target_progress(), TargetProgress::kReached);
  ASSERT_EQ(pilot.p_O, Vec3(20, 3, 1.5));
  pilot.decide(last);
}

TEST(Mission, ComesHomeToLand) {
  Pilot pilot(exploration(true));
  explore(pilot, stop());
  pilot.fly(2);
  EXPECT_EQ(pilot.landed_at, Vec2(0, 0));
  EXPECT_EQ(pilot.states,
            (std::vector<std::string>{"initialise", "takeoff", "entry", "explore",
                                      "stop exploring: no_candidates", "return", "land", "done"}));
  EXPECT_TRUE(pilot.mission.stuck().empty());
}

using PlaceKind = LandingPlace::Kind;

TEST(Mission, LandsOnTheClearPlaceThatTheMapNames) {
  Pilot pilot(exploration(false));
  pilot.places = {{PlaceKind::kClear, {22, 4, 1.5}}};
  explore(pilot, stop());
  pilot.fly(2);
  EXPECT_EQ(pilot.landed_at, Vec2(22, 4));
  EXPECT_EQ(pilot.mission.state(), MissionState::kDone);
  EXPECT_EQ(pilot.mission.targets().back().p_O, Vec3(22, 4, 1.5));
  EXPECT_TRUE(pilot.mission.stuck().empty());
}

TEST(Mission, FliesOnWhereAPlaceTurnsOutNotToBeClear) {
  Pilot pilot(exploration(false));
  pilot.places = {{PlaceKind::kToBeSeen, {22, 4, 1.5}}, {PlaceKind::kClear, {30, 4, 1.5}}};
  pilot.below = LandingGround::kObstructed;
  explore(pilot, stop());
  while (pilot.queries.size() < 2 && pilot.now < from_seconds(60)) pilot.step();
  pilot.below = LandingGround::kClear;
  pilot.fly(2);
  EXPECT_EQ(pilot.landed_at, Vec2(30, 4));
  ASSERT_EQ(pilot.queries.size(), 2u);
  EXPECT_EQ(pilot.queries[1].tried, std::vector<Vec2>{Vec2(22, 4)});
  EXPECT_TRUE(pilot.mission.stuck().empty());
}

TEST(Mission, SaysThatThereIsNoPlaceToLandAndTakesTheWidest) {
  for (const bool any : {true, false}) {
    Pilot pilot(exploration(false));
    if (any) pilot.places = {{PlaceKind::kWidest, {22, 4, 1.5}}};
    pilot.below = LandingGround::kObstructed;
    explore(pilot, stop());
    pilot.fly(2);
    EXPECT_EQ(pilot.landed_at, any ? Vec2(22, 4) : Vec2(20, 3));
    EXPECT_EQ(pilot.mission.stuck(), "no_landing_place");
  }
}

TEST(Mission, LandsAtAClearPlaceWhenNoWayLeadsHome) {
  MissionConfig config = exploration(true);
  config.return_tries = 3;
  Pilot pilot(config);
  pilot.places = {{PlaceKind::kClear, {22, 4, 1.5}}};
  explore(pilot, stop());
  pilot.progress = MotionProgress::kFailed;
  pilot.step();  // asks for the way
  for (int attempt = 1; attempt < config.return_tries; ++attempt) {
    pilot.step();
    EXPECT_EQ(pilot.request.attempt, attempt);
  }
  pilot.step();
  pilot.progress = MotionProgress::kArrived;
  pilot.fly(1);
  EXPECT_EQ(pilot.landed_at, Vec2(22, 4));
  EXPECT_EQ(pilot.mission.stuck(), "no_path");  // home was asked for
}

TEST(Mission, TriesSoManyPlacesToLandAndThenTheWidest) {
  MissionConfig config = exploration(false);
  config.landing.tries = 3;
  Pilot pilot(config);
  for (int k = 0; k < 3; ++k) pilot.places.push_back({PlaceKind::kClear, {22.0 + 2 * k, 4, 1.5}});
  explore(pilot, stop());
  pilot.progress = MotionProgress::kFailed;
  pilot.fly(2);
  ASSERT_EQ(pilot.queries.size(), 4u);
  EXPECT_FALSE(pilot.queries[2].last_resort);
  EXPECT_TRUE(pilot.queries[3].last_resort);
  EXPECT_EQ(pilot.queries[3].tried.size(), 3u);
  EXPECT_EQ(pilot.mission.stuck(), "no_landing_place");
}

TEST(Mission, LandsWhereToldUnlessTheMapKnowsThatSomethingStandsThere) {
  for (const auto kind : {MissionConfig::Kind::kWaypoints, MissionConfig::Kind::kGoals}) {
    for (const auto below :
         {LandingGround::kClear, LandingGround::kUnknown, LandingGround::kObstructed}) {
      MissionConfig config;
      config.kind = kind;
      config.waypoints_m = {{5, 0, 1.5}, {9, 0, 1.5}};
      Pilot pilot(config);
      pilot.places = {{PlaceKind::kClear, {9, 3, 1.5}}};
      pilot.below = below;
      while (pilot.queries.empty() && pilot.now < from_seconds(30)) pilot.step();
      pilot.below = LandingGround::kClear;
      pilot.fly(2);
      const bool moved = below == LandingGround::kObstructed;
      EXPECT_EQ(pilot.landed_at, moved ? Vec2(9, 3) : Vec2(9, 0));
      EXPECT_EQ(pilot.troubles.empty(), !moved);  // it says so
    }
  }
}

TEST(Mission, TellsTheExplorerOfATargetThatItCannotReach) {
  Pilot pilot(exploration(false));
  pilot.fly(10);
  pilot.progress = MotionProgress::kFailed;
  pilot.decide(target({20, 3, 1.5}, 1));
  pilot.fly(1);
  EXPECT_EQ(pilot.mission.state(), MissionState::kExplore);
  EXPECT_EQ(pilot.mission.target_progress(), TargetProgress::kUnreachable);
  EXPECT_TRUE(pilot.mission.targets().empty());
}

/// A mission whose inputs the test sets: what it asks for, and how it ends.
class Desk {
 public:
  explicit Desk(const MissionConfig& config)
      : mission(config, [this](EventKind kind, const std::string& detail) {
          if (kind == EventKind::kStuck) stuck.push_back(detail);
          if (kind == EventKind::kTargetDropped) dropped.push_back(detail);
        }) {
    in.odometry.status = OdometryStatus::kOk;
    in.need = OdometryNeed::kNothing;
    in.autopilot_ready = true;
  }
  /// @param fly moves the vehicle once a step, as it likes
  void run(double seconds, const std::function<void(Desk&)>& fly = {}) {
    for (int k = 0; k < seconds * 50 && mission.state() != MissionState::kDone; ++k) {
      in.now += kNanosecondsPerSecond / 50;
      if (fly) fly(*this);
      request = mission.update(in);
    }
  }
  [[nodiscard]] double seconds() const { return to_seconds(in.now); }

  Mission::Inputs in;
  MotionRequest request;
  std::vector<std::string> stuck, dropped;
  Mission mission;
};

/// Arms when asked, and is where it is asked to be at once, unless that is beyond x = `fence_m`.
std::function<void(Desk&)> pilot_until(double fence_m) {
  return [fence_m](Desk& desk) {
    using Kind = MotionRequest::Kind;
    const Kind kind = desk.request.kind;
    desk.in.armed = kind != Kind::kNone && kind != Kind::kLand;
    if (kind == Kind::kTakeoff || kind == Kind::kLeg) {
      if (desk.request.goal_O.x() <= fence_m) desk.in.odometry.X_OB.p = desk.request.goal_O;
    }
  };
}

MissionConfig waypoints(std::vector<Vec3> points) {
  MissionConfig config;
  config.waypoints_m = std::move(points);
  return config;
}

TEST(Mission, NamesWhatItWaitedFor) {
  const std::vector<std::pair<OdometryNeed, std::string>> needs{
      {OdometryNeed::kGyroBias, "gyro_bias"},
      {OdometryNeed::kScan, "no_scan"},
      {OdometryNeed::kReference, "nothing_to_register"},
      {OdometryNeed::kImu, "no_imu"}};
  for (const auto& [need, name] : needs) {
    Desk desk(waypoints({{1, 0, 1}}));
    desk.in.odometry.status = OdometryStatus::kInitialising;
    desk.in.need = need;
    desk.run(100);
    EXPECT_EQ(desk.mission.state(), MissionState::kDone);
    EXPECT_EQ(desk.mission.stuck(), "not_ready: " + name);
    EXPECT_NEAR(desk.seconds(), 23, 0.1);  // settle_s and ready_timeout_s
    EXPECT_EQ(desk.request.kind, MotionRequest::Kind::kNone);
  }
  Desk desk(waypoints({{1, 0, 1}}));
  desk.in.autopilot_ready = false;
  desk.run(100);
  EXPECT_EQ(desk.mission.stuck(), "not_ready: autopilot");
}

TEST(Mission, TakesOffHoweverLateItIsReadyWithinItsTime) {
  MissionConfig config = waypoints({{1, 0, 1}});
  config.ready_timeout_s = 50;
  Desk desk(config);
  desk.in.odometry.status = OdometryStatus::kLost;
  desk.in.need = OdometryNeed::kScan;
  desk.run(45);
  desk.in.odometry.status = OdometryStatus::kOk;
  desk.run(60, pilot_until(100));
  EXPECT_EQ(desk.mission.stuck(), "");
  EXPECT_EQ(desk.mission.targets().size(), 1U);
}

TEST(Mission, GivesUpATakeOffThatDoesNotClimb) {
  Desk grounded(waypoints({{1, 0, 1}}));
  grounded.run(100);  // never armed
  EXPECT_EQ(grounded.mission.stuck(), "takeoff: not armed");
  EXPECT_LT(grounded.seconds(), 30);

  Desk heavy(waypoints({{1, 0, 1}}));
  heavy.run(100, [](Desk& desk) {
    const auto kind = desk.request.kind;
    desk.in.armed = kind == MotionRequest::Kind::kTakeoff ||
                    (desk.in.armed && kind != MotionRequest::Kind::kLand);
  });
  EXPECT_EQ(heavy.mission.stuck(), "takeoff: height not reached");
  EXPECT_EQ(heavy.mission.state(), MissionState::kDone);  // down again, disarmed
}

// A controller without integral that got more thrust than it reckoned with hangs above its goal.
TEST(Mission, WhatHoversTooHighHasTakenOff) {
  for (const double above_m : {-0.5, -0.25, 0.25, 0.5}) {
    Desk desk(waypoints({{1, 0, 1}}));
    desk.run(10, [&](Desk& hovering) {
      const auto kind = hovering.request.kind;
      hovering.in.armed = kind != MotionRequest::Kind::kNone;
      if (kind != MotionRequest::Kind::kTakeoff) return;
      hovering.in.odometry.X_OB.p = hovering.request.goal_O + above_m * Vec3::UnitZ();
    });
    EXPECT_EQ(desk.mission.state(), above_m > 0 ? MissionState::kFly : MissionState::kTakeoff);
  }
}

TEST(Mission, DropsALegThatItDoesNotGetOnAndFliesTheNext) {
  Desk desk(waypoints({{1, 0, 1}, {9, 0, 1}, {0, 0, 1}}));
  desk.run(200, pilot_until(5));
  EXPECT_EQ(desk.mission.stuck(), "leg not reached");
  EXPECT_EQ(desk.dropped, std::vector<std::string>{"9.00 0.00 1.00"});
  EXPECT_EQ(desk.mission.targets().size(), 2U);
  EXPECT_EQ(desk.mission.state(), MissionState::kDone);
  EXPECT_LT(desk.seconds(), 40);
}

TEST(Mission, ASlowLegIsNoStuckOne) {
  Desk desk(waypoints({{9, 0, 1.5}}));
  desk.run(1000, [](Desk& slow) {  // 10 mm/s, then a long hold
    pilot_until(5)(slow);
    if (slow.request.goal_O.x() < 5) return;
    Vec3& p = slow.in.odometry.X_OB.p;
    const Vec3 way = slow.request.goal_O - p;
    p += way.normalized() * std::min(way.norm(), 0.01 / 50);
  });
  EXPECT_EQ(desk.mission.stuck(), "");
  EXPECT_EQ(desk.mission.targets().size(), 1U);
}

TEST(Mission, ComesHomeWhenTheWayInIsBlocked) {
  MissionConfig config = exploration(false);
  config.entry_m = {{2, 0, 1.5}, {9, 0, 1.5}};
  Desk desk(config);
  desk.run(200, pilot_until(5));
  EXPECT_EQ(desk.mission.stuck(), "entry: leg not reached");
  ASSERT_EQ(desk.mission.state(), MissionState::kReturn);
  EXPECT_EQ(desk.request.goal_O, Vec3(0, 0, 1.5));
}

TEST(Mission, ALandingThatDoesNotEndIsHandedToTheAutopilotAndThenNamed) {
  Desk desk(waypoints({{1, 0, 1}}));
  bool descended = false;
  desk.run(200, [&](Desk& d) {
    pilot_until(5)(d);
    d.in.armed |= d.request.kind == MotionRequest::Kind::kLand;
    descended |= d.request.kind == MotionRequest::Kind::kDescend;
  });
  EXPECT_TRUE(descended);
  EXPECT_EQ(desk.mission.stuck(), "landing: not disarmed");
  EXPECT_LT(desk.seconds(), 60);
}

TEST(Mission, AnExplorerThatNeverSpeaksIsNotWaitedForForEver) {
  Desk desk(exploration(true));
  desk.run(200, pilot_until(50));
  EXPECT_EQ(desk.mission.stuck(), "no_map");
  EXPECT_EQ(desk.mission.state(), MissionState::kDone);
}

// A map that has the floor for an obstacle leaves the vehicle no free cell to begin in.
TEST(Mission, AnExplorerThatOnlyWaitsIsNotWaitedForForEver) {
  Desk desk(exploration(true));
  double explores_s = 0;
  desk.run(200, [&](Desk& hovering) {
    pilot_until(50)(hovering);
    if (hovering.mission.state() == MissionState::kExplore) explores_s += 0.02;
    Decision wait;
    wait.kind = DecisionKind::kWait;
    hovering.mission.decide(wait);
  });
  EXPECT_EQ(desk.mission.stuck(), "start_not_free");
  EXPECT_EQ(desk.mission.state(), MissionState::kDone);
  EXPECT_NEAR(explores_s, 20, 1);  // ready_timeout_s
}

using Ask = OperatorCommand::Kind;

/// Exploring, at (20, 3) with a target further on that it does not reach by itself.
void fly_out(Pilot& pilot) {
  pilot.fly(10);
  pilot.decide(target({20, 3, 1.5}, 7));
  pilot.fly(1);
  pilot.progress = MotionProgress::kUnderWay;
  pilot.decide(target({40, 3, 1.5}, 8));
  pilot.fly(0.1);
  pilot.p_O = {23, 3, 1.5};
}

TEST(MissionOperator, LandsWhereItIsOrOnTheNearestClearPlace) {
  for (const bool clear : {true, false}) {
    Pilot pilot(exploration(true));
    pilot.places = {{PlaceKind::kClear, {24, 5, 1.5}}};
    fly_out(pilot);
    pilot.below = clear ? LandingGround::kClear : LandingGround::kObstructed;
    pilot.ask(Ask::kLand);
    pilot.progress = MotionProgress::kArrived;
    pilot.fly(0.3);
    EXPECT_EQ(pilot.mission.state(), MissionState::kHold);  // it comes to rest first
    const Vec2 place(pilot.p_O.x(), 3);
    while (pilot.mission.state() == MissionState::kHold) pilot.step();
    pilot.below = LandingGround::kClear;
    pilot.fly(3);
    EXPECT_EQ(pilot.mission.state(), MissionState::kDone);
    EXPECT_EQ(pilot.landed_at, clear ? place : Vec2(24, 5));
    EXPECT_EQ(pilot.answers, std::vector<std::string>{"land"});
    EXPECT_EQ(pilot.mission.stuck(), "");
  }
}

TEST(MissionOperator, HoldsAndGoesOnWithTheSameTarget) {
  Pilot pilot(exploration(true));
  fly_out(pilot);
  const MotionRequest before = pilot.request;
  pilot.ask(Ask::kHold);
  pilot.fly(100);
  EXPECT_EQ(pilot.request.kind, MotionRequest::Kind::kHold);
  pilot.ask(Ask::kResume);
  pilot.fly(0.1);
  EXPECT_EQ(pilot.mission.state(), MissionState::kExplore);
  EXPECT_EQ(pilot.request, before);
  EXPECT_EQ(pilot.mission.target_progress(), TargetProgress::kUnderWay);
}

TEST(MissionOperator, FliesHomeOrToAPlace) {
  Pilot home(exploration(false));
  fly_out(home);
  home.ask(Ask::kReturn);
  home.progress = MotionProgress::kArrived;
  home.fly(3);
  EXPECT_EQ(home.landed_at, Vec2(0, 0));

  Pilot there(exploration(false));
  fly_out(there);
  there.ask(Ask::kGoTo, {7, 8, 2});
  there.progress = MotionProgress::kArrived;
  there.fly(5);
  EXPECT_EQ(there.p_O, Vec3(7, 8, 2));
  EXPECT_EQ(there.request.kind, MotionRequest::Kind::kHold);
  // A place that cannot be reached is told, and it holds.
  there.progress = MotionProgress::kFailed;
  there.ask(Ask::kGoTo, {9, 9, 2});
  there.fly(5);
  EXPECT_EQ(there.request.kind, MotionRequest::Kind::kHold);
  EXPECT_EQ(there.troubles, std::vector<std::string>{"no_path"});
  EXPECT_TRUE(there.mission.stuck().empty());
}

TEST(MissionOperator, WhatCannotBeDoneIsRefused) {
  Pilot pilot(exploration(true));
  pilot.heartbeat = true;
  pilot.fly(1);
  pilot.ask(Ask::kLand);
  pilot.fly(9);
  pilot.ask(Ask::kResume);
  pilot.fly(0.1);
  EXPECT_EQ(pilot.answers, (std::vector<std::string>{"land refused in state initialise",
                                                     "resume refused in state explore"}));
  EXPECT_EQ(pilot.mission.state(), MissionState::kExplore);
}

TEST(MissionOperator, ALostLinkIsAnsweredAsConfigured) {
  using Lost = LinkConfig::Lost;
  for (const Lost lost : {Lost::kContinue, Lost::kReturn, Lost::kLand}) {
    MissionConfig config = exploration(false);
    config.link.lost = lost;
    Pilot pilot(config);
    pilot.heartbeat = true;
    fly_out(pilot);
    pilot.fly(8);
    EXPECT_EQ(pilot.mission.state(), MissionState::kExplore);  // the link is there
    pilot.heartbeat = false;
    pilot.fly(3.9);
    EXPECT_EQ(pilot.mission.state(), MissionState::kExplore);
    pilot.progress = lost == Lost::kContinue ? pilot.progress : MotionProgress::kArrived;
    pilot.fly(6);
    const bool lands = lost != Lost::kContinue;
    EXPECT_EQ(pilot.mission.state(), lands ? MissionState::kDone : MissionState::kExplore);
    if (lands) {
      EXPECT_EQ(pilot.landed_at.x(), lost == Lost::kReturn ? 0 : 40);
    }
    ASSERT_EQ(pilot.answers.size(), lands ? 2U : 1U);
    pilot.heartbeat = true;
    pilot.fly(2);
    EXPECT_EQ(pilot.answers.back(), "link is back");
  }
  // Whom nobody was ever heard by misses nobody.
  MissionConfig config = exploration(false);
  config.link.lost = Lost::kLand;
  Pilot alone(config);
  fly_out(alone);
  alone.fly(15);
  EXPECT_EQ(alone.mission.state(), MissionState::kExplore);
}

TEST(Mission, RemainsInTheAirUntilTheReserve) {
  MissionConfig config = exploration(true);
  config.remain_at_end = true;
  Pilot pilot(config);
  explore(pilot, stop());
  pilot.fly(200);
  EXPECT_EQ(pilot.request.kind, MotionRequest::Kind::kHold);
  pilot.at_reserve = true;
  pilot.fly(2);
  EXPECT_EQ(pilot.landed_at, Vec2(20, 3));
  EXPECT_TRUE(pilot.mission.stuck().empty());
}

TEST(Mission, ComesHomeWhereThatIsInReach) {
  for (const double left_wh : {30., 20.}) {
    MissionConfig config = exploration(false);
    config.land_at_start = MissionConfig::LandAtStart::kIfInReach;
    Pilot pilot(config);
    pilot.places = {{PlaceKind::kClear, {22, 4, 1.5}}};
    Decision last = stop();
    last.energy = {left_wh, 1, 10, 12};  // left, needed to land, reserve, needed to come home
    explore(pilot, last);
    pilot.fly(2);
    EXPECT_EQ(pilot.landed_at, left_wh > 22 ? Vec2(0, 0) : Vec2(22, 4));
  }
}

}  // namespace
}  // namespace arex
