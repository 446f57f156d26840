#include "exploration/mission.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace arex {
namespace {

/// A vehicle that is wherever its last request asks it to be.
class Pilot {
 public:
  explicit Pilot(const MissionConfig& config)
      : mission(config, [this](EventKind kind, const std::string& detail) {
          if (kind == EventKind::kMissionState) states.push_back(detail);
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
    request = mission.update(inputs);
    served = request;
    armed = request.kind != MotionRequest::Kind::kNone;
    if (request.kind == MotionRequest::Kind::kLand) {
      landed_at = p_O.head<2>();
      armed = false;
    } else if (progress != MotionProgress::kFailed) {
      p_O = request.goal_O;
    }
  }

  void decide(const Decision& decision) { mission.decide(decision); }

  Stamp now = 0;
  Vec3 p_O = Vec3::Zero();
  bool armed = false;
  MotionRequest request, served;
  MotionProgress progress = MotionProgress::kArrived;
  Vec2 landed_at = Vec2::Constant(1e9);
  std::vector<std::string> states;
  Mission mission;
};

MissionConfig exploration(bool land_at_start) {
  MissionConfig config;
  config.kind = MissionConfig::Kind::kExplore;
  config.land_at_start = land_at_start;
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

Decision stop(std::optional<Vec3> landing_O) {
  Decision decision;
  decision.kind = DecisionKind::kStop;
  decision.stop_reason = StopReason::kNoCandidates;
  decision.landing_O = landing_O;
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
  explore(pilot, stop(std::nullopt));
  pilot.fly(2);
  EXPECT_EQ(pilot.landed_at, Vec2(0, 0));
  EXPECT_EQ(pilot.states,
            (std::vector<std::string>{"initialise", "takeoff", "entry", "explore",
                                      "stop exploring: no_candidates", "return", "land", "done"}));
  EXPECT_TRUE(pilot.mission.stuck().empty());
}

TEST(Mission, LandsOnTheClearingThatTheExplorerNames) {
  Pilot pilot(exploration(false));
  explore(pilot, stop(Vec3(22, 4, 1.5)));
  pilot.fly(2);
  EXPECT_EQ(pilot.landed_at, Vec2(22, 4));
  EXPECT_EQ(pilot.mission.state(), MissionState::kDone);
  EXPECT_EQ(pilot.mission.targets().back().p_O, Vec3(22, 4, 1.5));
}

TEST(Mission, LandsWhereItIsWithoutAClearing) {
  Pilot pilot(exploration(false));
  explore(pilot, stop(std::nullopt));
  pilot.fly(2);
  EXPECT_EQ(pilot.landed_at, Vec2(20, 3));
  EXPECT_EQ(std::count(pilot.states.begin(), pilot.states.end(), "return"), 0);
}

TEST(Mission, LandsWhereItIsWhenNoWayLeadsThere) {
  for (const bool home : {true, false}) {
    MissionConfig config = exploration(home);
    config.return_tries = 3;
    Pilot pilot(config);
    explore(pilot, stop(Vec3(22, 4, 1.5)));
    pilot.progress = MotionProgress::kFailed;
    pilot.step();  // asks for the way
    for (int attempt = 1; attempt < config.return_tries; ++attempt) {
      pilot.step();
      EXPECT_EQ(pilot.request.attempt, attempt);
    }
    pilot.fly(1);
    EXPECT_EQ(pilot.landed_at, Vec2(20, 3));
    EXPECT_EQ(pilot.mission.stuck(), home ? "no_path" : "");  // only home was asked for
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

}  // namespace
}  // namespace arex
