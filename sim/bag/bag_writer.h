#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "bag/display_writer.h"
#include "bag/message_stream.h"
#include "messages/sensors.h"
#include "messages/stereo_image.h"
#include "messages/vehicle.h"

namespace arex::sim {

/// How the points of a LiDAR's frame are laid out: as the drivers of others do, whose readers then
/// take them unchanged.
enum class BagLayout : std::uint8_t {
  kGeneric,       ///< PointCloud2, 22 bytes: t (uint32, ns since the stamp), ring, tag
  kLivoxDriver2,  ///< livox_ros_driver2's PointCloud2, 26 bytes: tag, line, timestamp (float64, ns)
  kLivoxCustom,   ///< livox_ros_driver's CustomMsg
  kLivoxCustom2,  ///< livox_ros_driver2's CustomMsg
};
/// What people write for them: `--bag-layout`.
inline constexpr std::array<std::string_view, 4> kBagLayoutNames{"generic", "livox_driver2",
                                                                 "livox_custom", "livox_custom2"};

struct BagOptions {
  BagLayout layout = BagLayout::kGeneric;
  BagCompression compression = BagCompression::kNone;
  bool lidar_misses = false;  ///< firings without a return are written, too
  bool infrared = false;      ///< there will be infrared images: their frames go to /tf_static
  double infrared_baseline_m = 0.05;  ///< of the right eye's frame
};

/// What the vehicle's sensors gave, as a recording on which others can run their own odometry: a
/// ROS 1 bag, or as FILE.mcap MCAP with the same messages of ROS 2.
///
///     /imu/data            sensor_msgs/Imu          base_link; no orientation (covariance -1)
///     /livox/imu           the same under the name that Livox's driver has
///     /imu/mag             sensor_msgs/MagneticField base_link, tesla; with every /imu/data
///     /livox/lidar         see BagLayout            livox_frame; one message per LiDAR frame
///     /livox/frame_end     sensor_msgs/TimeReference when the frame was closed
///     /truth               nav_msgs/Odometry        odom -> base_link, twist in base_link
///     /camera/depth        sensor_msgs/Image        camera_depth_optical_frame, 32FC1, metres
///     /camera/camera_info  sensor_msgs/CameraInfo   of each depth frame, not distorted
///     /tf                  tf2_msgs/TFMessage       odom -> base_link as the vehicle estimates it
///     /tf_static           tf2_msgs/TFMessage       base_link -> livox_frame and -> camera,
///     latched
///
/// With infrared images, under the names that a D435i's driver has:
///
///     /camera/infra1/image_rect_raw  sensor_msgs/Image  camera_infra1_optical_frame, mono8, left
///     /camera/infra2/image_rect_raw  the same of the right eye, where it was read
///     /camera/infra1|2/camera_info   sensor_msgs/CameraInfo  of each; the right one's P[3] is -f B
///
/// odom is O, base_link is B (the IMU), livox_frame is L, camera_depth_optical_frame is C. Points
/// are in L, each at its own time. They stand in firing order, their times run backwards where the
/// device's packets were stamped so. Firings without a return are left out, or, if asked for, have
/// their line, their time and zeros, as the driver writes them. A depth that was not measured is
/// NaN (REP 118).
///
/// What the flight software makes of it stands beside: DisplayWriter.
///
/// Further LiDARs and cameras have topics and frames of their names: /NAME/points in NAME_frame,
/// /NAME/depth and /NAME/camera_info in NAME_optical_frame.
///
/// header.stamp is the device's own stamp, zero as one nanosecond (ROS knows no time zero); what a
/// device stamps before zero is left out. Messages are recorded when they arrive, the truth when it
/// is so. A frame's end is not the time of its last point: the device closes it by its own clock,
/// and the vehicle's odometry corrects at that moment. So that a replay does, too, it is written in
/// time_ref of a message with the frame's stamp before each frame, its source `frame_end`.
/// Covariances are zero: unknown for the IMU, none for the truth. Errors: see MessageFile.
class BagWriter {
 public:
  /// @param vehicle whose calibration goes to /tf_static
  BagWriter(const std::filesystem::path& path, const VehicleConfig& vehicle,
            const BagOptions& options = {});

  /// Sets the clock: what is written from here on arrives at `now`.
  void begin(Stamp now) { stream_.begin(now); }
  /// To /imu/data, /livox/imu and /imu/mag.
  void imu(const ImuSample& sample);
  void scan(const LidarScan& scan);
  /// Where O lies in W. The odometry decides that when it begins: until it has, truth waits, so
  /// that all of it is in one frame.
  void place_odom(const Pose& X_WO, bool has_begun);
  /// @param X_WB, v_WB, w_WB_B pose, velocity in W (m/s) and angular rate in B (rad/s) of B in W
  void truth(Stamp stamp, const Pose& X_WB, const Vec3& v_WB, const Vec3& w_WB_B);
  /// To /tf.
  void estimate(Stamp stamp, const Pose& X_OB);
  /// @pre image.depth_m has width * height values
  void depth(const DepthImage& image);
  /// @pre its images have width * height values
  void infrared(const StereoImage& image);
  /// What the flight software makes of it, for viewers.
  [[nodiscard]] DisplayWriter& display() { return display_; }
  /// Completes FILE. Without it FILE.active remains.
  void close();

 private:
  using Topic = MessageStream::Topic;

  /// The topic of a device; made when its first message comes.
  Topic& topic_of(const std::string& device, const char* first, const char* further,
                  const RosMessageType& type);
  struct TrueMotion {
    Stamp stamp = 0;
    Pose X_WB;
    Vec3 v_WB, w_WB_B;
  };
  /// Writes what waits for O.
  void write_truth();
  void imu_on(Topic& topic, const ImuSample& sample);
  void frame_end(const LidarScan& scan);
  void cloud(const LidarScan& scan, const std::vector<LidarPoint>& points);
  void custom(const LidarScan& scan, const std::vector<LidarPoint>& points);
  void put_point(const LidarPoint& point, Stamp frame_begin);
  void put_transform(Topic& topic, Stamp stamp, const std::string& parent, const std::string& child,
                     const Pose& X);
  [[nodiscard]] RosMessageType scan_type() const;
  void camera_info(const DepthImage& image);
  void eye(const StereoImage& image, int number, const std::vector<std::uint8_t>& grey);
  /// The rest of a sensor_msgs/CameraInfo behind its header. @param baseline_m to the left eye
  void put_calibration(const PinholeCamera& camera, double baseline_m);
  void static_transforms(const VehicleConfig& vehicle);

  MessageStream stream_;
  RosBytes& message_;  ///< of the stream
  BagOptions options_;
  Topic imu_;
  Topic livox_imu_;
  Topic field_;
  Topic truth_;
  Topic transforms_;
  Topic static_transforms_;
  std::map<std::string, Topic> of_devices_;  ///< by the topic's name
  Pose X_WO_;
  bool odom_begun_ = false;
  std::vector<TrueMotion> waiting_;  ///< for O
  DisplayWriter display_;
};

}  // namespace arex::sim
