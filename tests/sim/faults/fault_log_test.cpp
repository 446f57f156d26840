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

// It was the shaking that kept it from its height, whatever came on the way down.
TEST(FaultLog, WhatStoodWhenItWasStuckIsKept) {
  FaultLog log{{}};
  EXPECT_EQ(log.standing_when_stuck(), "");
  log.add({0, EventKind::kOdometryStatus, "degenerate"});
  log.add({0, EventKind::kStuck, "not_ready: nothing_to_register"});
  EXPECT_EQ(log.standing_when_stuck(), "");
  log.add({0, EventKind::kVibration, "gyro 1.00 rad/s RMS at 60 Hz"});
  log.add({1, EventKind::kStuck, "takeoff: height not reached: vibration"});
  log.add({2, EventKind::kVehicleFault, "out of control: leans by 64 degrees"});
  log.add({3, EventKind::kVibration, "over"});
  EXPECT_EQ(log.standing(), "out of control");
  EXPECT_EQ(log.standing_when_stuck(), "vibration");
}

}  // namespace
}  // namespace arex::sim
