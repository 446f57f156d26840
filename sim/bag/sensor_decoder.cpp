#include "bag/sensor_decoder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

namespace arex::sim {
namespace {

constexpr Stamp kLongestFrame = 4 * kNanosecondsPerSecond;  // what an offset of 32 bits can hold
constexpr std::array<double, 5> kUnits_ns{0, 1e9, 1e6, 1e3, 1};  // by TimeUnit

/// sensor_msgs/PointField.
enum FieldType : std::uint8_t {
  kInt8 = 1,
  kUint8,
  kInt16,
  kUint16,
  kInt32,
  kUint32,
  kFloat32,
  kFloat64
};
constexpr std::array<std::size_t, 9> kFieldSizes{0, 1, 1, 2, 2, 4, 4, 4, 8};

template <class T>
double number_at(const char* bytes, bool swapped) {
  char own[sizeof(T)];
  std::memcpy(own, bytes, sizeof(T));
  if (swapped) std::reverse(own, own + sizeof(T));
  T value;
  std::memcpy(&value, own, sizeof(T));
  return static_cast<double>(value);
}

/// One number of each point.
struct Field {
  std::size_t offset = 0;
  std::uint8_t type = 0;  ///< 0: the cloud has none

  [[nodiscard]] bool exists() const { return type != 0; }
  [[nodiscard]] double of(const char* point, bool swapped) const {
    const char* at = point + offset;
    switch (type) {
      case kInt8:
        return number_at<std::int8_t>(at, swapped);
      case kUint8:
        return number_at<std::uint8_t>(at, swapped);
      case kInt16:
        return number_at<std::int16_t>(at, swapped);
      case kUint16:
        return number_at<std::uint16_t>(at, swapped);
      case kInt32:
        return number_at<std::int32_t>(at, swapped);
      case kUint32:
        return number_at<std::uint32_t>(at, swapped);
      case kFloat32:
        return number_at<float>(at, swapped);
      case kFloat64:
        return number_at<double>(at, swapped);
      default:
        return 0;
    }
  }
};

/// A PointCloud2, looked at where it lies.
struct Cloud {
  WireHeader header;
  std::size_t width = 0, height = 0, point_step = 0, row_step = 0;
  bool swapped = false;
  Field x, y, z, intensity, time, line, tag;
  std::string_view data;
};

/// The first of the fields that has one of the names, in the order of these.
class FieldTable {
 public:
  explicit FieldTable(WireReader& reader) {
    constexpr std::size_t kLeast = 13;  // bytes of one, its name empty
    const std::size_t count = reader.length(kLeast);
    for (std::size_t i = 0; i < count; ++i) {
      const std::string_view name = reader.text();
      const auto offset = reader.number<std::uint32_t>();
      const auto type = reader.number<std::uint8_t>();
      const auto repeated = reader.number<std::uint32_t>();
      // One of none, as some write it, means one.
      if (type >= kInt8 && type <= kFloat64 && repeated <= 1)
        fields_.push_back({name, {offset, type}});
    }
  }
  [[nodiscard]] Field find(std::initializer_list<std::string_view> names,
                           std::size_t point_step) const {
    for (const std::string_view name : names) {
      for (const auto& [own, field] : fields_) {
        if (own != name) continue;
        const std::size_t size = kFieldSizes[field.type];
        if (size > point_step || field.offset > point_step - size) {
          throw DecodeError("a point field beyond the point");
        }
        return field;
      }
    }
    return {};
  }

