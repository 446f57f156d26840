// What a recording's messages become, one after the other.

#include <algorithm>
#include <utility>

#include "bag/replay_input.h"
#include "bag/ros_bytes.h"

namespace arex::sim {
namespace {

/// An image of another size than the first is none of that camera's.
void expect_size(const DecodedImage& image, int width, int height) {
  if (image.width != static_cast<std::size_t>(width) ||
      image.height != static_cast<std::size_t>(height)) {
    throw DecodeError("an image of another size than the first");
  }
}

}  // namespace

bool ReplayInput::StampChecks::accept(Stamp stamp) {
  if (last && stamp == *last) {
    ++counts.doubled;
    return false;
  }
  if (last && stamp < *last) {
    ++counts.unordered;
    return false;
  }
  // Stamps of a damaged recording may lie so far apart that no multiple of it is a number.
  const Stamp gap = last ? stamp - *last : 0;
  if (period > 0 && gap - period > period / 2) {
    const bool rounds_up = gap % period >= period - period / 2;
    counts.missing += static_cast<std::uint64_t>(gap / period - (rounds_up ? 0 : 1));
  }
  last = stamp;
  ++counts.used;
  return true;
}

void ReplayInput::use(const CameraUse& use) {
  use_ = use;
  std::vector<std::size_t> read{lidar_, imu_};
  read.insert(read.end(), frame_ends_.begin(), frame_ends_.end());
  if (magnetometer_) read.push_back(*magnetometer_);
  if (use.depth) read.push_back(cameras_.depth().value().topic);
  if (use.infrared) {
    read.push_back(cameras_.infrared().value().left);
    read.push_back(cameras_.infrared().value().right);
  }
  recording_.select(read);
}

Stamp ReplayInput::run_time(Stamp recorded) const {
  return recorded == kRosZero ? 0 : recorded - origin_;
}

std::optional<Arrival> ReplayInput::next() {
  while (true) {
    if (auto arrival = queue_.pop()) return arrival;
    if (!take()) {
      queue_.close();
      return queue_.pop();
    }
  }
}

bool ReplayInput::take() {
  RecordedMessage message;
  if (!recording_.next(message)) return false;
  Arrival arrival;
  arrival.time = run_time(message.time - clock_shift_);
  if (message.topic == imu_) {
    arrival.imu = imu_of(message);
  } else if (message.topic == lidar_) {
    arrival.scan = scan_of(message);
  } else if (use_.depth && message.topic == cameras_.depth()->topic) {
    arrival.depth = depth_of(message);
  } else if (use_.infrared && message.topic == cameras_.infrared()->left) {
    take_left(message, arrival.time);
  } else if (use_.infrared && message.topic == cameras_.infrared()->right) {
    take_right(message, arrival.time);
  } else {
    note_other(message);
  }
  if (!arrival.empty()) queue_.push(std::move(arrival));
  return true;
}

void ReplayInput::note_other(const RecordedMessage& message) {
  const WireFormat format = recording_.topics()[message.topic].format;
  try {
    if (message.topic == magnetometer_) {
      DecodedField field = decode_field(message.bytes, format);
      if (field.frame == imu_frame_) field_ = std::move(field);
    } else {
      const auto end = decode_frame_end(message.bytes, format);
      if (end && end->frame == lidar_frame_) frame_end_ = end;
    }
  } catch (const DecodeError&) {
    // Without a field the IMU has six axes; without its end a frame ends with its last point.
  }
}

std::optional<ImuSample> ReplayInput::imu_of(const RecordedMessage& message) {
  try {
    ImuSample sample = decode_imu(message.bytes, recording_.topics()[imu_].format).sample;
    if (!imu_checks_.accept(sample.stamp)) return std::nullopt;
    constexpr Stamp kSameMoment = kNanosecondsPerSecond / 20;
    if (field_ && std::abs(sample.stamp - field_->stamp) <= kSameMoment) {
      sample.field_gauss = field_->gauss;
    }
    sample.stamp = run_time(sample.stamp);
    // A product with one changes nothing, to the last bit.
    sample.accel_mps2 *= accel_factor_;
    return sample;
  } catch (const DecodeError&) {
    ++imu_checks_.counts.damaged;
    return std::nullopt;
  }
}

LidarScanPtr ReplayInput::scan_of(const RecordedMessage& message) {
  const RecordedTopic& topic = recording_.topics()[lidar_];
  try {
    DecodedScan decoded = decoder_.decode(topic.type, message.bytes, topic.format);
    if (!scan_checks_.accept(decoded.header_stamp)) return nullptr;
    lidar_misses_ += decoded.invalid;
    LidarScan& scan = *decoded.scan;
    Stamp end = run_time(scan.end);
    if (frame_end_ && frame_end_->stamp == decoded.header_stamp) end = run_time(frame_end_->end);
    scan.stamp = run_time(scan.stamp);
    scan.end = std::max(end, scan.stamp + 1);
    return decoded.scan;
  } catch (const DecodeError&) {
    ++scan_checks_.counts.damaged;
    return nullptr;
  }
}

DepthImagePtr ReplayInput::depth_of(const RecordedMessage& message) {
  const RecordedCamera& camera = *cameras_.depth();
  try {
    const DecodedImage decoded =
        decode_image(message.bytes, recording_.topics()[camera.topic].format);
    expect_size(decoded, camera.camera.width, camera.camera.height);
    auto image = std::make_shared<DepthImage>();
    image->depth_m = sim::depth_of(decoded);
    if (!depth_checks_.accept(decoded.stamp)) return nullptr;
    image->device = use_.depth_device;
    image->stamp = run_time(decoded.stamp);
    image->camera = camera.camera;
    return image;
  } catch (const DecodeError&) {
    ++depth_checks_.counts.damaged;
    return nullptr;
  }
}

void ReplayInput::take_left(const RecordedMessage& message, Stamp time) {
  const RecordedPair& pair = *cameras_.infrared();
  try {
    const DecodedImage decoded = decode_image(message.bytes, recording_.topics()[pair.left].format);
    expect_size(decoded, pair.camera.width, pair.camera.height);
    auto images = std::make_shared<StereoImage>();
    images->left = grey_of(decoded);
    if (!infrared_checks_.accept(decoded.stamp)) return;
    images->time_ns = run_time(decoded.stamp);
    images->width = pair.camera.width;
    images->height = pair.camera.height;
    images->camera = pair.camera;
    images->camera.X_BC = use_.X_BC;
    queue_.push_left(time, std::move(images));
  } catch (const DecodeError&) {
    ++infrared_checks_.counts.damaged;
  }
}

void ReplayInput::take_right(const RecordedMessage& message, Stamp time) {
  const RecordedPair& pair = *cameras_.infrared();
  try {
    const DecodedImage decoded =
        decode_image(message.bytes, recording_.topics()[pair.right].format);
    expect_size(decoded, pair.camera.width, pair.camera.height);
    queue_.push_right(time, run_time(decoded.stamp), grey_of(decoded));
  } catch (const DecodeError&) {
    // An exposure of the left eye alone.
  }
}

std::vector<StampedPose> ReplayInput::read_truth() {
  std::vector<StampedPose> poses;
  if (!truth_) return poses;
  recording_.select({*truth_});
  const RecordedTopic& topic = recording_.topics()[*truth_];
  RecordedMessage message;
  while (recording_.next(message)) {
    try {
      const DecodedPose pose = decode_pose(topic.type, message.bytes, topic.format);
      poses.push_back({run_time(pose.stamp), pose.X});
    } catch (const DecodeError&) {
      // One pose fewer to compare with.
    }
  }
  std::stable_sort(poses.begin(), poses.end(),
                   [](const auto& a, const auto& b) { return a.stamp < b.stamp; });
  const auto same = std::unique(poses.begin(), poses.end(),
                                [](const auto& a, const auto& b) { return a.stamp == b.stamp; });
  poses.erase(same, poses.end());
  return poses;
}

}  // namespace arex::sim
