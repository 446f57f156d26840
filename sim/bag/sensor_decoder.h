#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bag/recording.h"
#include "messages/sensors.h"

/// The messages of other people's recordings as samples of ours. Stamps are the headers' own, ns.
/// All functions throw DecodeError for bytes that are no such message.
namespace arex::sim {

struct DecodedImu {
  ImuSample sample;  ///< accelerations in whatever unit the driver writes
  std::string frame;
};
DecodedImu decode_imu(std::string_view bytes, WireFormat format);

struct DecodedField {
  Stamp stamp = 0;
  std::string frame;
  Vec3 gauss = Vec3::Zero();
};
/// A sensor_msgs/MagneticField, which is in tesla.
DecodedField decode_field(std::string_view bytes, WireFormat format);

struct DecodedPose {
  Stamp stamp = 0;
  Pose X;  ///< of the child in the header's frame
};
/// Whether decode_pose() knows the type: nav_msgs/Odometry, geometry_msgs/PoseStamped,
/// PoseWithCovarianceStamped or TransformStamped.
bool is_pose_type(std::string_view type);
DecodedPose decode_pose(std::string_view type, std::string_view bytes, WireFormat format);

struct DecodedTransform {
  std::string parent, child;
  Pose X;  ///< of the child in the parent
};
/// tf2_msgs/TFMessage.
std::vector<DecodedTransform> decode_transforms(std::string_view bytes, WireFormat format);

/// sensor_msgs/TimeReference of our own recordings: when a frame was closed (see BagWriter).
struct DecodedFrameEnd {
  Stamp stamp = 0;  ///< of the frame, which tells whose end it is
  Stamp end = 0;
  std::string frame;
};
/// @return nothing for what other people reference.
std::optional<DecodedFrameEnd> decode_frame_end(std::string_view bytes, WireFormat format);

/// What the numbers of a cloud's time field count.
enum class TimeUnit : std::uint8_t { kAuto, kSeconds, kMilliseconds, kMicroseconds, kNanoseconds };

struct DecodedScan {
  std::shared_ptr<LidarScan> scan;  ///< its end is that of its last point
  Stamp header_stamp = 0;           ///< the scan's own stamp, unless points were fired before it
  std::string frame;
  std::size_t invalid = 0;  ///< points left out: nothing returned (zeros), or not finite
};

/// Clouds of LiDARs: sensor_msgs/PointCloud2 with a time for each point, by the name that its
/// driver gives the field, and CustomMsg of livox_ros_driver and livox_ros_driver2.
///
///     offset_time, t, time, timestamp, time_stamp, time_offset    any type
///     intensity, reflectivity; line, ring, channel; tag           may be absent
///
/// Times are seconds, ms, us or ns, since the header's stamp or of the same clock as that: the
/// first frame that lasts tells. A frame lasts 2 ms to 2 s. If times are of another clock, the
/// frame's earliest point is taken to be at the stamp.
class ScanDecoder {
 public:
  explicit ScanDecoder(TimeUnit unit = TimeUnit::kAuto) : unit_(unit) {}

  /// Whether decode() knows the type.
  static bool knows(std::string_view type);
  DecodedScan decode(std::string_view type, std::string_view bytes, WireFormat format);

  /// Whether a cloud without times came: all of its points count as taken at its stamp.
  [[nodiscard]] bool timeless() const { return timeless_; }

 private:
  enum class Reference : std::uint8_t { kStamp, kSameClock, kOtherClock };

  DecodedScan decode_cloud(WireReader reader);
  static DecodedScan decode_custom(WireReader reader);
  /// Remembered once a frame has told it.
  Reference reference_of(const std::vector<double>& times, Stamp stamp);
  /// Sets the points' offsets, and moves the scan's stamp to its earliest point if that is earlier.
  void set_times(const std::vector<double>& times, LidarScan& scan);

  TimeUnit unit_;
  std::optional<Reference> reference_;  ///< nothing: not learnt yet
  bool timeless_ = false;
};

}  // namespace arex::sim
