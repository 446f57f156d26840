#include "run/fault_log.h"

#include <gtest/gtest.h>

namespace arex::sim {
namespace {

constexpr EventKind kOdometry = EventKind::kOdometryStatus;

struct Told {
  EventKind kind;
  std::string detail;
};

std::string standing_after(const std::vector<Told>& events) {
  FaultLog log{{}};  // the scenario need not have given any
  for (const Told& event : events) log.add({0, event.kind, event.detail});
  return log.standing();
}

TEST(FaultLog, WhatStandsIsTheFirstFaultOrTheOdometrysOwnWord) {
  EXPECT_EQ(standing_after({{kOdometry, "initialising"}, {kOdometry, "ok"}}), "");
  EXPECT_EQ(standing_after({{kOdometry, "degenerate"}}), "odometry degenerate");
  EXPECT_EQ(standing_after({{kOdometry, "degenerate"}, {kOdometry, "lost"}}), "odometry lost");
  EXPECT_EQ(standing_after({{kOdometry, "degenerate"}, {kOdometry, "ok"}}), "");
  EXPECT_EQ(standing_after({{kOdometry, "degenerate"}, {EventKind::kSensorFault, "lidar noisy"}}),
            "lidar noisy");
  EXPECT_EQ(standing_after({{EventKind::kSensorFault, "lidar noisy"},
                            {EventKind::kSensorFault, "lidar sound again"}}),
            "");
}

}  // namespace
}  // namespace arex::sim
