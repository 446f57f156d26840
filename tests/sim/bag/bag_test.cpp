#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <cstring>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <string>

#include "bag/recording.h"
#include "bag/sensor_decoder.h"
#include "sample_data.h"
#include "support/temporary_folder.h"

namespace arex::sim {
namespace {

using arex::test::read_text;
using arex::test::TemporaryFolder;

std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

void write(const std::filesystem::path& file, BagCompression compression) {
  BagOptions options;
  options.compression = compression;
  BagWriter bag(file, VehicleConfig{}, options);
  test::write_samples(bag);
  bag.close();
}

TEST(BagWriter, SameInputGivesTheSameBytes) {
  const TemporaryFolder folder;
  for (const auto compression : {BagCompression::kNone, BagCompression::kLz4}) {
    write(folder / "one.bag", compression);
    write(folder / "two.bag", compression);
    EXPECT_GT(read_text(folder / "one.bag").size(), 100'000U);
    EXPECT_TRUE(read_text(folder / "one.bag") == read_text(folder / "two.bag"));
  }
}

TEST(BagWriter, HasItsNameOnlyWhenClosed) {
  const TemporaryFolder folder;
  const auto file = folder / "flight.bag";
  {
    BagWriter bag(file, VehicleConfig{});
    bag.imu(test::imu_sample(0));
    EXPECT_TRUE(std::filesystem::exists(folder / "flight.bag.active"));
  }
  EXPECT_FALSE(std::filesystem::exists(file));
  // Whoever unwinds without closing keeps the open chunk, too.
  EXPECT_NE(read_text(folder / "flight.bag.active").find("/imu/data"), std::string::npos);
  write(file, BagCompression::kNone);
  EXPECT_TRUE(std::filesystem::exists(file));
  EXPECT_FALSE(std::filesystem::exists(folder / "flight.bag.active"));
}

TEST(BagWriter, NamesAFileThatCannotBeMade) {
  const TemporaryFolder folder;
  const auto file = folder / "missing/flight.bag";
  const std::string message = message_of([&] { BagWriter(file, VehicleConfig{}); });
  EXPECT_NE(message.find(file.string()), std::string::npos) << message;
  EXPECT_NE(message.find("No such file"), std::string::npos) << message;
}

TEST(BagWriter, LeavesADeviceInThePlaceOfItsDraftAlone) {
  const TemporaryFolder folder;
  const auto file = folder / "flight.bag";
  std::filesystem::create_symlink("/dev/full", folder / "flight.bag.active");
  const std::string message = message_of([&] { BagWriter(file, VehicleConfig{}); });
  EXPECT_NE(message.find(file.string()), std::string::npos) << message;
  EXPECT_NE(message.find("is a device, expected a file"), std::string::npos) << message;
}

TEST(BagWriter, WritesTheTruthInTheFrameThatTheOdometryBeginsIn) {
  const TemporaryFolder folder;
  const Pose X_WO{so3::Exp({0, 0, 0.5}), {1, 2, 3}};
  {
    BagWriter bag(folder / "a.bag", VehicleConfig{});
    for (int i = 1; i <= 4; ++i) {
      bag.begin(i);
      // It guesses at first; the truth of before is written as that of after.
      bag.place_odom(i < 3 ? Pose() : X_WO, i >= 3);
      bag.truth(i, X_WO * Pose{Mat3::Identity(), {1.0 * i, 0, 0}}, Vec3::Zero(), Vec3::Zero());
    }
    bag.close();
  }
  Recording recording(folder / "a.bag");
  RecordedMessage message;
  int count = 0;
  while (recording.next(message)) {
    const RecordedTopic& topic = recording.topics()[message.topic];
    if (topic.name != "/truth") continue;
    const DecodedPose pose = decode_pose(topic.type, message.bytes, topic.format);
    ++count;
    EXPECT_EQ(pose.stamp, count);
    EXPECT_EQ(message.time, count);
    EXPECT_LT((pose.X.p - Vec3(count, 0, 0)).norm(), 1e-14);
    EXPECT_LT((pose.X.R - Mat3::Identity()).norm(), 1e-14);
  }
  EXPECT_EQ(count, 4);
}

/// While it lives, files of this process end at `bytes`: a disk that fills up.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &old_);
    const rlimit limit{bytes, old_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &old_);
    std::signal(SIGXFSZ, handler_);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  void (*handler_)(int);
  rlimit old_{};
};

TEST(BagWriter, NamesTheFileWhenTheDiskIsFullAtTheStart) {
  const TemporaryFolder folder;
  const auto file = folder / "flight.bag";
  const FileSizeLimit limit(0);
  const std::string message = message_of([&] { BagWriter(file, VehicleConfig{}).close(); });
  EXPECT_NE(message.find(file.string()), std::string::npos) << message;
  EXPECT_NE(message.find("File too large"), std::string::npos) << message;
}

TEST(BagWriter, NamesTheFileWhenTheDiskFillsUp) {
  const TemporaryFolder folder;
  const auto file = folder / "flight.bag";
  {
    BagWriter bag(file, VehicleConfig{});
    {
      const FileSizeLimit limit(1'000'000);
      const std::string early = message_of([&] { test::write_samples(bag); });
      EXPECT_NE(early.find(file.string()), std::string::npos) << early;
      EXPECT_NE(early.find("File too large"), std::string::npos) << early;
    }
    // There is a hole now: room or not, nothing makes a finished bag of it.
    EXPECT_NE(message_of([&] { bag.close(); }).find(file.string()), std::string::npos);
  }
  EXPECT_FALSE(std::filesystem::exists(file));
  {
    const FileSizeLimit limit(5'000);
    BagWriter bag(file, VehicleConfig{});
    for (int i = 0; i < 10; ++i) bag.imu(test::imu_sample(i));  // in memory: the disk is not asked
    EXPECT_NE(message_of([&] { bag.close(); }).find("File too large"), std::string::npos);
  }
  EXPECT_FALSE(std::filesystem::exists(file));
}

TEST(BagWriter, RefusesWhatABagCannotSay) {
  const TemporaryFolder folder;
  BagWriter bag(folder / "flight.bag", VehicleConfig{});
  bag.place_odom(Pose(), true);
  EXPECT_THROW(bag.truth(-1, Pose(), Vec3::Zero(), Vec3::Zero()), std::out_of_range);
  ImuSample early;
  early.stamp = -1;  // a device's clock may lag: the first samples are none of ROS's
  EXPECT_NO_THROW(bag.imu(early));
  ImuSample late;
  late.stamp = std::numeric_limits<Stamp>::max();
  EXPECT_THROW(bag.imu(late), std::out_of_range);
  DepthImage image = test::depth_image(0);
  image.depth_m.pop_back();
  EXPECT_THROW(bag.depth(image), std::invalid_argument);
}

StereoImage infrared_image(int i) {
  StereoImage image;
  image.time_ns = i * 100'000'000 + 4'250'000;
  image.width = 8;
  image.height = 6;
  for (int k = 0; k < 48; ++k) image.left.push_back(static_cast<std::uint8_t>(5 * k + i));
  if (i % 2 == 0) image.right.assign(image.left.rbegin(), image.left.rend());
  image.camera = {8, 6, 424.5, 3.5, 2.5, 0.0625, {}};
  return image;
}

/// A value of a ROS 1 message.
template <class T>
T value_at(const RecordedMessage& message, std::size_t offset) {
  T value;
  std::memcpy(&value, message.bytes.data() + offset, sizeof value);
  return value;
}

// sensor_msgs/CameraInfo: header with the frame's name, height, width, model, D, K, R, P.
double projection_of(const RecordedMessage& message, std::size_t element) {
  const auto frame = value_at<std::uint32_t>(message, 12);
  const std::size_t size = 16 + frame;
  const std::size_t p = size + 8 + 4 + std::string("plumb_bob").size() + 4 + 5 * 8 + 9 * 8 + 9 * 8;
  return value_at<double>(message, p + 8 * element);
}

TEST(BagWriter, WritesInfraredImagesUnderTheNamesOfADriver) {
  const TemporaryFolder folder;
  BagOptions options;
  options.infrared = true;
  for (const std::string file : {"a.bag", "a.mcap"}) {
    BagWriter bag(folder / file, VehicleConfig{}, options);
    for (int i = 0; i < 4; ++i) {
      bag.begin(i * 100'000'000 + 40'000'000);
      bag.infrared(infrared_image(i));
    }
    bag.close();
    Recording recording(folder / file);
    std::map<std::string, std::uint64_t> messages;
    for (const RecordedTopic& topic : recording.topics()) messages[topic.name] = topic.messages;
    EXPECT_EQ(messages["/camera/infra1/image_rect_raw"], 4U) << file;
    EXPECT_EQ(messages["/camera/infra1/camera_info"], 4U) << file;
    EXPECT_EQ(messages["/camera/infra2/image_rect_raw"], 2U) << file;
    EXPECT_EQ(messages["/camera/infra2/camera_info"], 2U) << file;
  }
  Recording recording(folder / "a.bag");
  RecordedMessage message;
  int seen = 0, transforms = 0;
  while (recording.next(message)) {
    const std::string& topic = recording.topics()[message.topic].name;
    const std::string bytes(message.bytes);
    if (topic == "/tf_static") {
      transforms += bytes.find("camera_infra1_optical_frame") != std::string::npos;
      transforms += bytes.find("camera_infra2_optical_frame") != std::string::npos;
    }
    if (topic.find("/camera/infra") != 0) continue;
    const int eye = topic[13] - '0';
    EXPECT_NE(bytes.find(eye == 1 ? "camera_infra1_optical_frame" : "camera_infra2_optical_frame"),
              std::string::npos);
    if (topic.ends_with("camera_info")) {
      EXPECT_EQ(projection_of(message, 0), 424.5);
      EXPECT_EQ(projection_of(message, 2), 3.5);
      EXPECT_EQ(projection_of(message, 3), eye == 1 ? 0 : -424.5 * 0.0625);
      EXPECT_EQ(projection_of(message, 6), 2.5);
    } else {
      EXPECT_NE(bytes.find("mono8"), std::string::npos);
      const int index = static_cast<int>(message.time / 100'000'000);
      const StereoImage image = infrared_image(index);
      EXPECT_EQ(value_at<std::uint32_t>(message, 8), image.time_ns % kNanosecondsPerSecond);
      const auto& grey = eye == 1 ? image.left : image.right;
      EXPECT_EQ(bytes.substr(bytes.size() - 48), std::string(grey.begin(), grey.end()));
    }
    ++seen;
  }
  EXPECT_EQ(seen, 12);
  EXPECT_EQ(transforms, 2);
}

TEST(BagWriter, RefusesAnInfraredImageOfTheWrongSize) {
  const TemporaryFolder folder;
  BagWriter bag(folder / "a.bag", VehicleConfig{});
  StereoImage image = infrared_image(0);
  image.left.pop_back();
  EXPECT_THROW(bag.infrared(image), std::invalid_argument);
}

}  // namespace
}  // namespace arex::sim
