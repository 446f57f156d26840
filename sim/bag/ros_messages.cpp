#include "bag/ros_messages.h"

#include <initializer_list>
#include <sstream>

namespace arex::sim {
namespace {

struct Part {
  std::string_view name;
  std::string_view text;
};

constexpr Part kHeader{"std_msgs/Header", "uint32 seq\ntime stamp\nstring frame_id\n"};
constexpr Part kVector3{"geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"};
constexpr Part kPoint{"geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n"};
constexpr Part kQuaternion{"geometry_msgs/Quaternion",
                           "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"};
constexpr Part kPose{"geometry_msgs/Pose", "Point position\nQuaternion orientation\n"};
constexpr Part kPoseWithCovariance{"geometry_msgs/PoseWithCovariance",
                                   "Pose pose\nfloat64[36] covariance\n"};
constexpr Part kTwist{"geometry_msgs/Twist", "Vector3 linear\nVector3 angular\n"};
constexpr Part kTwistWithCovariance{"geometry_msgs/TwistWithCovariance",
                                    "Twist twist\nfloat64[36] covariance\n"};
constexpr Part kTransform{"geometry_msgs/Transform", "Vector3 translation\nQuaternion rotation\n"};
constexpr Part kTransformStamped{"geometry_msgs/TransformStamped",
                                 "Header header\nstring child_frame_id\nTransform transform\n"};
constexpr Part kPointField{"sensor_msgs/PointField",
                           "uint8 INT8=1\nuint8 UINT8=2\nuint8 INT16=3\nuint8 UINT16=4\n"
                           "uint8 INT32=5\nuint8 UINT32=6\nuint8 FLOAT32=7\nuint8 FLOAT64=8\n"
                           "string name\nuint32 offset\nuint8 datatype\nuint32 count\n"};
constexpr std::string_view kCustomMsg =
    "Header header\nuint64 timebase\nuint32 point_num\nuint8 lidar_id\nuint8[3] rsvd\n"
    "CustomPoint[] points\n";
constexpr std::string_view kCustomPoint =
    "uint32 offset_time\nfloat32 x\nfloat32 y\nfloat32 z\nuint8 reflectivity\nuint8 tag\n"
    "uint8 line\n";
constexpr std::string_view kCustomMsgMd5 = "e4d6829bdfe657cb6c21a746c86b21a6";
constexpr Part kRegionOfInterest{"sensor_msgs/RegionOfInterest",
                                 "uint32 x_offset\nuint32 y_offset\nuint32 height\n"
                                 "uint32 width\nbool do_rectify\n"};

std::string definition(std::string_view own, std::initializer_list<Part> parts) {
  std::string text(own);
  for (const Part& part : parts) {
    text.append(80, '=');
    text += "\nMSG: ";
    text += part.name;
    text += '\n';
    text += part.text;
  }
  return text;
}

/// A line of a definition, as ROS 2 has it.
std::string ros2_line(const std::string& line) {
  if (line == "Header header") return "std_msgs/Header header";
  if (line == "uint32 seq") return "";
  if (line == "float64[] D") return "float64[] d";
  if (line == "float64[9] K") return "float64[9] k";
  if (line == "float64[9] R") return "float64[9] r";
  if (line == "float64[12] P") return "float64[12] p";
  if (line.starts_with("time ")) return "builtin_interfaces/Time " + line.substr(5);
  return line;
}

}  // namespace

std::string ros2_name(const RosMessageType& type) {
  std::string name(type.name);
  return name.insert(name.find('/'), "/msg");
}

std::string ros2_definition(const RosMessageType& type) {
  std::istringstream lines(type.definition);
  std::string text;
  for (std::string line; std::getline(lines, line);) {
    const std::string own = ros2_line(line);
    if (!own.empty()) text += own + "\n";
  }
  return text + std::string(80, '=') +
         "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
}

RosMessageType imu_type() {
  return {"sensor_msgs/Imu", "6a62c6daae103f4ff57a132d6f95cec2",
          definition("Header header\n"
                     "geometry_msgs/Quaternion orientation\n"
                     "float64[9] orientation_covariance\n"
                     "geometry_msgs/Vector3 angular_velocity\n"
                     "float64[9] angular_velocity_covariance\n"
                     "geometry_msgs/Vector3 linear_acceleration\n"
                     "float64[9] linear_acceleration_covariance\n",
                     {kHeader, kQuaternion, kVector3})};
}

RosMessageType point_cloud_type() {
  return {"sensor_msgs/PointCloud2", "1158d486dd51d683ce2f1be655c3c181",
          definition("Header header\nuint32 height\nuint32 width\nPointField[] fields\n"
                     "bool is_bigendian\nuint32 point_step\nuint32 row_step\nuint8[] data\n"
                     "bool is_dense\n",
                     {kHeader, kPointField})};
}

RosMessageType odometry_type() {
  return {"nav_msgs/Odometry", "cd5e73d190d741a2f92e81eda573aca7",
          definition("Header header\nstring child_frame_id\n"
                     "geometry_msgs/PoseWithCovariance pose\n"
                     "geometry_msgs/TwistWithCovariance twist\n",
                     {kHeader, kPoseWithCovariance, kPose, kPoint, kQuaternion,
                      kTwistWithCovariance, kTwist, kVector3})};
}

RosMessageType image_type() {
  return {"sensor_msgs/Image", "060021388200f6f0f447d0fcd9c64743",
          definition("Header header\nuint32 height\nuint32 width\nstring encoding\n"
                     "uint8 is_bigendian\nuint32 step\nuint8[] data\n",
                     {kHeader})};
}

RosMessageType camera_info_type() {
  return {"sensor_msgs/CameraInfo", "c9a58c1b0b154e0e6da7578cb991d214",
          definition("Header header\nuint32 height\nuint32 width\nstring distortion_model\n"
                     "float64[] D\nfloat64[9] K\nfloat64[9] R\nfloat64[12] P\n"
                     "uint32 binning_x\nuint32 binning_y\nRegionOfInterest roi\n",
                     {kHeader, kRegionOfInterest})};
}

RosMessageType tf_type() {
  return {"tf2_msgs/TFMessage", "94810edda583a504dfda3829e70d7eec",
          definition("geometry_msgs/TransformStamped[] transforms\n",
                     {kTransformStamped, kHeader, kTransform, kVector3, kQuaternion})};
}

RosMessageType time_reference_type() {
  return {"sensor_msgs/TimeReference", "fded64a0265108ba86c3d38fb11c0c16",
          definition("Header header\ntime time_ref\nstring source\n", {kHeader})};
}

RosMessageType livox_custom_type() {
  return {"livox_ros_driver/CustomMsg", kCustomMsgMd5,
          definition(kCustomMsg, {kHeader, {"livox_ros_driver/CustomPoint", kCustomPoint}})};
}

RosMessageType livox_custom2_type() {
  return {"livox_ros_driver2/CustomMsg", kCustomMsgMd5,
          definition(kCustomMsg, {kHeader, {"livox_ros_driver2/CustomPoint", kCustomPoint}})};
}

}  // namespace arex::sim
