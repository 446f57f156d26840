#include "bag/replay_input.h"

#include <gtest/gtest.h>

#include "bag/ros_bag.h"
#include "packed.h"
#include "refusal.h"
#include "sample_data.h"
#include "support/temporary_folder.h"

namespace arex::sim {
namespace {

using arex::test::TemporaryFolder;
using test::Packed;

constexpr Stamp kMillisecond = 1'000'000;

RosBytes bytes_of(const Packed& packed) {
  RosBytes bytes;
  bytes.put_raw(packed.bytes().data(), packed.bytes().size());
  return bytes;
}

/// Somebody's recording: each message by hand.
class Foreign {
 public:
  static constexpr std::uint32_t kDay = 1'700'000'000;  // s

  explicit Foreign(const std::filesystem::path& file, const std::string& imu_frame = "imu")
      : bag_(file, BagCompression::kNone),
        imu_frame_(imu_frame),
        imu_(bag_.add_topic("/os/imu", imu_type(), false)),
        points_(bag_.add_topic("/os/points", point_cloud_type(), false)),
        poses_(bag_.add_topic("/vicon/body", {"geometry_msgs/PoseStamped", "*", ""}, false)),
        estimates_(bag_.add_topic("/estimate", odometry_type(), false)),
        transforms_(bag_.add_topic("/tf_static", tf_type(), true)) {}

  /// @param at, recorded ms since the day
  void imu(std::uint32_t at, double accel, std::uint32_t recorded) {
    Packed message;
    message.header(kDay + at / 1000, at % 1000 * 1'000'000, imu_frame_).zeros(13 * 8);
    message.f64(0).f64(0).f64(0.5).zeros(9 * 8).f64(0).f64(0).f64(accel).zeros(9 * 8);
    write(imu_, recorded, message);
  }
  void scan(std::uint32_t at, std::uint32_t recorded) {
    Packed data, message;
    for (const std::uint32_t t : {0U, 50'000'000U, 90'000'000U}) {
      data.f32(1).f32(2).f32(3).u32(t);
    }
    message.header(kDay + at / 1000, at % 1000 * 1'000'000, "os_lidar").u32(1).u32(3).u32(4);
    message.text("x").u32(0).u8(7).u32(1).text("y").u32(4).u8(7).u32(1);
    message.text("z").u32(8).u8(7).u32(1).text("t").u32(12).u8(6).u32(1);
    message.u8(0).u32(16).u32(48).text(data.bytes()).u8(1);
    write(points_, recorded, message);
  }
  void pose(std::uint32_t at, double x, std::uint32_t recorded) {
    Packed message;
    message.header(kDay + at / 1000, at % 1000 * 1'000'000, "world");
    message.f64(x).f64(0).f64(0).zeros(3 * 8).f64(1);
    write(poses_, recorded, message);
  }
  void mount(const std::string& parent, const std::string& child, double x) {
    Packed message;
    message.u32(1).header(kDay, 0, parent).text(child).f64(x).zeros(5 * 8).f64(1);
    write(transforms_, 0, message);
  }
  /// Stamped with a second of the clock's own.
  void imu_of_second(std::uint32_t second, std::uint32_t recorded) {
    Packed message;
    message.header(second, 0, imu_frame_).zeros(13 * 8);
    message.f64(0).f64(0).f64(0.5).zeros(9 * 8).f64(0).f64(0).f64(9.8).zeros(9 * 8);
    write(imu_, recorded, message);
  }
  void broken_imu(std::uint32_t recorded) { write(imu_, recorded, Packed().u32(3)); }
  void close() { bag_.close(); }

 private:
  void write(std::uint32_t topic, std::uint32_t recorded, const Packed& message) {
    bag_.write(topic, {clock_ + recorded / 1000, recorded % 1000 * 1'000'000}, bytes_of(message));
  }

 public:
  std::uint32_t clock_ = kDay;  ///< s, of the recording at the day's beginning

