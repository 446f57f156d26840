#include "bag/bag_writer.h"

#include <algorithm>
#include <array>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace arex::sim {
namespace {

constexpr const char* kScans = "/livox/lidar";
constexpr const char* kFrameEnds = "/livox/frame_end";
constexpr const char* kDepths = "/camera/depth";
constexpr const char* kCameraInfos = "/camera/camera_info";

std::string lidar_frame(const std::string& device) {
  return device.empty() ? "livox_frame" : device + "_frame";
}
std::string camera_frame(const std::string& device) {
  return device.empty() ? "camera_depth_optical_frame" : device + "_optical_frame";
}

std::string infrared_frame(int number) {
  return "camera_infra" + std::to_string(number) + "_optical_frame";
}

/// sensor_msgs/PointField's datatypes.
enum class FieldType : std::uint8_t { kUint8 = 2, kUint32 = 6, kFloat32 = 7, kFloat64 = 8 };

struct PointFieldRow {
  std::string_view name;
  std::uint32_t offset;
  FieldType type;
};
constexpr std::array<PointFieldRow, 7> kGenericFields{{{"x", 0, FieldType::kFloat32},
                                                       {"y", 4, FieldType::kFloat32},
                                                       {"z", 8, FieldType::kFloat32},
                                                       {"intensity", 12, FieldType::kFloat32},
                                                       {"t", 16, FieldType::kUint32},
                                                       {"ring", 20, FieldType::kUint8},
                                                       {"tag", 21, FieldType::kUint8}}};
constexpr std::uint32_t kGenericStep = 22;
constexpr std::array<PointFieldRow, 7> kDriver2Fields{{{"x", 0, FieldType::kFloat32},
                                                       {"y", 4, FieldType::kFloat32},
                                                       {"z", 8, FieldType::kFloat32},
                                                       {"intensity", 12, FieldType::kFloat32},
                                                       {"tag", 16, FieldType::kUint8},
                                                       {"line", 17, FieldType::kUint8},
                                                       {"timestamp", 18, FieldType::kFloat64}}};
constexpr std::uint32_t kDriver2Step = 26;

constexpr double kTeslaPerGauss = 1e-4;

/// The scan with its firings that returned nothing: at the origin, as the driver writes them.
std::vector<LidarPoint> every_firing(const LidarScan& scan) {
  if (scan.packets_ns.empty()) return scan.points;
  std::vector<LidarPoint> all(static_cast<std::size_t>(scan.firings()));
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto firing = static_cast<std::int64_t>(i);
    all[i].offset_ns = scan.firing_ns(firing);
    all[i].line = static_cast<std::uint8_t>(firing % LidarScan::kLines);
  }
  for (const LidarPoint& point : scan.points) all[point.firing] = point;
  return all;
}

/// A 3x3 (9 values) or 6x6 (36 values) covariance of zeros but for its first value.
template <std::size_t size>
std::array<double, size> covariance(double first = 0) {
  return {first};
}

}  // namespace

BagWriter::BagWriter(const std::filesystem::path& path, const VehicleConfig& vehicle,
                     const BagOptions& options)
    : stream_(path, options.compression),
      message_(stream_.message()),
      options_(options),
      imu_(stream_.topic("/imu/data", imu_type())),
      livox_imu_(stream_.topic("/livox/imu", imu_type())),
      field_(stream_.topic("/imu/mag", magnetic_field_type())),
      truth_(stream_.topic("/truth", odometry_type())),
      transforms_(stream_.topic("/tf", tf_type())),
      static_transforms_(stream_.topic("/tf_static", tf_type(), true)),
      display_(stream_) {
  // Those of the first devices come first, in this order.
  topic_of("", kScans, "", scan_type());
  topic_of("", kFrameEnds, "", time_reference_type());
  topic_of("", kDepths, "", image_type());
  topic_of("", kCameraInfos, "", camera_info_type());
  static_transforms(vehicle);
}

RosMessageType BagWriter::scan_type() const {
  switch (options_.layout) {
    case BagLayout::kLivoxCustom:
      return livox_custom_type();
    case BagLayout::kLivoxCustom2:
      return livox_custom2_type();
    default:
      return point_cloud_type();
  }
}

MessageStream::Topic& BagWriter::topic_of(const std::string& device, const char* first,
                                          const char* further, const RosMessageType& type) {
  const std::string name = device.empty() ? first : "/" + device + further;
  const auto known = of_devices_.find(name);
  return known != of_devices_.end()
             ? known->second
             : of_devices_.emplace(name, stream_.topic(name, type)).first->second;
}

