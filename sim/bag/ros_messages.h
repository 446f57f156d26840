#pragma once

#include <string>
#include <string_view>
#include <vector>

/// The ROS 1 message types that a bag of ours holds, as `rosmsg show` and `rosmsg md5` give them
/// (common_msgs 1.13, geometry2 0.7, rosgraph_msgs 1.11), comments left out. A test compares them
/// with Debian's, but for those of Livox's drivers (livox_ros_driver 2.6, livox_ros_driver2 1.2),
/// which Debian has not.
namespace arex::sim {

struct RosMessageType {
  std::string_view name;   ///< package/Type
  std::string_view md5;    ///< of the definition; readers match types by it
  std::string definition;  ///< own text, then that of every type it contains
  // Where ROS 2 has it under another name, or with other fields than follow from the above.
  std::string_view ros2_name{};
  std::string ros2_definition{};
};

/// The type's name in ROS 2: package/msg/Type.
std::string ros2_name(const RosMessageType& type);
/// The same definition as ROS 2 has it (Humble: common_interfaces 4, geometry2 0.25): another
/// header, other times, and names of fields in lower case.
std::string ros2_definition(const RosMessageType& type);

RosMessageType imu_type();
RosMessageType magnetic_field_type();
RosMessageType point_cloud_type();
RosMessageType odometry_type();
RosMessageType image_type();
RosMessageType camera_info_type();
RosMessageType tf_type();
RosMessageType time_reference_type();
RosMessageType path_type();
RosMessageType occupancy_grid_type();
RosMessageType marker_array_type();
RosMessageType log_type();  ///< rosgraph_msgs/Log, in ROS 2 rcl_interfaces/msg/Log without a header
RosMessageType livox_custom_type();   ///< livox_ros_driver's CustomMsg
RosMessageType livox_custom2_type();  ///< livox_ros_driver2's, which differs by name only

}  // namespace arex::sim
