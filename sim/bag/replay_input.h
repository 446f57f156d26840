#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bag/arrival_queue.h"
#include "bag/recorded_cameras.h"
#include "bag/recording.h"
#include "bag/sensor_decoder.h"
#include "messages/sensors.h"

namespace arex::sim {

enum class AccelUnit : std::uint8_t { kAuto, kG, kMps2 };

/// What of a recording is replayed, and how its numbers are meant.
struct ReplayOptions {
  std::string lidar_topic;     ///< empty: of those with a fitting type the one with most messages
  std::string imu_topic;       ///< likewise
  std::string truth_topic;     ///< empty: of those with poses the first whose name says so
  std::string depth_topic;     ///< empty: see RecordedCameras
  std::string infrared_topic;  ///< of the left eye; likewise
  AccelUnit accel_unit = AccelUnit::kAuto;
  TimeUnit time_unit = TimeUnit::kAuto;
};

/// How many messages a recording had of what is replayed, and what was wrong with them.
struct MessageCounts {
  std::uint64_t used = 0;
  std::uint64_t damaged = 0;    ///< no such message, or no possible values
  std::uint64_t unordered = 0;  ///< stamped before one that came earlier; left out
  std::uint64_t doubled = 0;    ///< with the stamp of the one before; left out
  std::uint64_t missing = 0;    ///< that gaps between stamps tell
};

/// Which cameras are replayed, and what their images are handed on with.
struct CameraUse {
  bool depth = false, infrared = false;
  std::string depth_device;  ///< DepthImage::device
  Pose X_BC;                 ///< of the left infrared eye
};

struct StampedPose {
  Stamp stamp = 0;
  Pose X_WB;
};

/// A recording as the vehicle's sensors: samples and scans in order of arrival.
///
/// Times run from time_origin() on, a whole second, which is zero where the recording's own clock
/// begins near zero, as that of our flights. A message arrives when it was recorded. Where that was
/// by another clock than the stamps', the least delay of the first samples is taken for none.
class ReplayInput {
 public:
  /// Looks through the beginning of the recording for topics, units, clocks and mounts.
  /// @throws ConfigError for a topic that is not there, and where none fits.
  ReplayInput(const std::filesystem::path& file, const ReplayOptions& options);

  /// Has the images of cameras replayed, too. Not to be called after next().
  /// @pre the recording has those asked for
  void use(const CameraUse& use);

  /// The next sample, scan or exposure. @return nothing at the end.
  std::optional<Arrival> next();

  /// Poses of the recording's truth in order of time; empty if it has none. Not to be called
  /// between calls of next().
  [[nodiscard]] std::vector<StampedPose> read_truth();

  /// The LiDAR's frame in the IMU's: from /tf_static; of a Livox that stamps both with one frame
  /// that of the maker; otherwise unknown.
  [[nodiscard]] const std::optional<Pose>& X_BL() const { return X_BL_; }
  [[nodiscard]] const RecordedCameras& cameras() const { return cameras_; }
  /// Their frames in the IMU's, from /tf_static; nothing: unknown, or there is no such camera.
  [[nodiscard]] const std::optional<Pose>& X_B_depth() const { return X_B_depth_; }
  [[nodiscard]] const std::optional<Pose>& X_B_infrared() const { return X_B_infrared_; }
  /// The frames that it would be known for.
  [[nodiscard]] const std::string& imu_frame() const { return imu_frame_; }
  [[nodiscard]] const std::string& lidar_frame() const { return lidar_frame_; }

  [[nodiscard]] Stamp time_origin() const { return origin_; }
  [[nodiscard]] Stamp duration() const { return recording_.end() - recording_.begin(); }
  [[nodiscard]] const std::string& lidar_topic() const { return name_of(lidar_); }
  [[nodiscard]] const std::string& imu_topic() const { return name_of(imu_); }
  [[nodiscard]] std::string truth_topic() const { return truth_ ? name_of(*truth_) : ""; }
  /// Empty where they are not replayed.
  [[nodiscard]] std::string depth_topic() const;
  [[nodiscard]] std::string infrared_topic() const;
  [[nodiscard]] const MessageCounts& imu_counts() const { return imu_checks_.counts; }
  [[nodiscard]] const MessageCounts& lidar_counts() const { return scan_checks_.counts; }
  [[nodiscard]] const MessageCounts& depth_counts() const { return depth_checks_.counts; }
  /// Of the left eye.
  [[nodiscard]] const MessageCounts& infrared_counts() const { return infrared_checks_.counts; }
  /// Points that were no returns: zeros, as drivers write what a firing missed, or no numbers.
  [[nodiscard]] std::uint64_t lidar_misses() const { return lidar_misses_; }
  [[nodiscard]] const RecordingDamage& damage() const { return recording_.damage(); }
  /// What a reader of the results should know; a sentence each.
  [[nodiscard]] std::vector<std::string> notes() const;

 private:
  /// That stamps increase, and by how much.
  struct StampChecks {
    MessageCounts counts;
    Stamp period = 0;  ///< usual; 0: not known
    std::optional<Stamp> last;
    /// @return whether the message is to be used.
    bool accept(Stamp stamp);
  };

  [[nodiscard]] const std::string& name_of(std::size_t topic) const {
    return recording_.topics()[topic].name;
  }
  void survey();
  void find_mounts(const std::vector<DecodedTransform>& transforms);
  /// Takes one message. @return whether there was one more.
  bool take();
  std::optional<ImuSample> imu_of(const RecordedMessage& message);
  void note_other(const RecordedMessage& message);
  LidarScanPtr scan_of(const RecordedMessage& message);
  DepthImagePtr depth_of(const RecordedMessage& message);
  void take_left(const RecordedMessage& message, Stamp time);
  void take_right(const RecordedMessage& message, Stamp time);
  [[nodiscard]] Stamp run_time(Stamp recorded) const;

  Recording recording_;
  ReplayOptions options_;
  std::size_t imu_ = 0, lidar_ = 0;  ///< topics
  std::optional<std::size_t> truth_;
  std::optional<std::size_t> magnetometer_;
  std::vector<std::size_t> frame_ends_, transforms_;
  RecordedCameras cameras_;
  CameraUse use_;
  ScanDecoder decoder_;
  double accel_factor_ = 1;  ///< to m/s^2
  bool accel_unit_told_ = true;
  std::string imu_frame_, lidar_frame_;
  std::optional<Pose> X_BL_, X_B_depth_, X_B_infrared_;
  Stamp origin_ = 0;
  Stamp clock_shift_ = 0;  ///< of arrivals behind stamps, by the clocks' difference
  std::optional<DecodedFrameEnd> frame_end_;  ///< the newest
  std::optional<DecodedField> field_;         ///< likewise, in the IMU's frame
  StampChecks imu_checks_, scan_checks_, depth_checks_, infrared_checks_;
  std::uint64_t lidar_misses_ = 0;
  ArrivalQueue queue_;
};

}  // namespace arex::sim