 private:
  std::vector<std::pair<std::string_view, Field>> fields_;
};

Cloud read_cloud_message(WireReader& reader) {
  Cloud cloud;
  cloud.header = reader.header();
  cloud.height = reader.number<std::uint32_t>();
  cloud.width = reader.number<std::uint32_t>();
  const FieldTable fields(reader);
  cloud.swapped = reader.number<std::uint8_t>() != 0;
  cloud.point_step = reader.number<std::uint32_t>();
  cloud.row_step = reader.number<std::uint32_t>();
  cloud.data = reader.take(reader.length(1));
  cloud.x = fields.find({"x"}, cloud.point_step);
  cloud.y = fields.find({"y"}, cloud.point_step);
  cloud.z = fields.find({"z"}, cloud.point_step);
  if (!cloud.x.exists() || !cloud.y.exists() || !cloud.z.exists()) {
    throw DecodeError("a cloud without x, y and z");
  }
  cloud.intensity = fields.find({"intensity", "reflectivity"}, cloud.point_step);
  cloud.time = fields.find({"offset_time", "t", "time", "timestamp", "time_stamp", "time_offset"},
                           cloud.point_step);
  cloud.line = fields.find({"line", "ring", "channel"}, cloud.point_step);
  cloud.tag = fields.find({"tag"}, cloud.point_step);
  // Only organised clouds have rows that may be padded; some leave row_step zero.
  const std::size_t row = cloud.width * cloud.point_step;
  if (cloud.height <= 1 || cloud.row_step == 0) cloud.row_step = row;
  const bool holds = cloud.width == 0 || cloud.height == 0 ||
                     (cloud.row_step >= row && cloud.row_step <= cloud.data.size() &&
                      (cloud.height - 1) <= (cloud.data.size() - row) / cloud.row_step);
  if (!holds) throw DecodeError("a cloud with less data than it says");
  return cloud;
}

std::uint8_t byte_of(double value) {
  return value > 0 && value < 255 ? static_cast<std::uint8_t>(value)
                                  : static_cast<std::uint8_t>(value >= 255 ? 255 : 0);
}

/// Whether something returned: drivers write zeros, or no number, where nothing did.
bool is_return(const Vec3f& p) { return p.allFinite() && !p.isZero(0); }

}  // namespace

DecodedImu decode_imu(std::string_view bytes, WireFormat format) {
  WireReader reader(bytes, format);
  const WireHeader header = reader.header();
  DecodedImu imu;
  imu.frame = header.frame;
  imu.sample.stamp = header.stamp;
  reader.skip_numbers(4 + 9, sizeof(double));  // orientation, its covariance
  imu.sample.gyro_radps = reader.vector();
  reader.skip_numbers(9, sizeof(double));
  imu.sample.accel_mps2 = reader.vector();
  constexpr double kMost = 1e6;  // beyond any device in any unit
  const double most = std::max(imu.sample.gyro_radps.cwiseAbs().maxCoeff(),
                               imu.sample.accel_mps2.cwiseAbs().maxCoeff());
  if (!imu.sample.gyro_radps.allFinite() || !imu.sample.accel_mps2.allFinite() || most > kMost) {
    throw DecodeError("an IMU sample that is none");
  }
  return imu;
}

DecodedField decode_field(std::string_view bytes, WireFormat format) {
  constexpr double kGaussPerTesla = 1e4, kMost = 1e3;
  WireReader reader(bytes, format);
  const WireHeader header = reader.header();
  DecodedField field{header.stamp, std::string(header.frame), kGaussPerTesla * reader.vector()};
  if (!field.gauss.allFinite() || field.gauss.cwiseAbs().maxCoeff() > kMost) {
    throw DecodeError("a magnetic field that is none");
  }
  return field;
}

bool is_pose_type(std::string_view type) {
  return type == "nav_msgs/Odometry" || type == "geometry_msgs/PoseStamped" ||
         type == "geometry_msgs/PoseWithCovarianceStamped" ||
         type == "geometry_msgs/TransformStamped";
}

DecodedPose decode_pose(std::string_view type, std::string_view bytes, WireFormat format) {
  WireReader reader(bytes, format);
  DecodedPose pose;
  pose.stamp = reader.header().stamp;
  const bool has_child = type == "nav_msgs/Odometry" || type == "geometry_msgs/TransformStamped";
  if (has_child) reader.text();
  pose.X = reader.pose();
  return pose;
}

std::vector<DecodedTransform> decode_transforms(std::string_view bytes, WireFormat format) {
  WireReader reader(bytes, format);
  constexpr std::size_t kLeast = 70;  // bytes of one, its names empty
  std::vector<DecodedTransform> transforms(reader.length(kLeast));
  for (DecodedTransform& transform : transforms) {
    // CDR aligns its members one by one, so that nothing is to be aligned here.
    const auto bare = [](std::string_view frame) {  // of ROS's first years: /base_link
      return std::string(frame.starts_with('/') ? frame.substr(1) : frame);
    };
    transform.parent = bare(reader.header().frame);
    transform.child = bare(reader.text());
    transform.X = reader.pose();
  }
  return transforms;
}

std::optional<DecodedFrameEnd> decode_frame_end(std::string_view bytes, WireFormat format) {
  WireReader reader(bytes, format);
  const WireHeader header = reader.header();
  DecodedFrameEnd end{header.stamp, reader.time(), std::string(header.frame)};
  if (reader.text() != "frame_end") return std::nullopt;
  return end;
}

bool ScanDecoder::knows(std::string_view type) {
  return type == "sensor_msgs/PointCloud2" || type == "livox_ros_driver/CustomMsg" ||
         type == "livox_ros_driver2/CustomMsg";
}

DecodedScan ScanDecoder::decode(std::string_view type, std::string_view bytes, WireFormat format) {
  WireReader reader(bytes, format);
  return type == "sensor_msgs/PointCloud2" ? decode_cloud(reader) : decode_custom(reader);
}

DecodedScan ScanDecoder::decode_cloud(WireReader reader) {
  const Cloud cloud = read_cloud_message(reader);
  DecodedScan decoded{std::make_shared<LidarScan>(), cloud.header.stamp,
                      std::string(cloud.header.frame)};
  LidarScan& scan = *decoded.scan;
  scan.stamp = cloud.header.stamp;
  const std::size_t count = cloud.point_step == 0 ? 0 : cloud.width * cloud.height;
  scan.points.reserve(count);
  std::vector<double> times;
  if (cloud.time.exists()) times.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const char* at =
        cloud.data.data() + i / cloud.width * cloud.row_step + i % cloud.width * cloud.point_step;
    LidarPoint point;
    point.p_L = Vec3(cloud.x.of(at, cloud.swapped), cloud.y.of(at, cloud.swapped),
                     cloud.z.of(at, cloud.swapped))
                    .cast<float>();
    const double time = cloud.time.of(at, cloud.swapped);
    if (!is_return(point.p_L) || !std::isfinite(time)) {
      ++decoded.invalid;
      continue;
    }
    point.intensity = static_cast<float>(cloud.intensity.of(at, cloud.swapped));
    point.line = byte_of(cloud.line.of(at, cloud.swapped));
    point.tag = byte_of(cloud.tag.of(at, cloud.swapped));
    scan.points.push_back(point);
    if (cloud.time.exists()) times.push_back(time);
  }
  timeless_ = timeless_ || (!cloud.time.exists() && count > 0);
  set_times(times, scan);
  return decoded;
}

