#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <functional>
#include <limits>

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
  BagWriter bag(file, VehicleConfig{}, compression);
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
  ImuSample early;
  early.stamp = -kRosEpoch;
  EXPECT_THROW(bag.imu(early), std::out_of_range);
  early.stamp = 1 - kRosEpoch;  // a device's clock may lag; one nanosecond is a valid time
  EXPECT_NO_THROW(bag.imu(early));
  ImuSample late;
  late.stamp = std::numeric_limits<Stamp>::max() - kRosEpoch;
  EXPECT_THROW(bag.imu(late), std::out_of_range);
  DepthImage image = test::depth_image(0);
  image.depth_m.pop_back();
  EXPECT_THROW(bag.depth(image), std::invalid_argument);
}

}  // namespace
}  // namespace arex::sim
