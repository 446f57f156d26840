#include "bag/image_decoder.h"

#include <gtest/gtest.h>

#include <limits>

#include "packed.h"

namespace arex::sim {
namespace {

using test::Packed;

/// A sensor_msgs/Image of ROS 1.
std::string image(std::uint32_t width, std::uint32_t height, std::string_view encoding,
                  std::uint32_t step, std::string_view data, bool big_endian = false) {
  return Packed()
      .header(12, 500, "camera_depth_optical_frame")
      .u32(height)
      .u32(width)
      .text(encoding)
      .u8(big_endian)
      .u32(step)
      .text(data)
      .bytes();
}

DecodedImage decode(const std::string& bytes) { return decode_image(bytes, WireFormat::kRos1); }

TEST(ImageDecoder, ReadsMillimetresOfARealSense) {
  Packed data;
  for (const int z : {0, 1, 1500, 65535}) data.u16(static_cast<std::uint16_t>(z));
  const std::string bytes = image(2, 2, "16UC1", 4, data.bytes());
  const DecodedImage decoded = decode(bytes);
  EXPECT_EQ(decoded.stamp, 12'000'000'500);
  EXPECT_EQ(decoded.frame, "camera_depth_optical_frame");
  EXPECT_EQ(depth_of(decoded), (std::vector<float>{0, 0.001F, 1.5F, 65.535F}));
}

TEST(ImageDecoder, ReadsMetresAndTakesWhatIsNoneForNoMeasurement) {
  Packed data;
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  for (const float z : {kNone, 2.25F, std::numeric_limits<float>::infinity(), -1.0F, 0.0F, 7.5F}) {
    data.f32(z);
  }
  const std::string bytes = image(3, 2, "32FC1", 12, data.bytes());
  EXPECT_EQ(depth_of(decode(bytes)), (std::vector<float>{0, 2.25F, 0, 0, 0, 7.5F}));
}

TEST(ImageDecoder, ReadsRowsThatArePaddedAndNumbersOfEitherOrder) {
  const std::string padded = image(2, 2, "mono8", 4, "ab..cd..");
  EXPECT_EQ(grey_of(decode(padded)), (std::vector<std::uint8_t>{'a', 'b', 'c', 'd'}));
  const std::string swapped = image(1, 2, "16UC1", 3, std::string("\x01\x02.\x00\x01.", 6), true);
  EXPECT_EQ(depth_of(decode(swapped)), (std::vector<float>{0.258F, 0.001F}));
}

TEST(ImageDecoder, RefusesImagesThatAreNone) {
  const auto refused = [](const std::string& bytes, bool grey) {
    const auto read = [&] {
      const DecodedImage decoded = decode(bytes);
      grey ? static_cast<void>(grey_of(decoded)) : static_cast<void>(depth_of(decoded));
    };
    EXPECT_THROW(read(), DecodeError);
  };
  constexpr std::uint32_t kHuge = 0xffffffff;
  refused(image(0, 2, "mono8", 2, "abcd"), true);
  refused(image(2, 0, "mono8", 2, "abcd"), true);
  refused(image(kHuge, kHuge, "mono8", kHuge, "abcd"), true);
  refused(image(2, 16385, "mono8", 2, "abcd"), true);
  refused(image(2, 3, "mono8", 2, "abcd"), true);   // a row is missing
  refused(image(2, 2, "mono8", 1, "abcd"), true);   // rows lie in each other
  refused(image(2, 2, "mono8", 0, "abcd"), true);   // likewise
  refused(image(2, 2, "16UC1", 2, "abcd"), false);  // a pixel has two bytes
  refused(image(1, 1, "rgb8", 3, "abc"), true);
  refused(image(1, 1, "rgb8", 3, "abc"), false);
  refused(image(2, 2, "mono8", 2, "abcd").substr(0, 60), true);
}

/// A sensor_msgs/CameraInfo of ROS 1, 848 x 480.
std::string camera_info(double distortion, double fx, double shift) {
  Packed message;
  message.header(1, 0, "eye").u32(480).u32(848).text("plumb_bob").u32(2).f64(0).f64(distortion);
  message.f64(fx).f64(0).f64(424.5).f64(0).f64(421).f64(238.5).f64(0).f64(0).f64(1);
  message.zeros(9 * 8);
  message.f64(420).f64(0).f64(424.5).f64(shift).zeros(8 * 8);
  return message.zeros(8 + 17).bytes();
}

TEST(ImageDecoder, ReadsCalibrations) {
  const std::string bytes = camera_info(0, 420, -21);
  const DecodedCamera decoded = decode_camera_info(bytes, WireFormat::kRos1);
  EXPECT_EQ(decoded.frame, "eye");
  EXPECT_EQ(decoded.camera.width, 848);
  EXPECT_EQ(decoded.camera.height, 480);
  EXPECT_EQ(decoded.camera.fx, 420);
  EXPECT_EQ(decoded.camera.fy, 421);
  EXPECT_EQ(decoded.camera.cx, 424.5);
  EXPECT_EQ(decoded.camera.cy, 238.5);
  EXPECT_EQ(decoded.baseline_m, 0.05);
  EXPECT_FALSE(decoded.distorted);
  EXPECT_TRUE(decode_camera_info(camera_info(0.01, 420, 0), WireFormat::kRos1).distorted);
  EXPECT_THROW(decode_camera_info(camera_info(0, 0, 0), WireFormat::kRos1), DecodeError);
  EXPECT_THROW(decode_camera_info(bytes.substr(0, 150), WireFormat::kRos1), DecodeError);
}

}  // namespace
}  // namespace arex::sim
