#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

#include "bag/ros_bag.h"
#include "messages/sensors.h"
#include "messages/vehicle.h"

namespace arex::sim {

/// What the vehicle's sensors gave, as a ROS 1 bag on which others can run their own odometry.
///
///     /imu/data            sensor_msgs/Imu          base_link; no orientation (covariance -1)
///     /livox/lidar         sensor_msgs/PointCloud2  livox_frame; one message per LiDAR frame
///     /truth               nav_msgs/Odometry        odom -> base_link, twist in base_link
///     /camera/depth        sensor_msgs/Image        camera_depth_optical_frame, 32FC1, metres
///     /camera/camera_info  sensor_msgs/CameraInfo   of each depth frame, not distorted
///     /tf_static           tf2_msgs/TFMessage       base_link -> livox_frame and -> camera,
///     latched
///
/// odom is O, base_link is B (the IMU), livox_frame is L, camera_depth_optical_frame is C. A point
/// takes 22 bytes without gaps: x y z intensity as float32 at 0 4 8 12, offset_time (since
/// header.stamp, ns) as uint32 at 16, line and tag as uint8 at 20 and 21; x y z are in L at the
/// point's own time. A depth that was not measured is NaN (REP 118).
///
/// Further LiDARs and cameras have topics and frames of their names: /NAME/points in NAME_frame,
/// /NAME/depth and /NAME/camera_info in NAME_optical_frame.
///
/// header.stamp is the device's own stamp plus one second (ROS knows no time zero); messages are
/// recorded at that time too, a scan at its end. Covariances are zero: unknown for the IMU, none
/// for the truth. Errors: see RosBag.
class BagWriter {
 public:
  /// @param vehicle whose calibration goes to /tf_static
  BagWriter(const std::filesystem::path& path, const VehicleConfig& vehicle,
            BagCompression compression = BagCompression::kNone);

  void imu(const ImuSample& sample);
  void scan(const LidarScan& scan);
  /// @param X_OB, v_OB, w_OB_B pose, velocity in O (m/s) and angular rate in B (rad/s) of B in O
  void truth(Stamp stamp, const Pose& X_OB, const Vec3& v_OB, const Vec3& w_OB_B);
  /// @pre image.depth_m has width * height values
  void depth(const DepthImage& image);
  /// Completes FILE. Without it FILE.active remains.
  void close() { bag_.close(); }

 private:
  struct Topic {
    std::uint32_t connection = 0;
    std::uint32_t sequence = 0;  ///< of the next header
  };
  Topic topic(const std::string& name, const RosMessageType& type, bool latched = false);
  /// The topic of a device; made when its first message comes.
  Topic& topic_of(const std::string& device, const char* first, const char* further,
                  const RosMessageType& type);
  /// Starts message_ with a std_msgs/Header.
  void begin(Topic& topic, Stamp stamp, const std::string& frame);
  void camera_info(const DepthImage& image);
  void static_transforms(const VehicleConfig& vehicle);

  RosBag bag_;
  Topic imu_;
  Topic truth_;
  Topic static_transforms_;
  std::map<std::string, Topic> of_devices_;  ///< by the topic's name
  RosBytes message_;                         ///< the one being written
};

}  // namespace arex::sim
