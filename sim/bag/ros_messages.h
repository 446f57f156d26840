#pragma once

#include <string>
#include <string_view>
#include <vector>

/// The ROS 1 message types that a bag of ours holds, as `rosmsg show` and `rosmsg md5` give them
/// (common_msgs 1.13, geometry2 0.7), comments left out. A test compares them with Debian's.
namespace arex::sim {

struct RosMessageType {
  std::string_view name;   ///< package/Type
  std::string_view md5;    ///< of the definition; readers match types by it
  std::string definition;  ///< own text, then that of every type it contains
};

RosMessageType imu_type();
RosMessageType point_cloud_type();
RosMessageType odometry_type();
RosMessageType image_type();
RosMessageType camera_info_type();
RosMessageType tf_type();

}  // namespace arex::sim
