#include "bag/replay_input.h"

#include <algorithm>
#include <cctype>
#include <functional>
#include <utility>

#include "bag/ros_bytes.h"
#include "config/config.h"
#include "config/nearest.h"
#include "config/text.h"

namespace arex::sim {
namespace {

constexpr std::size_t kSurveyedSamples = 200, kSurveyedScans = 10;
constexpr std::size_t kSurveyedMessages = 5000;
// A clock that shows less counts from its start; what stamps and arrivals differ by at most.
constexpr Stamp kYoungClock = 1'000'000 * kNanosecondsPerSecond;
constexpr Stamp kOneClock = kNanosecondsPerSecond;

using TopicRule = std::function<bool(const RecordedTopic&)>;

std::size_t topic_named(const Recording& recording, const std::string& name,
                        const std::string& option, const TopicRule& fits,
                        const std::string& expected) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < recording.topics().size(); ++i) {
    const RecordedTopic& topic = recording.topics()[i];
    if (topic.name == name && fits(topic)) return i;
    if (topic.name == name) {
      throw ConfigError(option + ": " + name + " has messages of type " +
                        printable(shortened(topic.type)) + ", expected " + expected);
    }
    if (fits(topic)) names.push_back(topic.name);
  }
  throw ConfigError(option + ": the recording has no topic '" + shortened(name) + "'" +
                    (names.empty() ? " and none of type " + expected
                                   : "; did you mean '" + printable(nearest(name, names)) + "'?"));
}

std::size_t busiest_topic(const Recording& recording, const std::filesystem::path& file,
                          const TopicRule& fits, const std::string& expected) {
  std::optional<std::size_t> best;
  for (std::size_t i = 0; i < recording.topics().size(); ++i) {
    const RecordedTopic& topic = recording.topics()[i];
    if (!fits(topic) || topic.messages == 0) continue;
    if (!best || topic.messages > recording.topics()[*best].messages) best = i;
  }
  if (best) return *best;
  throw ConfigError(file.string() + ": holds no message of type " + expected +
                    ", expected a recording of a LiDAR and an IMU");
}

bool is_imu(const RecordedTopic& topic) { return topic.type == "sensor_msgs/Imu"; }
bool is_lidar(const RecordedTopic& topic) { return ScanDecoder::knows(topic.type); }
bool has_poses(const RecordedTopic& topic) { return is_pose_type(topic.type); }

/// Whether a topic's name says that its poses are the truth, not somebody's estimate.
bool sounds_true(std::string name) {
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const char* word :
       {"truth", "ground", "/gt", "vicon", "mocap", "optitrack", "vrpn", "leica"}) {
    if (name.find(word) != std::string::npos) return true;
  }
  return false;
}

Stamp median_step(std::vector<Stamp> stamps) {
  if (stamps.size() < 3) return 0;
  std::vector<Stamp> steps;
  for (std::size_t i = 1; i < stamps.size(); ++i) steps.push_back(stamps[i] - stamps[i - 1]);
  std::nth_element(steps.begin(), steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2),
                   steps.end());
  return steps[steps.size() / 2];
}

/// The pose of frame b in frame a, where transforms lead from both to one root.
std::optional<Pose> pose_between(const std::vector<DecodedTransform>& transforms,
                                 const std::string& a, const std::string& b) {
  struct Rooted {
    std::string root;
    Pose X;
  };
  const auto to_root = [&](const std::string& frame) {
    Rooted at{frame, Pose()};
    // No longer than the list: what turns in a circle has no root.
    for (std::size_t step = 0; step <= transforms.size(); ++step) {
      const auto up = std::find_if(transforms.begin(), transforms.end(),
                                   [&](const auto& t) { return t.child == at.root; });
      if (up == transforms.end()) return std::optional(at);
      at = {up->parent, up->X * at.X};
    }
    return std::optional<Rooted>();
  };
  const auto from_a = to_root(a), from_b = to_root(b);
  if (!from_a || !from_b || from_a->root != from_b->root) return std::nullopt;
  return from_a->X.inverse() * from_b->X;
}

