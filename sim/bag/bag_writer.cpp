#include "bag/bag_writer.h"

#include <array>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace arex::sim {
namespace {

constexpr const char* kOdomFrame = "odom";
constexpr const char* kBodyFrame = "base_link";
constexpr const char* kScans = "/livox/lidar";
constexpr const char* kDepths = "/camera/depth";
constexpr const char* kCameraInfos = "/camera/camera_info";

std::string lidar_frame(const std::string& device) {
  return device.empty() ? "livox_frame" : device + "_frame";
}
std::string camera_frame(const std::string& device) {
  return device.empty() ? "camera_depth_optical_frame" : device + "_optical_frame";
}

/// sensor_msgs/PointField's datatypes.
enum class FieldType : std::uint8_t { kUint8 = 2, kUint32 = 6, kFloat32 = 7 };

struct PointFieldRow {
  std::string_view name;
  std::uint32_t offset;
  FieldType type;
};
constexpr std::array<PointFieldRow, 7> kPointFields{{{"x", 0, FieldType::kFloat32},
                                                     {"y", 4, FieldType::kFloat32},
                                                     {"z", 8, FieldType::kFloat32},
                                                     {"intensity", 12, FieldType::kFloat32},
                                                     {"offset_time", 16, FieldType::kUint32},
                                                     {"line", 20, FieldType::kUint8},
                                                     {"tag", 21, FieldType::kUint8}}};
constexpr std::uint32_t kPointStep = 22;

void put_numbers(RosBytes& out, std::span<const double> values) {
  out.put_raw(values.data(), values.size_bytes());
}

/// A 3x3 (9 values) or 6x6 (36 values) covariance of zeros but for its first value.
template <std::size_t size>
void put_covariance(RosBytes& out, double first = 0) {
  put_numbers(out, std::array<double, size>{first});
}

}  // namespace

BagWriter::BagWriter(const std::filesystem::path& path, const VehicleConfig& vehicle,
                     BagCompression compression)
    : bag_(path, compression),
      imu_(topic("/imu/data", imu_type())),
      truth_(topic("/truth", odometry_type())),
      static_transforms_(topic("/tf_static", tf_type(), true)) {
  // Every bag has them, in this order.
  topic_of("", kScans, "", point_cloud_type());
  topic_of("", kDepths, "", image_type());
  topic_of("", kCameraInfos, "", camera_info_type());
  static_transforms(vehicle);
}

BagWriter::Topic& BagWriter::topic_of(const std::string& device, const char* first,
                                      const char* further, const RosMessageType& type) {
  const std::string name = device.empty() ? first : "/" + device + further;
  const auto known = of_devices_.find(name);
  return known != of_devices_.end() ? known->second
                                    : of_devices_.emplace(name, topic(name, type)).first->second;
}

BagWriter::Topic BagWriter::topic(const std::string& name, const RosMessageType& type,
                                  bool latched) {
  return {bag_.add_topic(name, type, latched), 0};
}

void BagWriter::begin(Topic& topic, Stamp stamp, const std::string& frame) {
  message_.clear();
  message_.put(topic.sequence++);
  message_.put(ros_time(stamp));
  message_.put(frame);
}

void BagWriter::imu(const ImuSample& sample) {
  begin(imu_, sample.stamp, kBodyFrame);
  message_.put(Quat::Identity());
  put_covariance<9>(message_, -1);  // sensor_msgs/Imu: -1 where there is no estimate
  message_.put(sample.gyro_radps);
  put_covariance<9>(message_);
  message_.put(sample.accel_mps2);
  put_covariance<9>(message_);
  bag_.write(imu_.connection, ros_time(sample.stamp), message_);
}

void BagWriter::scan(const LidarScan& scan) {
  Topic& topic = topic_of(scan.device, kScans, "/points", point_cloud_type());
  begin(topic, scan.stamp, lidar_frame(scan.device));
  const auto count = static_cast<std::uint32_t>(scan.points.size());
  message_.put(std::uint32_t{1});  // height: an unordered cloud
  message_.put(count);
  message_.put_length(kPointFields.size());
  for (const PointFieldRow& field : kPointFields) {
    message_.put(field.name);
    message_.put(field.offset);
    message_.put(static_cast<std::uint8_t>(field.type));
    message_.put(std::uint32_t{1});
  }
  message_.put(false);  // is_bigendian
  message_.put(kPointStep);
  message_.put(kPointStep * count);
  message_.put_length(kPointStep * scan.points.size());
  message_.reserve(message_.size() + kPointStep * scan.points.size() + 1);
  for (const LidarPoint& point : scan.points) {
    message_.put_raw(point.p_L.data(), 3 * sizeof(float));
    message_.put(point.intensity);
    message_.put(point.offset_ns);
    message_.put(point.line);
    message_.put(point.tag);
  }
  message_.put(true);  // is_dense
  bag_.write(topic.connection, ros_time(scan.end), message_);
}