void BagWriter::imu_on(Topic& topic, const ImuSample& sample) {
  stream_.begin_message(topic, sample.stamp, kBodyFrame);
  message_.put(Quat::Identity());
  stream_.put_numbers(covariance<9>(-1));  // sensor_msgs/Imu: -1 where there is no estimate
  message_.put(sample.gyro_radps);
  stream_.put_numbers(covariance<9>());
  message_.put(sample.accel_mps2);
  stream_.put_numbers(covariance<9>());
  stream_.write(topic);
}

void BagWriter::imu(const ImuSample& sample) {
  if (sample.stamp < 0) return;  // its clock lags, and the run has just begun
  // First, so that who reads a sample of the IMU has its field already.
  stream_.begin_message(field_, sample.stamp, kBodyFrame);
  message_.put(kTeslaPerGauss * sample.field_gauss);
  stream_.put_numbers(covariance<9>());
  stream_.write(field_);
  imu_on(imu_, sample);
  imu_on(livox_imu_, sample);
}

void BagWriter::put_point(const LidarPoint& point, Stamp frame_begin) {
  message_.put_raw(point.p_L.data(), 3 * sizeof(float));
  message_.put_packed(point.intensity);
  if (options_.layout == BagLayout::kLivoxDriver2) {
    message_.put_packed(point.tag);
    message_.put_packed(point.line);
    message_.put_packed(static_cast<double>(frame_begin + point.offset_ns));
  } else {
    message_.put_packed(point.offset_ns);
    message_.put_packed(point.line);
    message_.put_packed(point.tag);
  }
}

void BagWriter::frame_end(const LidarScan& scan) {
  Topic& topic = topic_of(scan.device, kFrameEnds, "/frame_end", time_reference_type());
  stream_.begin_message(topic, scan.stamp, lidar_frame(scan.device));
  message_.put(ros_time(scan.end));
  message_.put("frame_end");
  stream_.write(topic);
}

void BagWriter::scan(const LidarScan& scan) {
  frame_end(scan);
  const std::vector<LidarPoint> every =
      options_.lidar_misses ? every_firing(scan) : std::vector<LidarPoint>{};
  const std::vector<LidarPoint>& points = options_.lidar_misses ? every : scan.points;
  Topic& topic = topic_of(scan.device, kScans, "/points", scan_type());
  stream_.begin_message(topic, scan.stamp, lidar_frame(scan.device));
  const bool is_custom =
      options_.layout == BagLayout::kLivoxCustom || options_.layout == BagLayout::kLivoxCustom2;
  if (is_custom) {
    custom(scan, points);
  } else {
    cloud(scan, points);
  }
  stream_.write(topic);
}

void BagWriter::cloud(const LidarScan& scan, const std::vector<LidarPoint>& points) {
  const bool driver2 = options_.layout == BagLayout::kLivoxDriver2;
  const auto& fields = driver2 ? kDriver2Fields : kGenericFields;
  const std::uint32_t step = driver2 ? kDriver2Step : kGenericStep;
  const auto count = static_cast<std::uint32_t>(points.size());
  message_.put(std::uint32_t{1});  // height: an unordered cloud
  message_.put(count);
  message_.put_length(fields.size());
  for (const PointFieldRow& field : fields) {
    message_.put(field.name);
    message_.put(field.offset);
    message_.put(static_cast<std::uint8_t>(field.type));
    message_.put(std::uint32_t{1});
  }
  message_.put(false);  // is_bigendian
  message_.put(step);
  message_.put(step * count);
  message_.put_length(step * points.size());
  message_.reserve(message_.size() + step * points.size() + 1);
  for (const LidarPoint& point : points) put_point(point, scan.stamp);
  message_.put(true);  // is_dense
}

void BagWriter::custom(const LidarScan& scan, const std::vector<LidarPoint>& points) {
  message_.put(static_cast<std::uint64_t>(scan.stamp));  // timebase
  message_.put(static_cast<std::uint32_t>(points.size()));
  for (int i = 0; i < 4; ++i) message_.put(std::uint8_t{0});  // LiDAR's number, reserved
  message_.put_length(points.size());
  for (const LidarPoint& point : points) {
    message_.put(point.offset_ns);
    message_.put_raw(point.p_L.data(), 3 * sizeof(float));
    message_.put(static_cast<std::uint8_t>(std::clamp(point.intensity, 0.0F, 255.0F)));
    message_.put(point.tag);
    message_.put(point.line);
  }
}

void BagWriter::place_odom(const Pose& X_WO, bool has_begun) {
  X_WO_ = X_WO;
  odom_begun_ = has_begun;
}

void BagWriter::truth(Stamp stamp, const Pose& X_WB, const Vec3& v_WB, const Vec3& w_WB_B) {
  waiting_.push_back({stamp, X_WB, v_WB, w_WB_B});
  if (odom_begun_) write_truth();
}

