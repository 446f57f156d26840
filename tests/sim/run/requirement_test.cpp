#include "run/requirement.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "scoring/figures.h"

namespace arex::sim {
namespace {

using nlohmann::ordered_json;

const ordered_json kSummary = ordered_json::parse(
    R"({"outcome":"succeeded","reason":"all targets","scenario":"forest","seed":3,
        "wall_time_s":12.5,"targets":[{"x":1},{"x":2}],"collisions":0,
        "coverage":{"area_fraction":0.9,"t90_s":null},"planner":null})");

std::string verdict(const std::string& text) {
  return violation(parse_requirement(text), kSummary);
}

std::string error_of(const std::string& text) {
  try {
    parse_requirement(text);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "no error";
}

TEST(Requirement, ComparesNumbersAndTexts) {
  for (const char* met :
       {"collisions==0", "collisions<=0", "coverage.area_fraction>=0.9", "targets.count>1",
        "coverage.area_fraction < 0.91", "outcome==succeeded", "outcome!=collided", "seed!=4"}) {
    EXPECT_EQ(verdict(met), "") << met;
  }
  EXPECT_EQ(verdict("collisions>0"), "collisions is 0");
  EXPECT_EQ(verdict("collisions!=0"), "collisions is 0");
  EXPECT_EQ(verdict("coverage.area_fraction>=0.95"), "coverage.area_fraction is 0.9");
  EXPECT_EQ(verdict("coverage.area_fraction<0.9"), "coverage.area_fraction is 0.9");
  EXPECT_EQ(verdict("targets.count<=1"), "targets.count is 2");
  EXPECT_EQ(verdict("outcome==stuck"), "outcome is succeeded");
  // No value meets nothing, whichever way it is asked.
  EXPECT_EQ(verdict("coverage.t90_s<=100"), "coverage.t90_s has no value in this run");
  EXPECT_EQ(verdict("coverage.t90_s>100"), "coverage.t90_s has no value in this run");
  EXPECT_EQ(verdict("planner.failures==0"), "planner.failures has no value in this run");
}

TEST(Requirement, RefusesWhatNoSummaryCanSay) {
  EXPECT_EQ(error_of("coverage.area>=1"),
            "--require coverage.area>=1: unknown key 'coverage.area'; did you mean "
            "'coverage.area_fraction'?");
  EXPECT_EQ(error_of("collisions"),
            "--require collisions: expected FIELD>=VALUE, or one of > <= < == !=");
  EXPECT_NE(error_of("collisions=0"), "no error");
  EXPECT_NE(error_of(">=3"), "no error");
  EXPECT_NE(error_of("collisions=>3"), "no error");
  EXPECT_EQ(error_of("collisions==none"),
            "--require collisions==none: 'none' is not a number, expected one");
  EXPECT_EQ(error_of("outcome>=succeeded"),
            "--require outcome>=succeeded: 'outcome' is a text, expected == or !=");
}

TEST(Requirement, EveryFieldOfASummaryCanBeRequired) {
  for (const FigureInfo& figure : figure_list()) {
    const bool text = figure.kind == FigureInfo::Kind::kText;
    const std::string condition = figure.column() + (text ? "==x" : ">=1");
    EXPECT_EQ(error_of(condition), "no error") << condition;
  }
  EXPECT_EQ(error_of("exploration.targets>=1"), "no error");
  EXPECT_EQ(error_of("exploration.open_frontier_m2<1"), "no error");
  EXPECT_NE(error_of("targets>=1").find("did you mean 'targets.count'?"), std::string::npos);
  EXPECT_NE(error_of("sim_time_s<=nan").find("not a number"), std::string::npos);
  EXPECT_NE(error_of("sim_time_s<=inf").find("not a number"), std::string::npos);
}

TEST(Requirement, ComparesSeedsToTheirLastDigit) {
  ordered_json summary = kSummary;
  summary["seed"] = 18446744073709551615U;
  EXPECT_EQ(violation(parse_requirement("seed==18446744073709551615"), summary), "");
  EXPECT_EQ(violation(parse_requirement("seed==18446744073709551614"), summary),
            "seed is 18446744073709551615");
}

TEST(Junit, HasATestForTheMissionAndForEveryRequirement) {
  const std::string xml = junit_xml(
      kSummary, {parse_requirement("collisions==0"), parse_requirement("targets.count>=5")});
  EXPECT_EQ(xml, R"(<?xml version="1.0" encoding="UTF-8"?>
<testsuites>
  <testsuite name="arex.forest.seed3" tests="3" failures="1" errors="0" time="12.5">
    <testcase classname="arex.forest.seed3" name="mission" time="12.5"/>
    <testcase classname="arex.forest.seed3" name="collisions==0" time="0"/>
    <testcase classname="arex.forest.seed3" name="targets.count&gt;=5" time="0">
      <failure message="targets.count is 2"/>
    </testcase>
  </testsuite>
</testsuites>
)");
  ordered_json failed = kSummary;
  failed["outcome"] = "collided";
  failed["reason"] = "with \"tree 3\" & others";
  EXPECT_NE(junit_xml(failed, {})
                .find("<failure message=\"collided: with &quot;tree 3&quot; &amp; "
                      "others\"/>"),
            std::string::npos);
}

}  // namespace
}  // namespace arex::sim
