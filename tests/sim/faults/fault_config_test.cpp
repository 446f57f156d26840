#include <gtest/gtest.h>

#include "run/drive_faults.h"
#include "run/scenario.h"
#include "support/temporary_folder.h"

namespace arex::sim {
namespace {

/// What a scenario with this list of faults is refused with; empty: it is not.
std::string refusal_of(const std::string& faults) {
  const test::TemporaryFolder folder;
  test::write_text(folder / "s.yaml", "seed: 3\nfaults:\n" + faults);
  try {
    static_cast<void>(load_scenario(folder / "s.yaml", {}, {}));
  } catch (const ConfigError& error) {
    const std::string message = error.what();
    return message.substr(message.find("s.yaml"));
  }
  return "";
}

TEST(FaultConfig, TakesEveryDeviceWithWhatCanGoWrongWithIt) {
  EXPECT_EQ(refusal_of("  - {device: lidar, kind: silent, from_s: 20, to_s: 25}\n"
                       "  - {device: imu, kind: noisy, gyro_noise_radps: 0.3}\n"
                       "  - {device: magnetometer, kind: stuck}\n"
                       "  - {device: barometer, kind: delayed, delay_s: 0.5}\n"
                       "  - {device: power, kind: dropping, share: 0.5}\n"
                       "  - {device: depth, kind: blinded, share: 1}\n"
                       "  - {device: motor, kind: weak, number: 2, loss_fraction: 0.1}\n"
                       "  - {device: esc, kind: stop, number: 4, from_s: 30}\n"
                       "  - {device: battery, kind: weak}\n"),
            "");
}

TEST(FaultConfig, RefusesWhatCannotBeWithItsLine) {
  const auto expect = [](const std::string& fault, const std::string& place,
                         const std::string& rule) {
    const std::string message =
        refusal_of("  - {device: lidar, kind: silent}\n  - " + fault + "\n");
    EXPECT_EQ(message.substr(0, place.size()), place) << message;
    EXPECT_NE(message.find(rule), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  };
  expect("{device: motor, kind: silent}", "s.yaml:4: ", "kind of motor: one of weak");
  expect("{device: imu, kind: blinded}",
         "s.yaml:4: ", "kind of imu: one of silent, stuck, delayed, noisy, dropping");
  expect("{device: lidar, kind: slient}", "s.yaml:4: ", "silent");
  expect("{kind: silent}", "s.yaml:4: ", "device");
  expect("{device: lidar, kind: silent, from_s: 5, to_s: 4}", "s.yaml:4: ", "to_s > from_s");
  expect("{device: lidar, kind: dropping, share: 1.5}", "s.yaml:4: ", "share <= 1");
  expect("{device: esc, kind: stop, number: 5}", "s.yaml:4: ", "1 <= number <= 4");
  expect("{device: lidar, kind: silent, for_s: 5}", "s.yaml:4: ", "unknown key 'for_s'");
  expect("{device: rear_lidar, kind: silent}", "s.yaml:", "faults of known devices: 'rear_lidar'");
}

TEST(FaultConfig, AreResolvedAndReadBackAsTheyWere) {
  const test::TemporaryFolder folder;
  test::write_text(folder / "s.yaml",
                   "faults: [{device: lidar, kind: jumping, jump_m: 0.25, from_s: 1.5}]\n");
  const Scenario first = load_scenario(folder / "s.yaml", {}, {});
  test::write_text(folder / "r.yaml", first.resolved_yaml());
  const Scenario second = load_scenario(folder / "r.yaml", {}, {});
  ASSERT_EQ(second.config.faults.size(), 1U);
  EXPECT_EQ(second.config.faults[0].kind, FaultKind::kJumping);
  EXPECT_EQ(second.config.faults[0].jump_m, 0.25);
  EXPECT_EQ(second.config.faults[0].from_s, 1.5);
  EXPECT_EQ(first.resolved_yaml(), second.resolved_yaml());
}

TEST(DriveFaults, HoldFromTheirBeginToTheirEnd) {
  FaultConfig weak;
  weak.device = "motor";
  weak.kind = FaultKind::kWeak;
  weak.number = 3;
  weak.loss_fraction = 0.1;
  weak.from_s = 10;
  weak.to_s = 20;
  FaultConfig cell = weak;
  cell.device = "battery";
  EXPECT_TRUE(concern_drive({weak}));
  FaultConfig lidar;
  lidar.device = "lidar";
  EXPECT_FALSE(concern_drive({lidar}));
  EXPECT_EQ(drive_faults_at({weak}, from_seconds(9.999)).thrust_share[2], 1);
  EXPECT_DOUBLE_EQ(drive_faults_at({weak}, from_seconds(10)).thrust_share[2], 0.9);
  EXPECT_DOUBLE_EQ(drive_faults_at({weak, weak}, from_seconds(19.999)).thrust_share[2], 0.81);
  EXPECT_EQ(drive_faults_at({weak}, from_seconds(20)).thrust_share[2], 1);
  EXPECT_EQ(drive_faults_at({cell}, from_seconds(15)).lost_voltage_v, cell.lost_voltage_v);
}

}  // namespace
}  // namespace arex::sim
