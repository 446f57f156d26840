#include "bag/recording.h"

#include <gtest/gtest.h>

#include <functional>

#include "bag/mcap_format.h"
#include "bag/sensor_decoder.h"
#include "config/config.h"
#include "packed.h"
#include "sample_data.h"
#include "support/temporary_folder.h"

namespace arex::sim {
namespace {

using arex::test::read_text;
using arex::test::TemporaryFolder;
using arex::test::write_text;
using test::Packed;

constexpr std::string_view kMagic = "#ROSBAG V2.0\n";

std::string field(std::string_view name, std::string_view value) {
  return Packed().text(std::string(name) + "=" + std::string(value)).bytes();
}
std::string op(std::uint8_t code) { return field("op", Packed().u8(code).bytes()); }
std::string record(std::string_view header, std::string_view data) {
  return Packed().text(header).text(data).bytes();
}
std::string connection(std::uint32_t id, std::string_view topic, std::string_view type) {
  return record(op(7) + field("conn", Packed().u32(id).bytes()) + field("topic", topic),
                field("topic", topic) + field("type", type) + field("md5sum", "*") +
                    field("message_definition", ""));
}
std::string message(std::uint32_t id, std::uint32_t seconds, std::string_view data) {
  return record(op(2) + field("conn", Packed().u32(id).bytes()) +
                    field("time", Packed().u32(seconds).u32(0).bytes()),
                data);
}
std::string chunk(std::string_view records) {
  return record(field("compression", "none") + op(5) +
                    field("size", Packed().u32(static_cast<std::uint32_t>(records.size())).bytes()),
                records);
}
std::string file_header(std::uint64_t index_position) {
  return record(op(3) + field("index_pos", Packed().integer(index_position, 8).bytes()) +
                    field("conn_count", Packed().u32(1).bytes()) +
                    field("chunk_count", Packed().u32(1).bytes()),
                std::string(100, ' '));
}
std::string chunk_info(std::uint64_t position) {
  return record(op(6) + field("ver", Packed().u32(1).bytes()) +
                    field("chunk_pos", Packed().integer(position, 8).bytes()),
                "");
}

/// Topic, time in s and bytes of every message: "/a 3 x".
std::vector<std::string> messages_of(Recording& recording) {
  std::vector<std::string> all;
  RecordedMessage message;
  while (recording.next(message)) {
    all.push_back(recording.topics()[message.topic].name + " " +
                  std::to_string(message.time / kNanosecondsPerSecond) + " " +
                  std::string(message.bytes));
  }
  return all;
}

std::string refusal_of(const std::filesystem::path& file) {
  try {
    Recording{file};
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

using Messages = std::vector<std::string>;

TEST(Recording, ReadsABagWithoutAnIndexInOrderOfTime) {
  const TemporaryFolder folder;
  write_text(
      folder / "a.bag",
      std::string(kMagic) + file_header(0) +
          chunk(connection(4, "/a", "x/A") + message(4, 3, "late") + message(4, 1, "early")) +
          chunk(connection(9, "/b", "x/B") + message(9, 2, "b") + message(4, 3, "later")));
  Recording recording(folder / "a.bag");
  EXPECT_EQ(messages_of(recording), (Messages{"/a 1 early", "/b 2 b", "/a 3 late", "/a 3 later"}));
  EXPECT_EQ(recording.damage().places, 0U);
  EXPECT_EQ(recording.begin(), 1 * kNanosecondsPerSecond);
  EXPECT_EQ(recording.end(), 3 * kNanosecondsPerSecond);
  EXPECT_EQ(recording.topics()[0].messages, 3U);
  recording.select({1});
  EXPECT_EQ(messages_of(recording), (Messages{"/b 2 b"}));
}

TEST(Recording, KnowsConnectionsThatStandBehindTheirMessages) {
  const TemporaryFolder folder;
  write_text(folder / "a.bag", std::string(kMagic) + file_header(0) +
                                   chunk(message(4, 1, "one") + message(5, 2, "nobody's")) +
                                   connection(4, "/a", "x/A"));
  Recording recording(folder / "a.bag");
  EXPECT_EQ(messages_of(recording), (Messages{"/a 1 one"}));
  EXPECT_EQ(recording.damage().orphans, 1U);
}

TEST(Recording, GoesOnAfterADamagedChunk) {
  const TemporaryFolder folder;
  std::string broken = message(4, 2, "broken");
  broken[0] = '\x7f';  // the length of its header
  write_text(folder / "a.bag", std::string(kMagic) + file_header(0) +
                                   chunk(connection(4, "/a", "x/A") + message(4, 1, "one")) +
                                   chunk(message(4, 2, "two") + broken) +
                                   chunk(message(4, 3, "three")));
  Recording recording(folder / "a.bag");
  EXPECT_EQ(messages_of(recording), (Messages{"/a 1 one", "/a 2 two", "/a 3 three"}));
  EXPECT_EQ(recording.damage().places, 1U);
}

TEST(Recording, FindsTheNextChunkByTheIndexWhereALengthIsDamaged) {
  const TemporaryFolder folder;
  const std::string one = chunk(connection(4, "/a", "x/A") + message(4, 1, "one"));
  const std::string two = chunk(message(4, 2, "two")), three = chunk(message(4, 3, "three"));
  const std::size_t begin = kMagic.size() + file_header(0).size();
  const std::size_t index = begin + one.size() + two.size() + three.size();
  std::string damaged = two;
  damaged[3] = '\x7f';
  const std::string file = std::string(kMagic) + file_header(index) + one + damaged + three +
                           connection(4, "/a", "x/A") + chunk_info(begin) +
                           chunk_info(begin + one.size()) +
                           chunk_info(begin + one.size() + two.size());
  write_text(folder / "a.bag", file);
  Recording recording(folder / "a.bag");
  EXPECT_EQ(messages_of(recording), (Messages{"/a 1 one", "/a 3 three"}));
  EXPECT_EQ(recording.damage().places, 1U);
  EXPECT_EQ(recording.damage().skipped, two.size());
}

TEST(Recording, KeepsWhatStandsBeforeTheEndOfAFileThatWasCutShort) {
  const TemporaryFolder folder;
  const std::string whole = std::string(kMagic) + file_header(0) +
                            chunk(connection(4, "/a", "x/A") + message(4, 1, "one")) +
                            chunk(message(4, 2, "two"));
  for (const std::size_t lost : {1U, 20U}) {
    write_text(folder / "a.bag", whole.substr(0, whole.size() - lost));
    Recording recording(folder / "a.bag");
    EXPECT_EQ(messages_of(recording), (Messages{"/a 1 one"})) << lost;
    EXPECT_EQ(recording.damage().places, 1U) << lost;
  }
}

TEST(Recording, BelievesNoSizeThatAFileOnlyClaims) {
  const TemporaryFolder folder;
  const std::string claims =
      record(field("compression", "lz4") + op(5) + field("size", Packed().u32(0xffffffff).bytes()),
             "nothing of that");
  write_text(folder / "a.bag", std::string(kMagic) + file_header(0) + claims +
                                   chunk(connection(4, "/a", "x/A") + message(4, 1, "one")));
  Recording recording(folder / "a.bag");
  EXPECT_EQ(messages_of(recording), (Messages{"/a 1 one"}));
  EXPECT_EQ(recording.damage().places, 1U);
}

TEST(Recording, RefusesWithOneLineWhatIsNoRecording) {
  const TemporaryFolder folder;
  EXPECT_NE(refusal_of(folder / "none.bag").find("No such file"), std::string::npos);
  EXPECT_NE(refusal_of(folder.path()).find("is no file"), std::string::npos);
  write_text(folder / "text.bag", "a text");
  EXPECT_NE(refusal_of(folder / "text.bag").find("is no recording"), std::string::npos);
  write_text(folder / "empty.bag", "");
  EXPECT_NE(refusal_of(folder / "empty.bag").find("is no recording"), std::string::npos);
  write_text(folder / "old.bag", "#ROSBAG V1.2\nand more");
  EXPECT_NE(refusal_of(folder / "old.bag").find("format 2.0"), std::string::npos);
  write_text(folder / "secret.bag",
             std::string(kMagic) + record(op(3) + field("index_pos", std::string(8, '\0')) +
                                              field("encryptor", "rosbag/AesCbcEncryptor"),
                                          ""));
  EXPECT_NE(refusal_of(folder / "secret.bag").find("is encrypted"), std::string::npos);
}

// MCAP, its bytes by hand: opcode, length of eight bytes, content.
std::string mcap_record(std::uint8_t op, const std::string& content) {
  return Packed().u8(op).integer(content.size(), 8).raw(content).bytes();
}
const std::string kMcapMagic{"\x89MCAP0\r\n", 8};
std::string mcap_header() { return mcap_record(1, Packed().text("ros1").text("by hand").bytes()); }
std::string mcap_schema(std::uint16_t id, const std::string& type) {
  return mcap_record(3, Packed().u16(id).text(type).text("ros2msg").text("").bytes());
}
std::string mcap_channel(std::uint16_t id, std::uint16_t schema, const std::string& topic,
                         const std::string& encoding) {
  return mcap_record(4, Packed().u16(id).u16(schema).text(topic).text(encoding).u32(0).bytes());
}
std::string mcap_message(std::uint16_t channel, std::uint64_t seconds, const std::string& data) {
  const std::uint64_t time = seconds * 1'000'000'000;
  return mcap_record(
      5, Packed().u16(channel).u32(0).integer(time, 8).integer(time, 8).raw(data).bytes());
}
std::string mcap_chunk(const std::string& records, std::uint32_t crc) {
  return mcap_record(6, Packed()
                            .integer(0, 8)
                            .integer(0, 8)
                            .integer(records.size(), 8)
                            .u32(crc)
                            .text("")
                            .integer(records.size(), 8)
                            .raw(records)
                            .bytes());
}
std::string mcap_footer(std::uint64_t summary) {
  return mcap_record(2, Packed().integer(summary, 8).integer(0, 8).u32(0).bytes()) + kMcapMagic;
}

TEST(Recording, ReadsMcapWithMessagesInsideChunksAndOutside) {
  const TemporaryFolder folder;
  write_text(folder / "a.mcap",
             kMcapMagic + mcap_header() + mcap_schema(1, "sensor_msgs/msg/Imu") +
                 mcap_channel(0, 1, "/a", "cdr") + mcap_message(0, 3, "three") +
                 mcap_chunk(mcap_schema(2, "x/A") + mcap_channel(7, 2, "/b", "ros1") +
                                mcap_message(7, 2, "two") + mcap_message(0, 1, "one"),
                            0) +
                 mcap_schema(3, "Proto") + mcap_channel(8, 3, "/c", "protobuf") +
                 mcap_message(8, 1, "of no ROS") + mcap_record(0x0f, std::string(4, '\0')) +
                 mcap_footer(0));
  Recording recording(folder / "a.mcap");
  EXPECT_EQ(messages_of(recording), (Messages{"/a 1 one", "/b 2 two", "/a 3 three"}));
  EXPECT_EQ(recording.damage().places + recording.damage().orphans, 0U);
  ASSERT_EQ(recording.topics().size(), 2U);
  EXPECT_EQ(recording.topics()[0].type, "sensor_msgs/Imu");
  EXPECT_EQ(recording.topics()[0].format, WireFormat::kCdr);
  EXPECT_EQ(recording.topics()[1].format, WireFormat::kRos1);
}

TEST(Recording, KnowsADamagedChunkOfMcapByItsChecksum) {
  // `123456789` has the CRC-32 cbf43926, which is what a checksum is told by.
  EXPECT_EQ(mcap::crc32_of("123456789"), 0xcbf43926U);
  const TemporaryFolder folder;
  const std::string described = mcap_schema(1, "x/A") + mcap_channel(0, 1, "/a", "ros1");
  const std::string one = mcap_message(0, 1, "one"), two = mcap_message(0, 2, "two");
  write_text(folder / "a.mcap", kMcapMagic + mcap_header() + described +
                                    mcap_chunk(one, mcap::crc32_of(one)) +
                                    mcap_chunk(two, mcap::crc32_of(two) ^ 1) + mcap_footer(0));
  Recording recording(folder / "a.mcap");
  EXPECT_EQ(messages_of(recording), (Messages{"/a 1 one"}));
  EXPECT_EQ(recording.damage().places, 1U);
}

TEST(Recording, FindsTheNextChunkOfMcapByTheSummary) {
  const TemporaryFolder folder;
  const std::string begin =
      kMcapMagic + mcap_header() + mcap_schema(1, "x/A") + mcap_channel(0, 1, "/a", "ros1");
  const std::string one = mcap_chunk(mcap_message(0, 1, "one"), 0);
  const std::string two = mcap_chunk(mcap_message(0, 2, "two"), 0);
  std::string damaged = one;
  damaged[8] = '\x7f';  // the highest byte of its length
  const auto chunk_index = [](std::uint64_t position) {
    return mcap_record(8, Packed().integer(0, 8).integer(0, 8).integer(position, 8).bytes());
  };
  const std::size_t summary = begin.size() + one.size() + two.size();
  write_text(folder / "a.mcap", begin + damaged + two + chunk_index(begin.size()) +
                                    chunk_index(begin.size() + one.size()) + mcap_footer(summary));
  Recording recording(folder / "a.mcap");
  EXPECT_EQ(messages_of(recording), (Messages{"/a 2 two"}));
  EXPECT_EQ(recording.damage().places, 1U);
  EXPECT_EQ(recording.damage().skipped, one.size());
}

/// What was recorded, but for what a layout has no room for.
struct Written {
  BagLayout layout;
  const char* file;
};
class RoundTrip : public testing::TestWithParam<Written> {};

TEST_P(RoundTrip, GivesTheSamplesThatWereWritten) {
  const TemporaryFolder folder;
  BagOptions options;
  options.layout = GetParam().layout;
  options.compression = BagCompression::kLz4;
  {
    BagWriter bag(folder / GetParam().file, VehicleConfig{}, options);
    test::write_samples(bag);
    bag.close();
  }
  Recording recording(folder / GetParam().file);
  EXPECT_EQ(recording.damage().places, 0U) << recording.damage().first;
  ScanDecoder decoder;
  int imus = 0, scans = 0, truths = 0;
  RecordedMessage message;
  while (recording.next(message)) {
    const RecordedTopic& topic = recording.topics()[message.topic];
    if (topic.name == "/imu/data") {
      const ImuSample wanted = test::imu_sample(imus);
      const DecodedImu imu = decode_imu(message.bytes, topic.format);
      EXPECT_EQ(imu.sample.stamp, imus == 0 ? kRosZero : wanted.stamp);
      EXPECT_EQ(imu.sample.gyro_radps, wanted.gyro_radps);
      EXPECT_EQ(imu.sample.accel_mps2, wanted.accel_mps2);
      EXPECT_EQ(imu.frame, "base_link");
      ++imus;
    } else if (topic.name == "/livox/lidar") {
      const LidarScan wanted = test::lidar_scan(scans);
      const DecodedScan decoded = decoder.decode(topic.type, message.bytes, topic.format);
      const LidarScan& scan = *decoded.scan;
      EXPECT_EQ(decoded.header_stamp, scans == 0 ? kRosZero : wanted.stamp);
      EXPECT_LE(std::abs(scan.stamp - wanted.stamp), kRosZero);
      ASSERT_EQ(scan.points.size(), wanted.points.size());
      for (std::size_t i = 0; i < scan.points.size(); ++i) {
        ASSERT_EQ(scan.points[i].p_L, wanted.points[i].p_L) << i;
        ASSERT_EQ(scan.points[i].offset_ns, wanted.points[i].offset_ns) << scans << " " << i;
        ASSERT_EQ(scan.points[i].intensity, wanted.points[i].intensity) << i;
        ASSERT_EQ(scan.points[i].line, wanted.points[i].line) << i;
        ASSERT_EQ(scan.points[i].tag, wanted.points[i].tag) << i;
      }
      ++scans;
    } else if (topic.name == "/truth") {
      const DecodedPose pose = decode_pose(topic.type, message.bytes, topic.format);
      EXPECT_EQ(pose.X.p, test::true_pose(truths).p);
      EXPECT_LT((pose.X.R - test::true_pose(truths).R).norm(), 1e-15);
      ++truths;
    } else if (topic.name == "/livox/frame_end") {
      const auto end = decode_frame_end(message.bytes, topic.format);
      ASSERT_TRUE(end);
      EXPECT_EQ(end->end, test::lidar_scan(scans).end);
      EXPECT_EQ(end->frame, "livox_frame");
    } else if (topic.name == "/tf_static") {
      const auto transforms = decode_transforms(message.bytes, topic.format);
      ASSERT_EQ(transforms.size(), 2U);
      EXPECT_EQ(transforms[0].parent, "base_link");
      EXPECT_EQ(transforms[0].child, "livox_frame");
      EXPECT_LT((transforms[0].X.R - VehicleConfig().X_BL().R).norm(), 1e-15);
      EXPECT_EQ(transforms[0].X.p, VehicleConfig().X_BL().p);
    }
  }
  EXPECT_EQ(imus, test::kImuSamples);
  EXPECT_EQ(scans, test::kScans);
  EXPECT_EQ(truths, test::kImuSamples);
}

INSTANTIATE_TEST_SUITE_P(
    Layouts, RoundTrip,
    testing::Values(
        Written{BagLayout::kGeneric, "a.bag"}, Written{BagLayout::kLivoxDriver2, "a.bag"},
        Written{BagLayout::kLivoxCustom, "a.bag"}, Written{BagLayout::kLivoxCustom2, "a.bag"},
        Written{BagLayout::kGeneric, "a.mcap"}, Written{BagLayout::kLivoxDriver2, "a.mcap"},
        Written{BagLayout::kLivoxCustom2, "a.mcap"}),
    [](const auto& written) {
      return std::string(kBagLayoutNames[static_cast<std::size_t>(written.param.layout)]) +
             (std::string(written.param.file) == "a.bag" ? "_bag" : "_mcap");
    });

}  // namespace
}  // namespace arex::sim