DecodedScan ScanDecoder::decode_custom(WireReader reader) {
  const WireHeader header = reader.header();
  DecodedScan decoded{std::make_shared<LidarScan>(), header.stamp, std::string(header.frame)};
  LidarScan& scan = *decoded.scan;
  scan.stamp = header.stamp;
  reader.number<std::uint64_t>();  // the first point's time, which the stamp is, too
  reader.number<std::uint32_t>();
  reader.take(4);  // LiDAR's number, reserved
  constexpr std::size_t kPoint = 19;
  const std::size_t count = reader.length(kPoint);
  scan.points.reserve(count);
  std::uint32_t last = 0;
  for (std::size_t i = 0; i < count; ++i) {
    LidarPoint point;
    point.offset_ns = reader.number<std::uint32_t>();
    for (int axis = 0; axis < 3; ++axis) point.p_L[axis] = reader.number<float>();
    point.intensity = reader.number<std::uint8_t>();
    point.tag = reader.number<std::uint8_t>();
    point.line = reader.number<std::uint8_t>();
    if (!is_return(point.p_L)) {
      ++decoded.invalid;
      continue;
    }
    if (point.offset_ns > kLongestFrame) throw DecodeError("a frame of more than 4 s");
    last = std::max(last, point.offset_ns);
    scan.points.push_back(point);
  }
  scan.end = scan.stamp + std::max<std::uint32_t>(last, 1);
  return decoded;
}

ScanDecoder::Reference ScanDecoder::reference_of(const std::vector<double>& times, Stamp stamp) {
  if (reference_) return *reference_;
  const auto [first, last] = std::minmax_element(times.begin(), times.end());
  const double span = *last - *first;
  if (unit_ == TimeUnit::kAuto) {
    if (!(span > 0)) return Reference::kOtherClock;  // all at once
    unit_ = span < 2     ? TimeUnit::kSeconds
            : span < 2e3 ? TimeUnit::kMilliseconds
            : span < 2e6 ? TimeUnit::kMicroseconds
                         : TimeUnit::kNanoseconds;
  }
  const double time = std::abs(*first * kUnits_ns[static_cast<std::size_t>(unit_)]);
  const double from_stamp = std::abs(time - static_cast<double>(stamp));
  Reference reference = from_stamp < time ? Reference::kSameClock : Reference::kStamp;
  if (std::min(from_stamp, time) > static_cast<double>(kLongestFrame)) {
    reference = Reference::kOtherClock;
  }
  // A frame at time zero says nothing: both readings are the same.
  constexpr double kTells = 2e6;  // ns
  if (std::max(from_stamp, time) > kTells) reference_ = reference;
  return reference;
}

void ScanDecoder::set_times(const std::vector<double>& times, LidarScan& scan) {
  if (times.empty()) {
    scan.end = scan.stamp + 1;
    return;
  }
  const Reference reference = reference_of(times, scan.stamp);
  const double unit = kUnits_ns[static_cast<std::size_t>(unit_)];
  const double first = *std::min_element(times.begin(), times.end());
  // Differences are exact in a double where times of day are not.
  double since_stamp = 0;  // ns
  if (reference == Reference::kStamp) since_stamp = first * unit;
  if (reference == Reference::kSameClock) {
    if (!(std::abs(first * unit) < static_cast<double>(kForever))) {
      throw DecodeError("point times of another clock than before");
    }
    since_stamp = static_cast<double>(std::llround(first * unit) - scan.stamp);
  }
  const auto most = static_cast<double>(kLongestFrame);
  const double last = *std::max_element(times.begin(), times.end());
  if (!(std::abs(since_stamp) <= most) || !((last - first) * unit <= most)) {
    throw DecodeError("point times further than 4 s from the message's");
  }
  const Stamp begin = std::llround(since_stamp);
  const Stamp earlier = std::min<Stamp>(begin, 0);
  scan.stamp += earlier;
  std::uint32_t latest = 1;
  for (std::size_t i = 0; i < times.size(); ++i) {
    const Stamp offset = begin - earlier + std::llround((times[i] - first) * unit);
    scan.points[i].offset_ns = static_cast<std::uint32_t>(std::min(offset, kLongestFrame));
    latest = std::max(latest, scan.points[i].offset_ns);
  }
  scan.end = scan.stamp + latest;
}

}  // namespace arex::sim
