#include "blame/verdict.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace arex::sim {
namespace {

FlightEnd flight(const std::string& name, const std::string& outcome) {
  return {name, "truth", outcome, "why", 12.5, "hash"};
}

/// Flights of all modules, of which those named succeed.
Verdict judge_where(const std::vector<std::string>& succeed, bool with_time = false,
                    bool sensors_as_sold = false) {
  std::vector<std::string> names{"sensors", "odometry", "maps", "tracking", "all"};
  if (with_time) names.emplace_back("time");
  std::vector<FlightEnd> flights;
  for (const std::string& name : names) {
    const bool good = std::find(succeed.begin(), succeed.end(), name) != succeed.end();
    flights.push_back(flight(name, good ? "succeeded" : "collided"));
  }
  return judge(flight("as_flown", "collided"), flights, sensors_as_sold);
}

TEST(Verdict, IsTheModuleWhoseTruthEndsTheFailure) {
  for (std::size_t i = 0; i < kBlamedModules.size(); ++i) {
    const Verdict verdict = judge_where({std::string(kBlamedModules[i]), "all"});
    EXPECT_EQ(verdict.kind, Verdict::Kind::kModule);
    ASSERT_TRUE(verdict.module.has_value());
    EXPECT_EQ(*verdict.module, static_cast<BlamedModule>(i));
    EXPECT_TRUE(verdict.through.empty());
    EXPECT_TRUE(verdict.text.starts_with(std::string(kBlamedModules[i]) + ": "));
  }
}

TEST(Verdict, IsTheFirstAlongTheFlowOfDataOfSeveral) {
  const Verdict verdict = judge_where({"maps", "sensors", "all"});
  EXPECT_EQ(verdict.module, BlamedModule::kSensors);
  EXPECT_EQ(verdict.through, std::vector{BlamedModule::kMaps});
  EXPECT_NE(verdict.text.find("runs through maps"), std::string::npos);
}

// Thirty points a scan do for exact ranges and not for real ones: that is no fault of the LiDAR.
TEST(Verdict, BlamesSensorsAsSoldOnlyWhereNothingElseHelps) {
  const Verdict verdict = judge_where({"sensors", "odometry", "all"}, false, true);
  EXPECT_EQ(verdict.module, BlamedModule::kOdometry);
  EXPECT_TRUE(verdict.through.empty());
  EXPECT_NE(verdict.text.find("no worse than such devices"), std::string::npos);
  EXPECT_EQ(judge_where({"sensors", "all"}, false, true).module, BlamedModule::kSensors);
  EXPECT_EQ(judge_where({"maps", "all"}, false, true).module, BlamedModule::kMaps);
}

TEST(Verdict, TellsWhatNoSingleTruthEnds) {
  EXPECT_EQ(judge_where({"all"}).kind, Verdict::Kind::kSeveral);
  EXPECT_EQ(judge_where({}).kind, Verdict::Kind::kPlanning);
  EXPECT_EQ(judge_where({"time"}, true).kind, Verdict::Kind::kTime);
  EXPECT_EQ(judge_where({}, true).kind, Verdict::Kind::kPlanning);
  // A module that makes the flight quicker is nearer the cause than the clock.
  EXPECT_EQ(judge_where({"tracking", "time"}, true).module, BlamedModule::kTracking);
}

TEST(Verdict, BlamesNobodyForWhatThisBuildDoesNotDo) {
  std::vector<FlightEnd> flights{flight("as_flown", "succeeded"), flight("maps", "succeeded")};
  const Verdict verdict = judge(flight("as_flown", "collided"), flights, false);
  EXPECT_EQ(verdict.kind, Verdict::Kind::kNotReproduced);
  EXPECT_FALSE(verdict.module.has_value());
}

FlightEnd ended(const std::string& name, const std::string& outcome, double time_s,
                const std::string& reason = "why") {
  return {name, "truth", outcome, reason, time_s, "hash"};
}

TEST(Verdict, AFailureIsGoneWhereAnotherOneComesLater) {
  const FlightEnd hit =
      ended("as_flown", "collided", 40, "hit trunk 7 at 2.1 m/s after lidar late");
  EXPECT_EQ(effect_on(hit, ended("x", "succeeded", 30)), Effect::kSucceeded);
  EXPECT_EQ(effect_on(hit, ended("x", "timed_out", 60)), Effect::kGone);
  EXPECT_EQ(effect_on(hit, ended("x", "lost", 39)), Effect::kCutShort);
  // Another trunk, sooner or later, is no other failure.
  EXPECT_EQ(effect_on(hit, ended("x", "collided", 60, "hit ground 0 at 9 m/s")), Effect::kRemains);
  EXPECT_EQ(effect_on(hit, ended("x", "collided", 10, "hit ground 0 at 9 m/s")), Effect::kRemains);
  // Vehicles are stuck for one cause or another, whatever else was told.
  const FlightEnd stuck =
      ended("as_flown", "stuck", 20, "takeoff: height not reached: vibration after imu late");
  EXPECT_EQ(effect_on(stuck, ended("x", "stuck", 30, "takeoff: height not reached")),
            Effect::kRemains);
  EXPECT_EQ(effect_on(stuck, ended("x", "stuck", 30, "no_path after lidar late")), Effect::kGone);
  EXPECT_EQ(effect_on(stuck, ended("x", "stuck", 10, "not_ready: no_scan")), Effect::kCutShort);
}

TEST(Verdict, TellsWithWhichTruthThisFailureIsGoneAndWhatComesThen) {
  const FlightEnd hit = ended("as_flown", "collided", 40);
  std::vector<FlightEnd> flights{
      ended("sensors", "collided", 41), ended("odometry", "timed_out", 60, "time is over"),
      ended("maps", "lost", 20), ended("tracking", "stuck", 55), ended("all", "timed_out", 60)};
  const Verdict gone = judge(hit, flights, false);
  EXPECT_EQ(gone.kind, Verdict::Kind::kModule);
  EXPECT_EQ(gone.module, BlamedModule::kOdometry);
  EXPECT_EQ(gone.through, std::vector{BlamedModule::kTracking});
  ASSERT_TRUE(gone.then.has_value());
  EXPECT_EQ(gone.then->outcome, "timed_out");
  EXPECT_EQ(gone.text,
            "odometry: the collision disappears with the true pose as odometry; the flight then "
            "ends timed_out at 60.0 s: time is over; the failure runs through tracking");
  // One that succeeds is better, wherever it stands.
  flights[3].outcome = "succeeded";
  const Verdict succeeds = judge(hit, flights, false);
  EXPECT_EQ(succeeds.module, BlamedModule::kTracking);
  EXPECT_TRUE(succeeds.through.empty());
  EXPECT_FALSE(succeeds.then.has_value());
  flights[3].outcome = "collided";
  flights[4].outcome = "succeeded";
  const Verdict several = judge(hit, flights, false);
  EXPECT_EQ(several.kind, Verdict::Kind::kSeveral);
  EXPECT_NE(several.text.find("the collision alone disappears with truth in odometry"),
            std::string::npos)
      << several.text;
}

// It might still have come.
TEST(Verdict, AFlightThatIsCutShortProvesNothing) {
  const FlightEnd late = ended("as_flown", "timed_out", 60);
  const std::vector<FlightEnd> flights{ended("sensors", "collided", 20), ended("maps", "stuck", 59),
                                       ended("all", "timed_out", 60), ended("time", "stuck", 90)};
  const Verdict verdict = judge(late, flights, false);
  EXPECT_EQ(verdict.kind, Verdict::Kind::kPlanning);
  EXPECT_FALSE(verdict.module.has_value());
  ASSERT_TRUE(verdict.then.has_value());
  EXPECT_EQ(verdict.then->name, "time");
  EXPECT_NE(verdict.text.find("before it was due"), std::string::npos) << verdict.text;
}

// Its end is what the others are held against.
TEST(Verdict, AFlightOfThisBuildThatFailsOtherwiseIsNotBlamed) {
  const FlightEnd hit = ended("as_flown", "collided", 40);
  const Verdict other =
      judge(hit, {ended("as_flown", "stuck", 70), ended("maps", "succeeded", 50)}, false);
  EXPECT_EQ(other.kind, Verdict::Kind::kNotReproduced);
  EXPECT_NE(other.text.find("stuck at 70.0 s"), std::string::npos) << other.text;
  const Verdict sooner =
      judge(hit, {ended("as_flown", "collided", 20), ended("maps", "stuck", 30)}, false);
  EXPECT_EQ(sooner.kind, Verdict::Kind::kModule);
  EXPECT_EQ(sooner.module, BlamedModule::kMaps);
}

TEST(Verdict, StandsInJsonAndTable) {
  Blame blame{"/runs/x",
              "x",
              7,
              flight("as_flown", "stuck"),
              {flight("sensors", "stuck"), flight("maps", "succeeded")},
              {}};
  blame.failed.reason = blame.flights[0].reason = "no\npath";
  blame.verdict = judge(blame.failed, blame.flights, false);
  const nlohmann::ordered_json json = blame_json(blame);
  EXPECT_EQ(json["seed"], 7);
  EXPECT_EQ(json["failed"]["outcome"], "stuck");
  EXPECT_EQ(json["flights"].size(), 2U);
  EXPECT_EQ(json["flights"][1]["name"], "maps");
  EXPECT_EQ(json["flights"][0]["failure"], "remains");
  EXPECT_EQ(json["flights"][1]["failure"], "gone");
  EXPECT_TRUE(json["verdict"]["then"].is_null());
  EXPECT_EQ(json["verdict"]["kind"], "module");
  EXPECT_EQ(json["verdict"]["module"], "maps");
  const std::string table = blame_table(blame);
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 5) << table;  // a line each, the verdict
  EXPECT_NE(table.find("\nmaps: "), std::string::npos) << table;
}

}  // namespace
}  // namespace arex::sim
