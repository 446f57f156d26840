#include "bag/recorded_cameras.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "config/config.h"
#include "config/nearest.h"
#include "config/text.h"

namespace arex::sim {
namespace {

constexpr std::size_t kSurveyedImages = 2000;
constexpr double kSquare = 0.01;             // what the focal lengths of a pixel's axes differ by
constexpr std::size_t kSmallestEye_px = 64;  // less has no features
/// How the left eye's topic is told from the right one's.
constexpr std::array<std::pair<std::string_view, std::string_view>, 2> kEyes{
    {{"infra1", "infra2"}, {"left", "right"}}};

/// The topic beside it: /camera/depth/image_rect_raw -> /camera/depth/camera_info.
std::string info_beside(const std::string& topic) {
  const std::size_t slash = topic.rfind('/');
  return (slash == std::string::npos ? "" : topic.substr(0, slash)) + "/camera_info";
}

/// The right eye's topic; empty: the name is no left one's.
std::string right_of(const std::string& left) {
  for (const auto& [own, other] : kEyes) {
    const std::size_t at = left.find(own);
    if (at != std::string::npos) return std::string(left).replace(at, own.size(), other);
  }
  return "";
}

std::string shown(const std::string& text) { return printable(shortened(text)); }

}  // namespace

RecordedCameras::RecordedCameras(Recording& recording, const std::string& depth_topic,
                                 const std::string& infrared_topic) {
  survey(recording);
  find_depth(depth_topic);
  find_infrared(infrared_topic);
}

void RecordedCameras::survey(Recording& recording) {
  std::vector<std::size_t> read;
  const std::vector<RecordedTopic>& topics = recording.topics();
  for (std::size_t i = 0; i < topics.size(); ++i) {
    const bool of_a_camera =
        topics[i].type == "sensor_msgs/Image" || topics[i].type == "sensor_msgs/CameraInfo";
    if (of_a_camera && topics[i].messages > 0) read.push_back(i);
  }
  if (read.empty()) return;
  recording.select(read);
  std::vector<bool> known(topics.size());
  std::size_t left = read.size();
  RecordedMessage message;
  for (std::size_t n = 0; left > 0 && n < kSurveyedImages && recording.next(message); ++n) {
    const RecordedTopic& topic = recording.topics()[message.topic];
    if (known[message.topic]) continue;
    try {
      if (topic.type == "sensor_msgs/Image") {
        const DecodedImage image = decode_image(message.bytes, topic.format);
        images_.push_back({message.topic, topic.name, std::string(image.frame),
                           std::string(image.encoding), image.width, image.height, topic.messages});
      } else {
        cameras_.emplace(topic.name, decode_camera_info(message.bytes, topic.format));
      }
      known[message.topic] = true;
      --left;
    } catch (const DecodeError&) {
      // The next may be sound.
    }
  }
  // Whoever was first to be read: the answer is that of the recording's topics.
  std::ranges::stable_sort(images_, {}, &Seen::topic);
  std::ranges::stable_sort(images_, std::ranges::greater(), &Seen::messages);
}

const RecordedCameras::Seen* RecordedCameras::named(const std::string& name) const {
  const auto found = std::ranges::find(images_, name, &Seen::name);
  return found == images_.end() ? nullptr : &*found;
}

const DecodedCamera* RecordedCameras::calibration_of(const Seen& images) const {
  const auto beside = cameras_.find(info_beside(images.name));
  if (beside != cameras_.end()) return &beside->second;
  for (const auto& [name, camera] : cameras_) {
    if (camera.frame == images.frame && !images.frame.empty()) return &camera;
  }
  return nullptr;
}

std::string RecordedCameras::fault_of(const Seen& images) const {
  const DecodedCamera* info = calibration_of(images);
  if (info == nullptr) return "no camera_info says what its pixels look at";
  if (info->distorted) return "its images are distorted, expected rectified ones";
  const auto width = static_cast<std::size_t>(info->camera.width);
  const auto height = static_cast<std::size_t>(info->camera.height);
  if (width != images.width || height != images.height) {
    return "its camera_info is of another size than its images";
  }
  return "";
}

void RecordedCameras::find_depth(const std::string& asked) {
  for (const Seen& images : images_) {
    const bool named_so = images.name.find("depth") != std::string::npos &&
                          images.name.find("aligned") == std::string::npos;
    if (asked.empty() ? !named_so : images.name != asked) continue;
    std::string fault;
    if (!is_depth_encoding(images.encoding)) {
      if (asked.empty()) continue;
      fault = "is of encoding '" + shown(images.encoding) + "', expected 16UC1 or 32FC1";
    } else {
      fault = fault_of(images);
    }
    if (fault.empty()) {
      depth_ = {images.topic, images.frame, calibration_of(images)->camera};
      return;
    }
    if (!asked.empty()) throw ConfigError("--depth-topic: " + shown(images.name) + ": " + fault);
    notes_.push_back(images.name + ": " + fault + "; left out");
  }
  if (asked.empty() || depth_) return;
  std::vector<std::string> names;
  for (const Seen& images : images_) names.push_back(images.name);
  throw ConfigError(
      "--depth-topic: no images can be read of '" + shown(asked) + "'" +
      (names.empty() ? "" : "; did you mean '" + shown(nearest(asked, names)) + "'?"));
}

void RecordedCameras::find_infrared(const std::string& asked) {
  for (const Seen& left : images_) {
    if (!asked.empty() && left.name != asked) continue;
    const std::string other = right_of(left.name);
    const Seen* right = other.empty() ? nullptr : named(other);
    const bool grey = is_grey_encoding(left.encoding) && right && is_grey_encoding(right->encoding);
    if (!grey) {
      if (asked.empty()) continue;
      throw ConfigError("--infrared-topic: " + shown(left.name) +
                        " is not the left eye of a grey pair, expected mono8 on NAMEinfra1REST and "
                        "NAMEinfra2REST, or with left and right");
    }
    std::string fault = fault_of(left);
    if (fault.empty()) fault = fault_of(*right);
    StereoCamera pair;
    if (fault.empty()) {
      const PinholeCamera& own = calibration_of(left)->camera;
      pair.width = own.width;
      pair.height = own.height;
      pair.f_px = own.fx;
      pair.cx = own.cx;
      pair.cy = own.cy;
      pair.baseline_m = calibration_of(*right)->baseline_m;
      if (!(std::abs(own.fx - own.fy) <= kSquare * own.fx)) fault = "its pixels are not square";
      if (!(pair.baseline_m > 0 && pair.baseline_m < 10)) {
        fault = "the right eye's camera_info says no baseline (P[3])";
      }
      if (std::min(left.width, left.height) < kSmallestEye_px) fault = "its images are too small";
      if (right->width != left.width || right->height != left.height) {
        fault = "its eyes are of different sizes";
      }
    }
    if (fault.empty()) {
      infrared_ = {left.topic, right->topic, left.frame, pair};
      return;
    }
    if (!asked.empty()) throw ConfigError("--infrared-topic: " + shown(left.name) + ": " + fault);
    notes_.push_back(left.name + ": " + fault + "; left out");
  }
  if (asked.empty() || infrared_) return;
  throw ConfigError("--infrared-topic: no images can be read of '" + shown(asked) + "'");
}

}  // namespace arex::sim
