#include "config/config.h"

#include <gtest/gtest.h>

#include "planning/guide_path.h"
#include "planning/local_planner_config.h"
#include "planning/replan_machine.h"

namespace arex {
namespace {

/// Writing the defaults and reading them back gives every parameter again, and no rule is broken.
template <class T>
void expect_round_trip(std::size_t at_least) {
  const std::vector<ParameterInfo> written = list_parameters(T());
  EXPECT_GE(written.size(), at_least);
  T read;
  read_config(parse_yaml(write_yaml(written), "defaults"), read);
  const std::vector<ParameterInfo> again = list_parameters(read);
  ASSERT_EQ(written.size(), again.size());
  for (std::size_t i = 0; i < written.size(); ++i) {
    EXPECT_EQ(written[i].key, again[i].key);
    EXPECT_EQ(written[i].value, again[i].value);
    EXPECT_FALSE(written[i].meaning.empty());
  }
}

TEST(PlanningConfig, DefaultsSurviveARoundTrip) {
  expect_round_trip<LocalPlannerConfig>(40);
  expect_round_trip<ReplanConfig>(14);
  expect_round_trip<YawConfig>(5);
  expect_round_trip<GuideConfig>(6);
}

TEST(PlanningConfig, BrokenRulesAreConfigErrors) {
  LocalPlannerConfig config;
  EXPECT_THROW(read_config(parse_yaml("max_speed_mps: -1", "x"), config), ConfigError);
  EXPECT_THROW(read_config(parse_yaml("inflaton_m: 1", "x"), config), ConfigError);
}

}  // namespace
}  // namespace arex
