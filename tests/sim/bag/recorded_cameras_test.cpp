// Cameras of somebody's recording: a RealSense beside a Livox, each message by hand.

#include "bag/recorded_cameras.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "bag/replay_input.h"
#include "bag/ros_bag.h"
#include "packed.h"
#include "refusal.h"
#include "sample_data.h"
#include "support/temporary_folder.h"

namespace arex::sim {
namespace {

using arex::test::TemporaryFolder;
using test::Packed;

constexpr std::uint32_t kMs = 1'000'000;
constexpr std::uint32_t kSide_px = 64;  // of the eyes
const std::string kInfra1 = "/camera/infra1/image_rect_raw";
const std::string kInfra2 = "/camera/infra2/image_rect_raw";

/// What is odd about it.
struct Oddity {
  double distortion = 0, shift = -10, fy = 200;
  bool calibrated = true, right = true;
  std::uint32_t calibrated_width = kSide_px;
};

class CameraBag {
 public:
  explicit CameraBag(const std::filesystem::path& file, const Oddity& odd = {})
      : bag_(file, BagCompression::kNone), odd_(odd) {}

  /// 0.4 s of it.
  void write() {
    mount("camera_imu_optical_frame", "camera_depth_optical_frame", 0.25);
    mount("camera_imu_optical_frame", "camera_infra1_optical_frame", 0.5);
    mount("camera_imu_optical_frame", "livox_frame", 1);
    for (std::uint32_t ms = 0; ms < 400; ms += 5) {
      imu(ms);
      if (ms % 100 == 95) scan(ms - 95, ms);
      if (ms % 100 == 10) depth(ms, ms + 7);
      if (ms % 50 == 20) {
        eye(kInfra1, "camera_infra1_optical_frame", ms, ms + 3, 1);
        if (odd_.right && ms % 100 == 20) {
          eye(kInfra2, "camera_infra2_optical_frame", ms, ms + 4, 2);
        }
      }
      if (ms % 100 == 30) colour(ms);
    }
    bag_.close();
  }

 private:
  std::uint32_t topic(const std::string& name, const RosMessageType& type) {
    const auto known = topics_.find(name);
    if (known != topics_.end()) return known->second;
    return topics_[name] = bag_.add_topic(name, type, false);
  }
  void put(const std::string& name, const RosMessageType& type, std::uint32_t ms,
           const Packed& message) {
    RosBytes bytes;
    bytes.put_raw(message.bytes().data(), message.bytes().size());
    bag_.write(topic(name, type), {1, ms * kMs}, bytes);
  }
  void mount(const std::string& parent, const std::string& child, double x) {
    Packed message;
    message.u32(1).header(1, 0, parent).text(child).f64(x).zeros(5 * 8).f64(1);
    put("/tf_static", tf_type(), 0, message);
  }
  void imu(std::uint32_t ms) {
    Packed message;
    message.header(1, ms * kMs, "camera_imu_optical_frame").zeros(13 * 8).zeros(3 * 8).zeros(9 * 8);
    message.f64(0).f64(0).f64(9.8).zeros(9 * 8);
    put("/camera/imu", imu_type(), ms, message);
  }
  void scan(std::uint32_t at, std::uint32_t ms) {
    Packed data, message;
    for (const std::uint32_t t : {0U, 50'000'000U, 90'000'000U}) data.f32(1).f32(2).f32(3).u32(t);
    message.header(1, at * kMs, "livox_frame").u32(1).u32(3).u32(4);
    message.text("x").u32(0).u8(7).u32(1).text("y").u32(4).u8(7).u32(1);
    message.text("z").u32(8).u8(7).u32(1).text("t").u32(12).u8(6).u32(1);
    message.u8(0).u32(16).u32(48).text(data.bytes()).u8(1);
    put("/points", point_cloud_type(), ms, message);
  }
  void info(const std::string& name, const std::string& frame, std::uint32_t ms,
            std::uint32_t width, std::uint32_t height, double shift) {
    if (!odd_.calibrated) return;
    Packed message;
    message.header(1, ms * kMs, frame).u32(height).u32(width).text("plumb_bob");
    message.u32(1).f64(odd_.distortion);
    message.f64(200).f64(0).f64(31).f64(0).f64(odd_.fy).f64(32).f64(0).f64(0).f64(1).zeros(9 * 8);
    message.f64(200).f64(0).f64(31).f64(shift).zeros(8 * 8).zeros(8 + 17);
    put(name, camera_info_type(), ms, message);
  }
  void image(const std::string& name, const std::string& frame, std::uint32_t at, std::uint32_t ms,
             std::uint32_t width, std::uint32_t height, const std::string& encoding,
             const std::string& data) {
    Packed message;
    message.header(1, at * kMs, frame).u32(height).u32(width).text(encoding).u8(0);
    message.u32(static_cast<std::uint32_t>(data.size()) / height).text(data);
    put(name, image_type(), ms, message);
  }
  void depth(std::uint32_t at, std::uint32_t ms) {
    const std::string frame = "camera_depth_optical_frame";
    info("/camera/depth/camera_info", frame, ms, 2, 1, 0);
    image("/camera/depth/image_rect_raw", frame, at, ms, 2, 1, "16UC1",
          Packed().u16(1500).u16(0).bytes());
    // The same aligned to the colours: not the depth camera's own.
    image("/camera/aligned_depth_to_color/image_raw", "color", at, ms, 1, 1, "16UC1", "ab");
  }
  void eye(const std::string& name, const std::string& frame, std::uint32_t at, std::uint32_t ms,
           char grey) {
    info(name.substr(0, name.rfind('/')) + "/camera_info", frame, ms, odd_.calibrated_width,
         kSide_px, name == kInfra2 ? odd_.shift : 0);
    image(name, frame, at, ms, kSide_px, kSide_px, "mono8",
          std::string(std::size_t{kSide_px} * kSide_px, grey));
  }
  void colour(std::uint32_t ms) {
    image("/camera/color/image_raw", "color", ms, ms, 1, 1, "rgb8", "abc");
  }