void BagWriter::truth(Stamp stamp, const Pose& X_OB, const Vec3& v_OB, const Vec3& w_OB_B) {
  begin(truth_, stamp, kOdomFrame);
  message_.put(kBodyFrame);
  message_.put(X_OB.p);
  message_.put(X_OB.quaternion());
  put_covariance<36>(message_);
  const Vec3 v_OB_B = X_OB.R.transpose() * v_OB;
  message_.put(v_OB_B);
  message_.put(w_OB_B);
  put_covariance<36>(message_);
  bag_.write(truth_.connection, ros_time(stamp), message_);
}

void BagWriter::depth(const DepthImage& image) {
  const auto width = static_cast<std::uint32_t>(image.camera.width);
  const auto height = static_cast<std::uint32_t>(image.camera.height);
  if (image.depth_m.size() != std::size_t{width} * height) {
    throw std::invalid_argument("a depth image of " + std::to_string(width) + " x " +
                                std::to_string(height) + " pixels has " +
                                std::to_string(image.depth_m.size()) + " values");
  }
  camera_info(image);
  Topic& topic = topic_of(image.device, kDepths, "/depth", image_type());
  begin(topic, image.stamp, camera_frame(image.device));
  message_.put(height);
  message_.put(width);
  message_.put("32FC1");
  message_.put(std::uint8_t{0});  // is_bigendian
  message_.put_length(width * sizeof(float));
  message_.put_length(image.depth_m.size() * sizeof(float));
  message_.reserve(message_.size() + image.depth_m.size() * sizeof(float));
  for (const float z : image.depth_m) {
    message_.put(z > 0 ? z : std::numeric_limits<float>::quiet_NaN());
  }
  bag_.write(topic.connection, ros_time(image.stamp), message_);
}

void BagWriter::camera_info(const DepthImage& image) {
  const PinholeCamera& c = image.camera;
  Topic& topic = topic_of(image.device, kCameraInfos, "/camera_info", camera_info_type());
  begin(topic, image.stamp, camera_frame(image.device));
  message_.put(static_cast<std::uint32_t>(c.height));
  message_.put(static_cast<std::uint32_t>(c.width));
  message_.put("plumb_bob");
  message_.put_length(5);
  put_numbers(message_, std::array<double, 5>{});
  put_numbers(message_, std::array{c.fx, 0.0, c.cx, 0.0, c.fy, c.cy, 0.0, 0.0, 1.0});
  put_numbers(message_, std::array{1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0});
  put_numbers(message_, std::array{c.fx, 0.0, c.cx, 0.0, 0.0, c.fy, c.cy, 0.0, 0.0, 0.0, 1.0, 0.0});
  for (int i = 0; i < 2; ++i) message_.put(std::uint32_t{0});  // binning: none
  for (int i = 0; i < 4; ++i) message_.put(std::uint32_t{0});  // region of interest: all
  message_.put(false);
  bag_.write(topic.connection, ros_time(image.stamp), message_);
}

void BagWriter::static_transforms(const VehicleConfig& vehicle) {
  struct Mount {
    std::string frame;
    Pose X_B;  // the device in B
  };
  std::vector<Mount> mounts{{lidar_frame(""), vehicle.X_BL()}, {camera_frame(""), vehicle.X_BC()}};
  for (const auto& [name, mount] : vehicle.mounts) {
    mounts.push_back({lidar_frame(name), mount.X_BL()});
    mounts.push_back({camera_frame(name), mount.X_BC()});
  }
  RosBytes transforms;
  transforms.put_length(mounts.size());
  for (const Mount& mount : mounts) {
    begin(static_transforms_, 0, kBodyFrame);
    message_.put(mount.frame);
    message_.put(mount.X_B.p);
    message_.put(mount.X_B.quaternion());
    transforms.put_raw(message_.view().data(), message_.size());
  }
  bag_.write(static_transforms_.connection, ros_time(0), transforms);
}

}  // namespace arex::sim