/// Of the LiDAR in its own IMU. Source: Livox, Mid-360 user manual, coordinates.
const Vec3 kLivoxImu_m{-0.011, -0.02329, 0.04412};

}  // namespace

ReplayInput::ReplayInput(const std::filesystem::path& file, const ReplayOptions& options)
    : recording_(file),
      options_(options),
      cameras_(recording_, options.depth_topic, options.infrared_topic),
      decoder_(options.time_unit) {
  const std::string clouds = "PointCloud2 or CustomMsg", samples = "sensor_msgs/Imu";
  lidar_ = options.lidar_topic.empty()
               ? busiest_topic(recording_, file, is_lidar, clouds)
               : topic_named(recording_, options.lidar_topic, "--lidar-topic", is_lidar, clouds);
  imu_ = options.imu_topic.empty()
             ? busiest_topic(recording_, file, is_imu, samples)
             : topic_named(recording_, options.imu_topic, "--imu-topic", is_imu, samples);
  if (!options.truth_topic.empty()) {
    truth_ = topic_named(recording_, options.truth_topic, "--truth-topic", has_poses,
                         "Odometry, PoseStamped or TransformStamped");
  }
  for (std::size_t i = 0; i < recording_.topics().size(); ++i) {
    const RecordedTopic& topic = recording_.topics()[i];
    if (!truth_ && has_poses(topic) && sounds_true(topic.name)) truth_ = i;
    if (topic.type == "sensor_msgs/TimeReference") frame_ends_.push_back(i);
    if (!magnetometer_ && topic.type == "sensor_msgs/MagneticField") magnetometer_ = i;
    if (topic.type == "tf2_msgs/TFMessage" && topic.name == "/tf_static") transforms_.push_back(i);
  }
  survey();
  use({});
}

std::string ReplayInput::depth_topic() const {
  return use_.depth ? name_of(cameras_.depth()->topic) : "";
}

std::string ReplayInput::infrared_topic() const {
  return use_.infrared ? name_of(cameras_.infrared()->left) : "";
}

void ReplayInput::survey() {
  std::vector<std::size_t> read{lidar_, imu_};
  read.insert(read.end(), transforms_.begin(), transforms_.end());
  recording_.select(read);
  std::vector<Stamp> samples, scans;
  std::vector<double> specific_forces;
  std::vector<DecodedTransform> transforms;
  Stamp least_delay = kForever;
  RecordedMessage message;
  for (std::size_t n = 0; n < kSurveyedMessages && recording_.next(message); ++n) {
    const RecordedTopic& topic = recording_.topics()[message.topic];
    try {
      if (message.topic == imu_) {
        const DecodedImu imu = decode_imu(message.bytes, topic.format);
        if (samples.empty()) imu_frame_ = imu.frame;
        samples.push_back(imu.sample.stamp);
        specific_forces.push_back(imu.sample.accel_mps2.norm());
        least_delay = std::min(least_delay, message.time - imu.sample.stamp);
      } else if (message.topic == lidar_) {
        const DecodedScan scan = decoder_.decode(topic.type, message.bytes, topic.format);
        if (scans.empty()) lidar_frame_ = scan.frame;
        scans.push_back(scan.header_stamp);
      } else {
        for (DecodedTransform& t : decode_transforms(message.bytes, topic.format)) {
          transforms.push_back(std::move(t));
        }
      }
    } catch (const DecodeError&) {
      // Counted when it is replayed.
    }
    if (samples.size() >= kSurveyedSamples && scans.size() >= kSurveyedScans) break;
  }
  if (samples.empty() || scans.empty()) {
    throw ConfigError(printable(shortened(name_of(samples.empty() ? imu_ : lidar_))) +
                      ": none of the first messages can be read, expected " +
                      (samples.empty() ? "IMU samples" : "LiDAR frames"));
  }
  imu_checks_.period = median_step(samples);
  scan_checks_.period = median_step(scans);
  if (least_delay < -kOneClock || least_delay > kOneClock) clock_shift_ = least_delay;
  const Stamp first = std::min(samples.front(), scans.front());
  if (first > kYoungClock) origin_ = first / kNanosecondsPerSecond * kNanosecondsPerSecond;

  std::nth_element(
      specific_forces.begin(),
      specific_forces.begin() + static_cast<std::ptrdiff_t>(specific_forces.size() / 2),
      specific_forces.end());
  const double usual = specific_forces[specific_forces.size() / 2];
  const bool in_g = options_.accel_unit == AccelUnit::kAuto ? usual > 0.5 && usual < 2
                                                            : options_.accel_unit == AccelUnit::kG;
  accel_factor_ = in_g ? kGravity : 1;
  accel_unit_told_ = options_.accel_unit != AccelUnit::kAuto || in_g ||
                     (usual > 0.5 * kGravity && usual < 2 * kGravity);
  find_mounts(transforms);
}

