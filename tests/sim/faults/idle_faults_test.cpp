#include "run/idle_faults.h"

#include <gtest/gtest.h>

namespace arex::sim {
namespace {

std::vector<std::string> idle(const std::string& yaml) {
  return idle_faults(make_scenario("s", parse_yaml(yaml, "s.yaml")).config);
}

/// Every device that a fault may befall, from some time on.
std::string on_all(const std::string& from_s) {
  std::string list = "faults:\n";
  for (const char* device : {"imu", "magnetometer", "barometer", "power", "lidar", "depth",
                             "infrared", "mocap", "side"}) {
    list += std::string("  - {device: ") + device + ", kind: silent, from_s: " + from_s + "}\n";
  }
  return list + "  - {device: motor, kind: weak, from_s: " + from_s +
         "}\n  - {device: esc, kind: stop, from_s: " + from_s +
         "}\n  - {device: battery, kind: weak, from_s: " + from_s + "}\n";
}

TEST(IdleFaults, NoneWhereEveryDeviceIsThere) {
  EXPECT_TRUE(idle("seed: 1\n").empty());
  EXPECT_TRUE(idle("infrared: {enabled: true}\nodometries: {oracle: {type: mocap}}\n"
                   "devices: {side: {type: spinning}}\n" +
                   on_all("5"))
                  .empty());
}

TEST(IdleFaults, NameTheDeviceThatIsNotThereAndWhy) {
  const std::vector<std::string> lines = idle(
      "lidar: {enabled: false}\nodometry: {source: mocap}\nmapping: {use_depth: false}\n"
      "devices: {side: {type: d430}}\n" +
      on_all("5"));
  ASSERT_EQ(lines.size(), 4U);
  EXPECT_EQ(lines[0],
            "faults: item 5, lidar silent from 5 s, has no effect: lidar.enabled is false");
  EXPECT_NE(lines[1].find("depth silent"), std::string::npos) << lines[1];
  EXPECT_NE(lines[2].find("infrared.enabled is false"), std::string::npos) << lines[2];
  EXPECT_NE(lines[3].find("side silent"), std::string::npos) << lines[3];
  const std::vector<std::string> mocap = idle("faults: [{device: mocap, kind: stuck}]\n");
  ASSERT_EQ(mocap.size(), 1U);
  EXPECT_NE(mocap[0].find("no odometry is of type mocap"), std::string::npos) << mocap[0];
}

TEST(IdleFaults, NameWhatComesWhenTheMissionIsOver) {
  const std::string all = on_all("60") + "infrared: {enabled: true}\nmission: {max_time_s: 60}\n" +
                          "devices: {side: {type: spinning}}\n";
  const std::vector<std::string> lines = idle(all);
  ASSERT_EQ(lines.size(), 12U);
  EXPECT_NE(lines.back().find("mission.max_time_s is over at 60 s"), std::string::npos);
}

}  // namespace
}  // namespace arex::sim