  RosBag bag_;
  Oddity odd_;
  std::map<std::string, std::uint32_t> topics_;
};

TEST(RecordedCameras, AreFoundByTheNamesOfARealSense) {
  const TemporaryFolder folder;
  CameraBag(folder / "a.bag").write();
  ReplayInput input(folder / "a.bag", {});
  const RecordedCameras& cameras = input.cameras();
  EXPECT_TRUE(cameras.notes().empty());
  ASSERT_TRUE(cameras.depth());
  EXPECT_EQ(cameras.depth()->frame, "camera_depth_optical_frame");
  EXPECT_EQ(cameras.depth()->camera.width, 2);
  ASSERT_TRUE(cameras.infrared());
  EXPECT_EQ(cameras.infrared()->camera.f_px, 200);
  EXPECT_EQ(cameras.infrared()->camera.baseline_m, 0.05);
  ASSERT_TRUE(input.X_B_depth());
  EXPECT_EQ(input.X_B_depth()->p, Vec3(0.25, 0, 0));
  ASSERT_TRUE(input.X_B_infrared());
  EXPECT_EQ(input.X_B_infrared()->p, Vec3(0.5, 0, 0));
}

TEST(RecordedCameras, GiveTheirImagesInOrderOfArrivalToWhoAsksForThem) {
  const TemporaryFolder folder;
  CameraBag(folder / "a.bag").write();
  ReplayInput input(folder / "a.bag", {});
  while (const auto arrival = input.next()) {
    ASSERT_TRUE(arrival->imu || arrival->scan);  // nobody has asked yet
  }
  ReplayInput again(folder / "a.bag", {});
  CameraUse use;
  use.depth = use.infrared = true;
  use.depth_device = "depth";
  use.X_BC.p = {1, 2, 3};
  again.use(use);
  EXPECT_EQ(again.depth_topic(), "/camera/depth/image_rect_raw");
  EXPECT_EQ(again.infrared_topic(), kInfra1);
  std::vector<Arrival> depths, images;
  Stamp before = 0;
  while (const auto arrival = again.next()) {
    EXPECT_GE(arrival->time, before);
    before = arrival->time;
    if (arrival->depth) depths.push_back(*arrival);
    if (arrival->images) images.push_back(*arrival);
  }
  constexpr Stamp kBegin = kNanosecondsPerSecond;
  ASSERT_EQ(depths.size(), 4U);
  EXPECT_EQ(depths[1].time, kBegin + 117 * kMs);
  EXPECT_EQ(depths[1].depth->stamp, kBegin + 110 * kMs);
  EXPECT_EQ(depths[1].depth->device, "depth");
  EXPECT_EQ(depths[1].depth->depth_m, (std::vector<float>{1.5F, 0}));
  EXPECT_EQ(depths[1].depth->camera.cx, 31);
  ASSERT_EQ(images.size(), 8U);  // every second of the left eye alone
  for (std::size_t i = 0; i < images.size(); ++i) {
    const StereoImage& image = *images[i].images;
    const Stamp stamp = kBegin + (20 + 50 * static_cast<Stamp>(i)) * kMs;
    EXPECT_EQ(image.time_ns, stamp);
    EXPECT_EQ(images[i].time, stamp + (i % 2 == 0 ? 4 : 3) * kMs);
    EXPECT_EQ(image.left, std::vector<std::uint8_t>(kSide_px * kSide_px, 1));
    EXPECT_EQ(image.right.size(), i % 2 == 0 ? kSide_px * kSide_px : 0U);
    EXPECT_EQ(image.camera.X_BC.p, Vec3(1, 2, 3));
  }
  EXPECT_EQ(again.depth_counts().used, 4U);
  EXPECT_EQ(again.infrared_counts().used, 8U);
}

TEST(RecordedCameras, SayWhyACameraCannotBeUsed) {
  const TemporaryFolder folder;
  const auto expect_fault = [&](const Oddity& odd, const std::string& why, bool depth_stays) {
    CameraBag(folder / "a.bag", odd).write();
    const ReplayInput input(folder / "a.bag", {});
    EXPECT_EQ(input.cameras().depth().has_value(), depth_stays) << why;
    EXPECT_FALSE(input.cameras().infrared()) << why;
    const auto& notes = input.cameras().notes();
    EXPECT_TRUE(std::any_of(notes.begin(), notes.end(), [&](const std::string& note) {
      return note.find(why) != std::string::npos;
    })) << why;
    ReplayOptions asked;
    asked.infrared_topic = kInfra1;
    EXPECT_NE(test::refusal_of(folder / "a.bag", asked).find(why), std::string::npos) << why;
  };
  expect_fault({.distortion = 0.1}, "are distorted", false);
  expect_fault({.calibrated = false}, "no camera_info", false);
  expect_fault({.shift = 0}, "says no baseline", true);
  expect_fault({.fy = 210}, "not square", true);
  expect_fault({.calibrated_width = 32}, "of another size", true);

  CameraBag(folder / "a.bag", {.right = false}).write();
  EXPECT_FALSE(ReplayInput(folder / "a.bag", {}).cameras().infrared());
  ReplayOptions asked;
  asked.infrared_topic = kInfra1;
  EXPECT_NE(test::refusal_of(folder / "a.bag", asked).find("not the left eye of a grey pair"),
            std::string::npos);
  asked = {};
  asked.depth_topic = "/camera/depth/image_rec_raw";
  EXPECT_NE(
      test::refusal_of(folder / "a.bag", asked).find("did you mean '/camera/depth/image_rect_raw'"),
      std::string::npos);
  asked.depth_topic = "/camera/color/image_raw";
  EXPECT_NE(test::refusal_of(folder / "a.bag", asked).find("is of encoding 'rgb8'"),
            std::string::npos);
}

TEST(RecordedCameras, OfOurOwnFlightComeBackToTheLastBit) {
  const TemporaryFolder folder;
  for (const char* name : {"a.bag", "a.mcap"}) {
    StereoImage shot;
    shot.width = shot.height = static_cast<int>(kSide_px);
    shot.camera = {shot.width, shot.height, 40.1, 31.7, 30.3, 0.0507, {}};
    for (std::uint32_t k = 0; k < kSide_px * kSide_px; ++k) {
      shot.left.push_back(static_cast<std::uint8_t>(k % 251));
      shot.right.push_back(static_cast<std::uint8_t>(k % 241));
    }
    BagOptions options;
    options.infrared = true;
    {
      BagWriter bag(folder / name, VehicleConfig{}, options);
      test::write_samples(bag);
      bag.infrared(shot);
      bag.close();
    }
    ReplayInput input(folder / name, {});
    ASSERT_TRUE(input.X_B_depth() && input.X_B_infrared()) << name;
    EXPECT_LT((input.X_B_infrared()->R - VehicleConfig().X_BC().R).norm(), 1e-14) << name;
    CameraUse use;
    use.depth = use.infrared = true;
    input.use(use);
    int depths = 0, shots = 0;
    while (const auto arrival = input.next()) {
      if (arrival->depth) {
        const DepthImage flown = test::depth_image(depths++);
        EXPECT_EQ(arrival->depth->depth_m, flown.depth_m) << name;
        EXPECT_EQ(arrival->depth->stamp, flown.stamp) << name;
        EXPECT_EQ(arrival->depth->camera.fy, flown.camera.fy) << name;
      }
      if (!arrival->images) continue;
      ++shots;
      EXPECT_EQ(arrival->images->left, shot.left) << name;
      EXPECT_EQ(arrival->images->right, shot.right) << name;
      EXPECT_EQ(arrival->images->camera.f_px, shot.camera.f_px) << name;
      EXPECT_EQ(arrival->images->camera.cx, shot.camera.cx) << name;
      EXPECT_EQ(arrival->images->camera.cy, shot.camera.cy) << name;
      EXPECT_NEAR(arrival->images->camera.baseline_m, shot.camera.baseline_m, 1e-15) << name;
    }
    EXPECT_EQ(depths, test::kDepthImages) << name;
    EXPECT_EQ(shots, 1) << name;
  }
}

}  // namespace
}  // namespace arex::sim