void ReplayInput::find_mounts(const std::vector<DecodedTransform>& transforms) {
  const auto bare = [](const std::string& frame) {
    return frame.starts_with('/') ? frame.substr(1) : frame;
  };
  const std::string imu = bare(imu_frame_), lidar = bare(lidar_frame_);
  if (imu != lidar) {
    X_BL_ = pose_between(transforms, imu, lidar);
  } else if (lidar.find("livox") != std::string::npos) {
    X_BL_ = Pose{Mat3::Identity(), kLivoxImu_m};
  }
  if (cameras_.depth()) X_B_depth_ = pose_between(transforms, imu, bare(cameras_.depth()->frame));
  if (cameras_.infrared()) {
    X_B_infrared_ = pose_between(transforms, imu, bare(cameras_.infrared()->frame));
  }
}

std::vector<std::string> ReplayInput::notes() const {
  std::vector<std::string> notes;
  const auto say = [&](const std::string& topic, std::uint64_t count, const char* what) {
    if (count > 0) notes.push_back(topic + ": " + std::to_string(count) + " messages " + what);
  };
  std::vector<std::pair<std::size_t, MessageCounts>> streams{{imu_, imu_checks_.counts},
                                                             {lidar_, scan_checks_.counts}};
  if (use_.depth) streams.emplace_back(cameras_.depth()->topic, depth_checks_.counts);
  if (use_.infrared) streams.emplace_back(cameras_.infrared()->left, infrared_checks_.counts);
  for (const auto& [topic, counts] : streams) {
    say(name_of(topic), counts.damaged, "cannot be read");
    say(name_of(topic), counts.unordered, "came behind later ones and were left out");
    say(name_of(topic), counts.doubled, "came twice");
    say(name_of(topic), counts.missing, "are missing between the others");
  }
  const RecordingDamage& damage = recording_.damage();
  if (damage.places > 0) {
    notes.push_back("the file is damaged in " + std::to_string(damage.places) +
                    " places, the first " + damage.first + "; " + std::to_string(damage.skipped) +
                    " bytes were passed over");
  }
  say("the file", damage.orphans, "belong to no connection");
  if (!accel_unit_told_) {
    notes.push_back(name_of(imu_) +
                    ": accelerations look like neither g nor m/s^2, taken for m/s^2");
  }
  if (decoder_.timeless()) {
    notes.push_back(name_of(lidar_) + ": points without times, each frame taken at its stamp");
  }
  if (clock_shift_ != 0) {
    notes.push_back("recorded by another clock than the stamps', taken to be " +
                    std::to_string(to_seconds(clock_shift_)) + " s apart");
  }
  return notes;
}

}  // namespace arex::sim