void BagWriter::write_truth() {
  const Pose X_OW = X_WO_.inverse();
  for (const TrueMotion& motion : std::exchange(waiting_, {})) {
    const Pose X_OB = X_OW * motion.X_WB;
    stream_.begin_message(truth_, motion.stamp, kOdomFrame);
    message_.put(kBodyFrame);
    message_.put(X_OB.p);
    message_.put(X_OB.quaternion());
    stream_.put_numbers(covariance<36>());
    message_.put(Vec3(motion.X_WB.R.transpose() * motion.v_WB));
    message_.put(motion.w_WB_B);
    stream_.put_numbers(covariance<36>());
    stream_.write(truth_, motion.stamp);
  }
}

void BagWriter::close() {
  write_truth();  // of an odometry that never began
  stream_.close();
}

void BagWriter::estimate(Stamp stamp, const Pose& X_OB) {
  message_.clear();
  message_.put_length(1);
  put_transform(transforms_, stamp, kOdomFrame, kBodyFrame, X_OB);
  stream_.write(transforms_);
}

void BagWriter::put_transform(Topic& topic, Stamp stamp, const std::string& parent,
                              const std::string& child, const Pose& X) {
  stream_.put_header(topic, stamp, parent);
  message_.put(child);
  message_.put(X.p);
  message_.put(X.quaternion());
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
  stream_.begin_message(topic, image.stamp, camera_frame(image.device));
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
  stream_.write(topic);
}

void BagWriter::camera_info(const DepthImage& image) {
  Topic& topic = topic_of(image.device, kCameraInfos, "/camera_info", camera_info_type());
  stream_.begin_message(topic, image.stamp, camera_frame(image.device));
  put_calibration(image.camera, 0);
  stream_.write(topic);
}

void BagWriter::put_calibration(const PinholeCamera& c, double baseline_m) {
  message_.put(static_cast<std::uint32_t>(c.height));
  message_.put(static_cast<std::uint32_t>(c.width));
  message_.put("plumb_bob");
  message_.put_length(5);
  stream_.put_numbers(std::array<double, 5>{});
  stream_.put_numbers(std::array{c.fx, 0.0, c.cx, 0.0, c.fy, c.cy, 0.0, 0.0, 1.0});
  stream_.put_numbers(std::array{1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0});
  const double shift = baseline_m > 0 ? -c.fx * baseline_m : 0.0;
  stream_.put_numbers(std::array{c.fx, 0.0, c.cx, shift, 0.0, c.fy, c.cy, 0.0, 0.0, 0.0, 1.0, 0.0});
  for (int i = 0; i < 2; ++i) message_.put(std::uint32_t{0});  // binning: none
  for (int i = 0; i < 4; ++i) message_.put(std::uint32_t{0});  // region of interest: all
  message_.put(false);
}

void BagWriter::infrared(const StereoImage& image) {
  if (image.time_ns < 0) return;  // its clock lags, and the run has just begun
  eye(image, 1, image.left);
  if (!image.right.empty()) eye(image, 2, image.right);
}

void BagWriter::eye(const StereoImage& image, int number, const std::vector<std::uint8_t>& grey) {
  if (grey.size() !=
      static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height)) {
    throw std::invalid_argument("an infrared image of " + std::to_string(image.width) + " x " +
                                std::to_string(image.height) + " pixels has " +
                                std::to_string(grey.size()) + " values");
  }
  const std::string name = "/camera/infra" + std::to_string(number);
  const std::string frame = infrared_frame(number);
  const StereoCamera& camera = image.camera;
  Topic& info = topic_of("", (name + "/camera_info").c_str(), "", camera_info_type());
  stream_.begin_message(info, image.time_ns, frame);
  put_calibration({image.width, image.height, camera.f_px, camera.f_px, camera.cx, camera.cy},
                  number == 2 ? camera.baseline_m : 0);
  stream_.write(info);
  Topic& topic = topic_of("", (name + "/image_rect_raw").c_str(), "", image_type());
  stream_.begin_message(topic, image.time_ns, frame);
  message_.put(static_cast<std::uint32_t>(image.height));
  message_.put(static_cast<std::uint32_t>(image.width));
  message_.put("mono8");
  message_.put(std::uint8_t{0});  // is_bigendian
  message_.put(static_cast<std::uint32_t>(image.width));
  message_.put_length(grey.size());
  message_.put_raw(grey.data(), grey.size());
  stream_.write(topic);
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
  if (options_.infrared) {
    const Pose X_CR{Mat3::Identity(), Vec3(options_.infrared_baseline_m, 0, 0)};
    mounts.push_back({infrared_frame(1), vehicle.X_BC()});
    mounts.push_back({infrared_frame(2), vehicle.X_BC() * X_CR});
  }
  message_.clear();
  message_.put_length(mounts.size());
  for (const Mount& mount : mounts) {
    put_transform(static_transforms_, 0, kBodyFrame, mount.frame, mount.X_B);
  }
  stream_.write(static_transforms_);
}

}  // namespace arex::sim
