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
  return judge(flights, sensors_as_sold);
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
  const Verdict verdict = judge(flights, false);
  EXPECT_EQ(verdict.kind, Verdict::Kind::kNotReproduced);
  EXPECT_FALSE(verdict.module.has_value());
}

TEST(Verdict, StandsInJsonAndTable) {
  Blame blame{"/runs/x",
              "x",
              7,
              flight("as_flown", "stuck"),
              {flight("sensors", "stuck"), flight("maps", "succeeded")},
              {}};
  blame.failed.reason = "no\npath";
  blame.verdict = judge(blame.flights, false);
  const nlohmann::ordered_json json = blame_json(blame);
  EXPECT_EQ(json["seed"], 7);
  EXPECT_EQ(json["failed"]["outcome"], "stuck");
  EXPECT_EQ(json["flights"].size(), 2U);
  EXPECT_EQ(json["flights"][1]["name"], "maps");
  EXPECT_EQ(json["verdict"]["kind"], "module");
  EXPECT_EQ(json["verdict"]["module"], "maps");
  const std::string table = blame_table(blame);
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 5) << table;  // a line each, the verdict
  EXPECT_NE(table.find("\nmaps: "), std::string::npos) << table;
}

}  // namespace
}  // namespace arex::sim