 private:
  RosBag bag_;
  std::string imu_frame_;
  std::uint32_t imu_, points_, poses_, estimates_, transforms_;
};

/// 0.3 s of it, everything recorded 4 ms late.
void write_sound(Foreign& bag, double accel) {
  bag.mount("base", "imu", 1);
  bag.mount("base", "os_sensor", 3);
  bag.mount("os_sensor", "os_lidar", 0.5);
  for (std::uint32_t at = 0; at < 300; at += 10) {
    bag.imu(at, accel, at + 4);
    if (at % 100 == 90) bag.scan(at - 90, at + 4);
    if (at % 50 == 0) bag.pose(at, 0.001 * at, at + 4);
  }
}

struct Replayed {
  std::vector<Arrival> samples, scans;
};

Replayed replay(ReplayInput& input) {
  Replayed all;
  Stamp before = -kForever;
  while (const auto arrival = input.next()) {
    EXPECT_GE(arrival->time, before);
    before = arrival->time;
    (arrival->imu ? all.samples : all.scans).push_back(*arrival);
  }
  return all;
}

TEST(ReplayInput, FindsWhatAnotherVehicleRecorded) {
  const TemporaryFolder folder;
  Foreign bag(folder / "a.bag");
  write_sound(bag, 1.0);  // in g
  bag.close();
  ReplayInput input(folder / "a.bag", {});
  EXPECT_EQ(input.lidar_topic(), "/os/points");
  EXPECT_EQ(input.imu_topic(), "/os/imu");
  EXPECT_EQ(input.truth_topic(), "/vicon/body");
  EXPECT_EQ(input.time_origin(), Stamp{Foreign::kDay} * kNanosecondsPerSecond);
  ASSERT_TRUE(input.X_BL());
  EXPECT_EQ(input.X_BL()->p, Vec3(2.5, 0, 0));  // from imu by base and os_sensor to os_lidar

  const Replayed all = replay(input);
  ASSERT_EQ(all.samples.size(), 30U);
  EXPECT_EQ(all.samples[3].time, 34 * kMillisecond);
  EXPECT_EQ(all.samples[3].imu->stamp, 30 * kMillisecond);
  EXPECT_EQ(all.samples[3].imu->accel_mps2, Vec3(0, 0, kGravity));
  EXPECT_EQ(all.samples[3].imu->gyro_radps, Vec3(0, 0, 0.5));
  ASSERT_EQ(all.scans.size(), 3U);
  EXPECT_EQ(all.scans[1].time, 194 * kMillisecond);
  EXPECT_EQ(all.scans[1].scan->stamp, 100 * kMillisecond);
  EXPECT_EQ(all.scans[1].scan->end, 190 * kMillisecond);

  const std::vector<StampedPose> truth = input.read_truth();
  ASSERT_EQ(truth.size(), 6U);
  EXPECT_EQ(truth[2].stamp, 100 * kMillisecond);
  EXPECT_EQ(truth[2].X_WB.p, Vec3(0.001 * 100, 0, 0));
  EXPECT_TRUE(input.notes().empty()) << input.notes().front();
}

TEST(ReplayInput, LeavesMetresPerSecondSquaredAlone) {
  const TemporaryFolder folder;
  Foreign bag(folder / "a.bag");
  write_sound(bag, 9.78);
  bag.close();
  ReplayInput input(folder / "a.bag", {});
  EXPECT_EQ(replay(input).samples[0].imu->accel_mps2, Vec3(0, 0, 9.78));
  ReplayOptions told;
  told.accel_unit = AccelUnit::kG;
  ReplayInput in_g(folder / "a.bag", told);
  EXPECT_EQ(replay(in_g).samples[0].imu->accel_mps2, Vec3(0, 0, 9.78 * kGravity));
}

TEST(ReplayInput, CountsWhatIsWrongAndGoesOn) {
  const TemporaryFolder folder;
  Foreign bag(folder / "a.bag");
  bag.mount("imu", "os_lidar", 1);
  for (std::uint32_t at = 0; at < 3000; at += 10) {
    if (at >= 2500 && at < 2530) continue;  // three samples are missing
    bag.imu(at, 9.8, at);
    if (at == 2600) bag.imu(2600, 9.8, at + 1);  // doubled
    if (at == 2700) bag.imu(2650, 9.8, at + 1);  // late
    if (at == 2800) bag.broken_imu(at + 1);
    if (at % 100 == 90 && at != 2890) bag.scan(at - 90, at);  // one is missing
  }
  bag.close();
  ReplayInput input(folder / "a.bag", {});
  const Replayed all = replay(input);
  const MessageCounts& imu = input.imu_counts();
  EXPECT_EQ(all.samples.size(), 297U);
  EXPECT_EQ(imu.used, 297U);
  EXPECT_EQ(imu.missing, 3U);
  EXPECT_EQ(imu.doubled, 1U);
  EXPECT_EQ(imu.unordered, 1U);
  EXPECT_EQ(imu.damaged, 1U);
  EXPECT_EQ(all.scans.size(), 29U);
  EXPECT_EQ(input.lidar_counts().missing, 1U);
  EXPECT_EQ(input.notes().size(), 5U);
  EXPECT_FALSE(input.X_BL() == std::nullopt);
}

// Thrice the usual step between these stamps is no number of nanoseconds.
TEST(ReplayInput, CountsNothingMissingBetweenStampsOfAbsurdClocks) {
  const TemporaryFolder folder;
  Foreign bag(folder / "a.bag");
  for (std::uint32_t i = 0; i < 10; ++i)
    bag.imu_of_second(i % 2 == 0 ? 1 + i : 4'200'000'000 + i, i);
  bag.scan(0, 95);
  bag.close();
  ReplayInput input(folder / "a.bag", {});
  while (input.next()) {
  }
  EXPECT_EQ(input.imu_counts().missing, 0U);
}

TEST(ReplayInput, TakesTheLeastDelayForNoneWhereARecorderHadAnotherClock) {
  const TemporaryFolder folder;
  Foreign bag(folder / "a.bag");
  bag.clock_ += 1000;
  write_sound(bag, 9.8);
  bag.close();
  ReplayInput input(folder / "a.bag", {});
  const Replayed all = replay(input);
  EXPECT_EQ(all.samples[3].time, all.samples[3].imu->stamp);
  EXPECT_EQ(all.scans[0].time, all.scans[0].scan->end + 0 * kMillisecond);
}

TEST(ReplayInput, KnowsNoMountThatNobodySays) {
  const TemporaryFolder folder;
  {
    Foreign bag(folder / "a.bag");
    bag.mount("elsewhere", "imu", 1);
    bag.mount("os_lidar", "os_sensor", 1);
    for (std::uint32_t at = 0; at < 300; at += 10) bag.imu(at, 9.8, at);
    bag.scan(0, 95);
    bag.close();
  }
  EXPECT_FALSE(ReplayInput(folder / "a.bag", {}).X_BL());
  {
    Foreign bag(folder / "b.bag");
    bag.mount("imu", "os_lidar", 1);
    bag.mount("os_lidar", "imu", 1);  // in a circle
    bag.imu(0, 9.8, 0);
    bag.scan(0, 95);
    bag.close();
  }
  EXPECT_FALSE(ReplayInput(folder / "b.bag", {}).X_BL());
}

TEST(ReplayInput, RefusesTopicsThatDoNotFit) {
  const TemporaryFolder folder;
  Foreign bag(folder / "a.bag");
  write_sound(bag, 9.8);
  bag.close();
  ReplayOptions options;
  options.lidar_topic = "/os/pointz";
  EXPECT_NE(test::refusal_of(folder / "a.bag", options).find("did you mean '/os/points'?"),
            std::string::npos);
  options.lidar_topic = "/os/imus";  // nearer to the IMU's, which would not do
  EXPECT_NE(test::refusal_of(folder / "a.bag", options).find("did you mean '/os/points'?"),
            std::string::npos);
  options.lidar_topic = "/os/imu";
  EXPECT_NE(test::refusal_of(folder / "a.bag", options).find("expected PointCloud2"),
            std::string::npos);
  options = {};
  options.truth_topic = "/os/imu";
  EXPECT_NE(test::refusal_of(folder / "a.bag", options).find("expected Odometry"),
            std::string::npos);
  {
    Foreign without(folder / "b.bag");
    without.scan(0, 95);
    without.close();
  }
  EXPECT_NE(test::refusal_of(folder / "b.bag", {}).find("holds no message of type sensor_msgs/Imu"),
            std::string::npos);
  {
    Foreign broken(folder / "c.bag");
    broken.broken_imu(0);
    broken.scan(0, 95);
    broken.close();
  }
  EXPECT_NE(test::refusal_of(folder / "c.bag", {}).find("none of the first messages can be read"),
            std::string::npos);
}

TEST(ReplayInput, GivesOurOwnFlightAsItWas) {
  const TemporaryFolder folder;
  for (const char* name : {"a.bag", "a.mcap"}) {
    {
      BagWriter bag(folder / name, VehicleConfig{});
      test::write_samples(bag);
      bag.close();
    }
    ReplayInput input(folder / name, {});
    EXPECT_EQ(input.time_origin(), 0) << name;
    EXPECT_EQ(input.imu_topic(), "/imu/data") << name;
    EXPECT_EQ(input.truth_topic(), "/truth") << name;
    ASSERT_TRUE(input.X_BL()) << name;
    EXPECT_LT((input.X_BL()->R - VehicleConfig().X_BL().R).norm(), 1e-14) << name;
    const Replayed all = replay(input);
    ASSERT_EQ(all.samples.size(), std::size_t{test::kImuSamples}) << name;
    for (int i = 0; i < test::kImuSamples; ++i) {
      const auto at = static_cast<std::size_t>(i);
      ASSERT_EQ(all.samples[at].imu->stamp, i * test::kImuPeriod) << name;
      ASSERT_EQ(all.samples[at].time, i * test::kImuPeriod) << name;
      // Of a vehicle that is nowhere at rest: far from g all the same.
      ASSERT_EQ(all.samples[at].imu->accel_mps2, test::imu_sample(i).accel_mps2) << name;
    }
    ASSERT_EQ(all.scans.size(), std::size_t{test::kScans}) << name;
    for (int i = 0; i < test::kScans; ++i) {
      const Arrival& scan = all.scans[static_cast<std::size_t>(i)];
      // By the points alone the frame would end with the last of them, 15 us or more before.
      ASSERT_EQ(scan.scan->end, (i + 1) * test::kScanPeriod) << name;
      ASSERT_EQ(scan.scan->stamp, i * test::kScanPeriod) << name;
    }
    const std::vector<StampedPose> truth = input.read_truth();
    ASSERT_EQ(truth.size(), std::size_t{test::kImuSamples}) << name;
    EXPECT_EQ(truth[0].stamp, 0) << name;
    EXPECT_EQ(truth[7].X_WB.p, test::true_pose(7).p) << name;
  }
}

}  // namespace
}  // namespace arex::sim
