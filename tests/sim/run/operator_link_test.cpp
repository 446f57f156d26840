#include "run/operator_link.h"

#include <gtest/gtest.h>

#include <vector>

namespace arex::sim {
namespace {

using Kind = OperatorCommand::Kind;
using On = OperatorOrder::On;

constexpr Stamp kTick = kNanosecondsPerTick;

struct Arrival {
  Stamp at;
  Kind kind;
};

/// Flies for so long; the vehicle answers each command at once where it `answers`.
std::vector<Arrival> fly(OperatorLink& link, double seconds, bool answers,
                         const std::vector<Event>& reports = {}, int* heartbeats = nullptr) {
  std::vector<Arrival> arrivals;
  std::size_t next = 0;
  for (Stamp now = 0; now < from_seconds(seconds); now += kTick) {
    for (; next < reports.size() && reports[next].stamp <= now; ++next) link.report(reports[next]);
    for (const OperatorMessage& message : link.deliver(now)) {
      if (!message.command) {
        if (heartbeats) ++*heartbeats;
        continue;
      }
      const Kind kind = message.command->kind;
      arrivals.push_back({now, kind});
      const std::string name(enum_names(kind)[static_cast<std::size_t>(kind)]);
      if (answers) link.report({now, EventKind::kOperator, name});
    }
  }
  return arrivals;
}

TEST(OperatorLink, SendsEachOrderOnceAtItsTimeAndAfterItsReport) {
  OperatorLink link({}, {{On::kTime, 2, Kind::kHold, {}}, {On::kStop, 1, Kind::kLand, {}}}, 1);
  const std::vector<Event> reports{
      {from_seconds(4), EventKind::kTargetReached, "1 2 3"},
      {from_seconds(5), EventKind::kMissionState, "stop exploring: little_left"},
      {from_seconds(6), EventKind::kMissionState, "stop exploring: little_left"}};
  int heartbeats = 0;
  const auto arrivals = fly(link, 20, true, reports, &heartbeats);
  ASSERT_EQ(arrivals.size(), 2U);
  EXPECT_EQ(arrivals[0].kind, Kind::kHold);
  EXPECT_EQ(arrivals[0].at, from_seconds(2.1));  // up
  EXPECT_EQ(arrivals[1].kind, Kind::kLand);
  EXPECT_EQ(arrivals[1].at, from_seconds(6.2));  // down, a second, up
  EXPECT_EQ(heartbeats, 20);
}

TEST(OperatorLink, TriesAgainUntilItIsAnswered) {
  OperatorLinkConfig config;
  config.tries = 4;
  OperatorLink deaf(config, {{On::kTime, 1, Kind::kLand, {}}}, 1);
  EXPECT_EQ(fly(deaf, 30, false).size(), 4U);
  // Cut for its first two tries.
  config.cut_at_s = 0.5;
  config.cut_for_s = 2;
  OperatorLink cut(config, {{On::kTime, 1, Kind::kLand, {}}}, 1);
  int heartbeats = 0;
  const auto arrivals = fly(cut, 30, true, {}, &heartbeats);
  ASSERT_EQ(arrivals.size(), 1U);
  EXPECT_EQ(arrivals[0].at, from_seconds(3.1));
  EXPECT_EQ(heartbeats, 28);
}

TEST(OperatorLink, LosesItsShareOfTheMessages) {
  OperatorLinkConfig config;
  config.loss = 0.3;
  config.heartbeat_hz = 100;
  OperatorLink link(config, {}, 5);
  int heartbeats = 0;
  fly(link, 100, true, {}, &heartbeats);
  EXPECT_NEAR(heartbeats, 7000, 4 * 46);  // binomial: sigma 46
}

}  // namespace
}  // namespace arex::sim
