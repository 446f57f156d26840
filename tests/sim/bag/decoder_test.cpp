#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "bag/sensor_decoder.h"
#include "packed.h"

namespace arex::sim {
namespace {

using test::Packed;

struct FieldRow {
  const char* name;
  std::uint32_t offset;
  std::uint8_t type;
};

/// A PointCloud2 of ROS 1, its data as they are.
std::string cloud(std::uint32_t seconds, std::uint32_t nanoseconds,
                  const std::vector<FieldRow>& fields, std::uint32_t point_step,
                  const std::string& data, std::uint32_t height = 1) {
  const auto width = static_cast<std::uint32_t>(data.size()) / point_step / height;
  Packed message;
  message.header(seconds, nanoseconds, "lidar").u32(height).u32(width);
  message.u32(static_cast<std::uint32_t>(fields.size()));
  for (const FieldRow& field : fields) {
    message.text(field.name).u32(field.offset).u8(field.type).u32(1);
  }
  message.u8(0).u32(point_step).u32(point_step * width).text(data).u8(1);
  return message.bytes();
}

const std::vector<FieldRow> kXyz{{"x", 0, 7}, {"y", 4, 7}, {"z", 8, 7}};

std::vector<FieldRow> with(std::vector<FieldRow> more) {
  std::vector<FieldRow> fields = kXyz;
  fields.insert(fields.end(), more.begin(), more.end());
  return fields;
}

LidarScan scan_of(ScanDecoder& decoder, const std::string& bytes) {
  return *decoder.decode("sensor_msgs/PointCloud2", bytes, WireFormat::kRos1).scan;
}

void expect_frame(const LidarScan& scan, Stamp begin, Stamp end,
                  const std::vector<std::uint32_t>& offsets_ns, Stamp tolerance) {
  EXPECT_LE(std::abs(scan.stamp - begin), tolerance);
  EXPECT_LE(std::abs(scan.end - end), tolerance);
  ASSERT_EQ(scan.points.size(), offsets_ns.size());
  for (std::size_t i = 0; i < offsets_ns.size(); ++i) {
    EXPECT_LE(std::abs(Stamp{scan.points[i].offset_ns} - Stamp{offsets_ns[i]}), tolerance) << i;
  }
}

TEST(ScanDecoder, ReadsVelodynesSecondsBeforeTheStamp) {
  // velodyne_pointcloud stamps a frame with its last packet: times are negative.
  Packed data;
  for (const float time : {-0.1F, -0.05F, 0.0F}) {
    data.f32(1).f32(2).f32(3).f32(77).u16(12).f32(time);
  }
  ScanDecoder decoder;
  const LidarScan scan =
      scan_of(decoder, cloud(1'700'000'000, 500'000'000,
                             with({{"intensity", 12, 7}, {"ring", 16, 4}, {"time", 18, 7}}), 22,
                             data.bytes()));
  constexpr Stamp kStamp = 1'700'000'000'500'000'000;
  expect_frame(scan, kStamp - 100'000'000, kStamp, {0, 50'000'000, 100'000'000}, 5);
  EXPECT_EQ(scan.points[0].line, 12);
  EXPECT_EQ(scan.points[0].intensity, 77);
  EXPECT_EQ(scan.points[0].p_L, Vec3f(1, 2, 3));
}

TEST(ScanDecoder, ReadsOustersOrganisedCloudAndItsNanoseconds) {
  // ouster_ros: 48 bytes, x y z and a gap, two rows; nothing returned: zeros.
  Packed data;
  for (const std::uint32_t row : {0U, 1U}) {
    for (const std::uint32_t column : {0U, 1U, 2U}) {
      const float x = row == 1 && column == 1 ? 0.0F : 5.0F;
      data.f32(x).f32(0).f32(0).f32(0).f32(9).u32(column * 40'000'000).u16(100);
      data.u16(static_cast<std::uint16_t>(row)).u16(3).zeros(2).u32(5000).zeros(12);
    }
  }
  ScanDecoder decoder;
  const DecodedScan decoded = decoder.decode(
      "sensor_msgs/PointCloud2",
      cloud(1'600'000'000, 0, with({{"intensity", 16, 7}, {"t", 20, 6}, {"ring", 26, 4}}), 48,
            data.bytes(), 2),
      WireFormat::kRos1);
  EXPECT_EQ(decoded.invalid, 1U);
  EXPECT_EQ(decoded.frame, "lidar");
  constexpr Stamp kStamp = 1'600'000'000'000'000'000;
  expect_frame(*decoded.scan, kStamp, kStamp + 80'000'000,
               {0, 40'000'000, 80'000'000, 0, 80'000'000}, 0);
  EXPECT_EQ(decoded.scan->points[4].line, 1);
}

TEST(ScanDecoder, ReadsTimesOfDayInSeconds) {
  // Hesai and RoboSense: float64 seconds of the stamp's clock, which resolve 0.24 us today.
  Packed data;
  for (const double time : {1'700'000'000.25, 1'700'000'000.30, 1'700'000'000.35}) {
    data.f32(1).f32(0).f32(0).f32(1).f64(time).u16(7);
  }
  ScanDecoder decoder;
  const LidarScan scan =
      scan_of(decoder, cloud(1'700'000'000, 250'000'000,
                             with({{"intensity", 12, 7}, {"timestamp", 16, 8}, {"ring", 24, 4}}),
                             26, data.bytes()));
  constexpr Stamp kStamp = 1'700'000'000'250'000'000;
  expect_frame(scan, kStamp, kStamp + 100'000'000, {0, 50'000'000, 100'000'000}, 300);
}

TEST(ScanDecoder, ReadsLivoxDriver2sNanosecondsOfTheDay) {
  Packed data;
  for (const double time : {5.1e9, 5.15e9, 5.2e9}) {
    data.f32(1).f32(0).f32(0).f32(60).u8(16).u8(3).f64(time);
  }
  ScanDecoder decoder;
  const LidarScan scan = scan_of(
      decoder,
      cloud(5, 100'000'000,
            with({{"intensity", 12, 7}, {"tag", 16, 2}, {"line", 17, 2}, {"timestamp", 18, 8}}), 26,
            data.bytes()));
  expect_frame(scan, 5'100'000'000, 5'200'000'000, {0, 50'000'000, 100'000'000}, 0);
  EXPECT_EQ(scan.points[1].tag, 16);
  EXPECT_EQ(scan.points[1].line, 3);
}

TEST(ScanDecoder, TakesTimesOfAnotherClockFromTheFramesFirstPoint) {
  // The device counts from its start, the driver stamps by the host's clock.
  Packed data;
  for (const double time : {300.02, 300.0, 300.1}) data.f32(1).f32(0).f32(0).f64(time);
  ScanDecoder decoder;
  const LidarScan scan =
      scan_of(decoder, cloud(1'700'000'000, 0, with({{"timestamp", 12, 8}}), 20, data.bytes()));
  constexpr Stamp kStamp = 1'700'000'000'000'000'000;
  expect_frame(scan, kStamp, kStamp + 100'000'000, {20'000'000, 0, 100'000'000}, 1);
}

TEST(ScanDecoder, ReadsMicrosecondsAndWhatItIsTold) {
  Packed data;
  for (const std::uint32_t time : {0U, 50'000U, 100'000U}) {
    data.f32(1).f32(0).f32(0).u32(time);
  }
  const std::string bytes = cloud(9, 0, with({{"t", 12, 6}}), 16, data.bytes());
  ScanDecoder decoder, told(TimeUnit::kNanoseconds);
  expect_frame(scan_of(decoder, bytes), 9 * kNanosecondsPerSecond,
               9 * kNanosecondsPerSecond + 100'000'000, {0, 50'000'000, 100'000'000}, 0);
  expect_frame(scan_of(told, bytes), 9 * kNanosecondsPerSecond, 9 * kNanosecondsPerSecond + 100'000,
               {0, 50'000, 100'000}, 0);
}

TEST(ScanDecoder, TakesAFrameWithoutTimesAsOfOneMoment) {
  Packed data;
  data.f32(1).f32(0).f32(0).f32(2).f32(0).f32(0);
  ScanDecoder decoder;
  const LidarScan scan = scan_of(decoder, cloud(9, 5, kXyz, 12, data.bytes()));
  expect_frame(scan, 9 * kNanosecondsPerSecond + 5, 9 * kNanosecondsPerSecond + 6, {0, 0}, 0);
  EXPECT_TRUE(decoder.timeless());
}

TEST(ScanDecoder, ReadsLivoxCustomMsgOfRos2) {
  Packed message;
  message.u8(0).u8(1).u16(0);                    // CDR, little-endian
  message.u32(5).u32(100).text({"livox\0", 6});  // no sequence number; text with its final zero
  message.zeros(2 + 4);                          // to a multiple of eight behind the first four
  message.integer(5'000'000'100, 8).u32(2).u8(0).zeros(3);
  message.u32(2);
  message.u32(0).f32(1).f32(2).f32(3).u8(40).u8(16).u8(1).zeros(1);  // to a multiple of four
  message.u32(70'000'000).f32(4).f32(5).f32(6).u8(255).u8(0).u8(3);
  ScanDecoder decoder;
  const DecodedScan decoded =
      decoder.decode("livox_ros_driver2/CustomMsg", message.bytes(), WireFormat::kCdr);
  EXPECT_EQ(decoded.frame, "livox");
  expect_frame(*decoded.scan, 5'000'000'100, 5'070'000'100, {0, 70'000'000}, 0);
  EXPECT_EQ(decoded.scan->points[1].p_L, Vec3f(4, 5, 6));
  EXPECT_EQ(decoded.scan->points[0].tag, 16);
  EXPECT_EQ(decoded.scan->points[1].line, 3);
  EXPECT_EQ(decoded.scan->points[1].intensity, 255);
}

TEST(SensorDecoder, ReadsAnImuSampleOfRos2InEitherByteOrder) {
  const auto sample = [](bool big) {
    std::string bytes;
    const auto number = [&](auto value) {
      std::string own(reinterpret_cast<const char*>(&value), sizeof value);
      if (big) own.assign(own.rbegin(), own.rend());
      bytes += own;
    };
    number(std::uint32_t{12});
    number(std::uint32_t{34});
    number(std::uint32_t{4});
    bytes += std::string("imu\0", 4);  // sixteen bytes by now: aligned
    for (int i = 0; i < 4 + 9; ++i) number(-1.0);
    for (const double v : {0.1, 0.2, 0.3}) number(v);
    for (int i = 0; i < 9; ++i) number(0.0);
    for (const double v : {1.0, 2.0, 9.5}) number(v);
    for (int i = 0; i < 9; ++i) number(0.0);
    return std::string({'\0', big ? '\0' : '\1', '\0', '\0'}) + bytes;
  };
  for (const bool big : {false, true}) {
    const DecodedImu imu = decode_imu(sample(big), WireFormat::kCdr);
    EXPECT_EQ(imu.sample.stamp, 12'000'000'034);
    EXPECT_EQ(imu.frame, "imu");
    EXPECT_EQ(imu.sample.gyro_radps, Vec3(0.1, 0.2, 0.3));
    EXPECT_EQ(imu.sample.accel_mps2, Vec3(1, 2, 9.5));
  }
}

TEST(SensorDecoder, ReadsEveryMessageThatHasAPose) {
  Packed pose;
  for (const double v : {1.0, 2.0, 3.0, 0.0, 0.0, std::sqrt(0.5), std::sqrt(0.5)}) pose.f64(v);
  const std::string bare = Packed().header(3, 4, "map").raw(pose.bytes()).bytes();
  const std::string child = Packed().header(3, 4, "map").text("body").raw(pose.bytes()).bytes();
  for (const char* type : {"geometry_msgs/PoseStamped", "geometry_msgs/PoseWithCovarianceStamped",
                           "nav_msgs/Odometry", "geometry_msgs/TransformStamped"}) {
    EXPECT_TRUE(is_pose_type(type));
    const bool has_child = std::string_view(type) == "nav_msgs/Odometry" ||
                           std::string_view(type) == "geometry_msgs/TransformStamped";
    const DecodedPose decoded = decode_pose(type, has_child ? child : bare, WireFormat::kRos1);
    EXPECT_EQ(decoded.stamp, 3'000'000'004) << type;
    EXPECT_EQ(decoded.X.p, Vec3(1, 2, 3)) << type;
    EXPECT_LT((decoded.X.R * Vec3::UnitX() - Vec3::UnitY()).norm(), 1e-15) << type;
  }
  EXPECT_FALSE(is_pose_type("sensor_msgs/Imu"));
}

void expect_refused(const std::function<void()>& decode, const char* what) {
  EXPECT_THROW(decode(), DecodeError) << what;
}

TEST(SensorDecoder, RefusesWhatIsNoMessage) {
  Packed data;
  data.f32(1).f32(0).f32(0).u32(50);
  const std::string sound = cloud(9, 0, with({{"t", 12, 6}}), 16, data.bytes());
  for (std::size_t size = 0; size + 1 < sound.size(); ++size) {  // its last byte is not read
    ScanDecoder decoder;
    expect_refused([&] { scan_of(decoder, sound.substr(0, size)); }, "cut short");
  }
  const auto refused = [&](const std::string& bytes, const char* what) {
    ScanDecoder decoder;
    expect_refused([&] { scan_of(decoder, bytes); }, what);
  };
  refused(cloud(9, 0, {{"x", 0, 7}, {"y", 4, 7}}, 16, data.bytes()), "no z");
  refused(cloud(9, 0, with({{"t", 14, 6}}), 16, data.bytes()), "a field beyond the point");
  refused(cloud(9, 0, with({{"t", 0xffffffff, 6}}), 16, data.bytes()), "an offset that overflows");
  refused(cloud(9, 2'000'000'000, kXyz, 16, data.bytes()), "a time that is none");
  Packed far;
  far.f32(1).f32(0).f32(0).f64(0).f32(1).f32(0).f32(0).f64(1e18);
  refused(cloud(9, 0, with({{"t", 12, 8}}), 20, far.bytes()), "a frame of thirty years");
  Packed more = Packed().header(9, 0, "lidar").u32(0xffffffff).u32(0xffffffff).u32(3);
  for (const FieldRow& field : kXyz) more.text(field.name).u32(field.offset).u8(7).u32(1);
  more.u8(0).u32(12).u32(0xffffffff).text("").u8(1);
  refused(more.bytes(), "more points than bytes");

  const std::string imu = Packed().header(1, 0, "imu").zeros(37 * 8).bytes();
  EXPECT_NO_THROW(decode_imu(imu, WireFormat::kRos1));
  expect_refused([&] { decode_imu(imu.substr(0, imu.size() - 100), WireFormat::kRos1); }, "short");
  std::string wild = imu;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  wild.replace(16 + 3 + 13 * 8, 8, reinterpret_cast<const char*>(&nan), 8);
  expect_refused([&] { decode_imu(wild, WireFormat::kRos1); }, "not a number");
  expect_refused([&] { decode_imu(imu, WireFormat::kCdr); }, "another encapsulation");
  const std::string still = Packed().header(1, 0, "map").zeros(7 * 8).bytes();
  expect_refused([&] { decode_pose("geometry_msgs/PoseStamped", still, WireFormat::kRos1); },
                 "a quaternion of zeros");
}

}  // namespace
}  // namespace arex::sim
