#include "stack/standing_faults.h"

#include <gtest/gtest.h>

namespace arex {
namespace {

constexpr EventKind kSensor = EventKind::kSensorFault;
constexpr EventKind kVehicle = EventKind::kVehicleFault;
constexpr EventKind kShakes = EventKind::kVibration;

struct Told {
  EventKind kind;
  std::string detail;
};

std::string first_after(const std::vector<Told>& events) {
  StandingFaults faults;
  for (const Told& event : events) faults.add(event.kind, event.detail);
  return std::string(faults.first());
}

TEST(StandingFaults, TheFirstThatStandsIsNamedWithoutItsNumbers) {
  EXPECT_EQ(first_after({}), "");
  EXPECT_EQ(first_after({{EventKind::kMissionState, "explore"}, {EventKind::kStuck, "no_path"}}),
            "");
  EXPECT_EQ(
      first_after({{kSensor, "imu silent"}, {kVehicle, "out of control: leans by 87 degrees"}}),
      "imu silent");
  EXPECT_EQ(first_after({{kVehicle, "motor 3 stopped: 134 % of its hover thrust is missing"}}),
            "motor 3 stopped");
  EXPECT_EQ(first_after({{kShakes, "autopilot: gyro 0.86 rad/s RMS at 222 Hz, accelerometer 1"}}),
            "vibration");
  EXPECT_EQ(first_after({{kSensor, "attitude: autopilot and odometry differ by 14 degrees"}}),
            "attitudes that differ");
}

TEST(StandingFaults, WhatIsSaidToBeOverStandsNoMore) {
  EXPECT_EQ(first_after({{kSensor, "imu silent"}, {kSensor, "imu sound again"}}), "");
  EXPECT_EQ(first_after({{kSensor, "lidar noisy"}, {kSensor, "lidar sound again"}}), "");
  EXPECT_EQ(first_after({{kSensor, "magnetometer noisy"}, {kSensor, "magnetometer quiet again"}}),
            "");
  EXPECT_EQ(first_after({{kSensor, "depth blinded"}, {kSensor, "depth not blinded any more"}}), "");
  EXPECT_EQ(first_after({{kShakes, "gyro 1 rad/s RMS at 60 Hz"}, {kShakes, "over"}}), "");
  // Nobody else's fault ends with it, and no other of the same device's.
  EXPECT_EQ(first_after({{kSensor, "autopilot's imu silent"}, {kSensor, "imu sound again"}}),
            "autopilot's imu silent");
  EXPECT_EQ(first_after({{kSensor, "imu clock 20 ms ahead"}, {kSensor, "imu sound again"}}),
            "imu clock 20 ms ahead");
  EXPECT_EQ(
      first_after({{kSensor, "depth blinded in part"}, {kSensor, "depth not noisy any more"}}),
      "depth blinded in part");
  EXPECT_EQ(
      first_after(
          {{kSensor, "depth late"}, {kSensor, "lidar silent"}, {kSensor, "depth sound again"}}),
      "lidar silent");
}

TEST(StandingFaults, APartsNewestStateTakesThePlaceOfItsLast) {
  EXPECT_EQ(first_after({{kSensor, "imu silent"}, {kSensor, "lidar late"}, {kSensor, "imu late"}}),
            "imu late");
  EXPECT_EQ(first_after({{kVehicle, "motor 2 stopped: 105 %"}, {kVehicle, "motor 2 weak: 37 %"}}),
            "motor 2 weak");
  EXPECT_EQ(first_after({{kVehicle, "motor 2 stopped: 105 %"}, {kVehicle, "motor 3 weak: 37 %"}}),
            "motor 2 stopped");
}

TEST(StandingFaults, ThePowersNoiseIsASymptom) {
  EXPECT_EQ(first_after({{kSensor, "power noisy"}, {kShakes, "gyro 1 rad/s RMS at 60 Hz"}}),
            "vibration");
  EXPECT_EQ(first_after({{kSensor, "power noisy"}, {kSensor, "imu late"}}), "power noisy");
}

}  // namespace
}  // namespace arex
