#include "bag/ros_messages.h"

#include <array>
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
constexpr Part kPoseStamped{"geometry_msgs/PoseStamped", "Header header\nPose pose\n"};
constexpr Part kMapMetaData{"nav_msgs/MapMetaData",
                            "time map_load_time\nfloat32 resolution\nuint32 width\n"
                            "uint32 height\ngeometry_msgs/Pose origin\n"};
constexpr Part kColour{"std_msgs/ColorRGBA", "float32 r\nfloat32 g\nfloat32 b\nfloat32 a\n"};
constexpr Part kCompressedImage{"sensor_msgs/CompressedImage",
                                "Header header\nstring format\nuint8[] data\n"};
constexpr Part kUvCoordinate{"visualization_msgs/UVCoordinate", "float32 u\nfloat32 v\n"};
constexpr Part kMeshFile{"visualization_msgs/MeshFile", "string filename\nuint8[] data\n"};
constexpr Part kDuration{"builtin_interfaces/Duration", "int32 sec\nuint32 nanosec\n"};
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

/// visualization_msgs/Marker: ROS 2 has numbered its shapes with more bits, and put textures and
/// meshes in.
std::string marker_definition(bool ros2) {
  constexpr std::array<std::string_view, 16> kConstants{
      "ARROW=0",          "CUBE=1",           "SPHERE=2",      "CYLINDER=3", "LINE_STRIP=4",
      "LINE_LIST=5",      "CUBE_LIST=6",      "SPHERE_LIST=7", "POINTS=8",   "TEXT_VIEW_FACING=9",
      "MESH_RESOURCE=10", "TRIANGLE_LIST=11", "ADD=0",         "MODIFY=0",   "DELETE=2",
      "DELETEALL=3"};
  std::string text;
  for (const std::string_view constant : kConstants) {
    text += ros2 ? "int32 " : "uint8 ";
    text += constant;
    text += '\n';
  }
  text +=
      "Header header\nstring ns\nint32 id\nint32 type\nint32 action\n"
      "geometry_msgs/Pose pose\ngeometry_msgs/Vector3 scale\nstd_msgs/ColorRGBA color\n"
      "duration lifetime\nbool frame_locked\ngeometry_msgs/Point[] points\n"
      "std_msgs/ColorRGBA[] colors\n";
  if (ros2) {
    text +=
        "string texture_resource\nsensor_msgs/CompressedImage texture\n"
        "UVCoordinate[] uv_coordinates\n";
  }
  text += "string text\nstring mesh_resource\n";
  if (ros2) text += "MeshFile mesh_file\n";
  return text + "bool mesh_use_embedded_materials\n";
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
  if (line.starts_with("duration ")) return "builtin_interfaces/Duration " + line.substr(9);
  return line;
}

}  // namespace

std::string ros2_name(const RosMessageType& type) {
  std::string name(type.ros2_name.empty() ? type.name : type.ros2_name);
  return name.insert(name.find('/'), "/msg");
}

std::string ros2_definition(const RosMessageType& type) {
  std::istringstream lines(type.ros2_definition.empty() ? type.definition : type.ros2_definition);
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

RosMessageType magnetic_field_type() {
  return {"sensor_msgs/MagneticField", "2f3b0b43eed0c9501de0fa3ff89a45aa",
          definition("Header header\ngeometry_msgs/Vector3 magnetic_field\n"
                     "float64[9] magnetic_field_covariance\n",
                     {kHeader, kVector3})};
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

RosMessageType path_type() {
  return {"nav_msgs/Path", "6227e2b7e9cce15051f669a5e197bbf7",
          definition("Header header\ngeometry_msgs/PoseStamped[] poses\n",
                     {kHeader, kPoseStamped, kPose, kPoint, kQuaternion})};
}

RosMessageType occupancy_grid_type() {
  return {"nav_msgs/OccupancyGrid", "3381f2d731d4076ec5c71b0759edbe4e",
          definition("Header header\nMapMetaData info\nint8[] data\n",
                     {kHeader, kMapMetaData, kPose, kPoint, kQuaternion})};
}

RosMessageType marker_array_type() {
  constexpr std::string_view kOwn = "Marker[] markers\n";
  const std::string ros1 = marker_definition(false), ros2 = marker_definition(true);
  return {"visualization_msgs/MarkerArray",
          "d155b9ce5188fbaf89745847fd5882d7",
          definition(kOwn, {{"visualization_msgs/Marker", ros1},
                            kHeader,
                            kPose,
                            kPoint,
                            kQuaternion,
                            kVector3,
                            kColour}),
          {},
          definition(kOwn, {{"visualization_msgs/Marker", ros2},
                            kHeader,
                            kPose,
                            kPoint,
                            kQuaternion,
                            kVector3,
                            kColour,
                            kDuration,
                            kCompressedImage,
                            kUvCoordinate,
                            kMeshFile})};
}

RosMessageType log_type() {
  return {"rosgraph_msgs/Log", "acffd30cd6b6de30f120938c17c593fb",
          definition("byte DEBUG=1\nbyte INFO=2\nbyte WARN=4\nbyte ERROR=8\nbyte FATAL=16\n"
                     "Header header\nbyte level\nstring name\nstring msg\nstring file\n"
                     "string function\nuint32 line\nstring[] topics\n",
                     {kHeader}),
          "rcl_interfaces/Log",
          "byte DEBUG=10\nbyte INFO=20\nbyte WARN=30\nbyte ERROR=40\nbyte FATAL=50\n"
          "time stamp\nuint8 level\nstring name\nstring msg\nstring file\nstring function\n"
          "uint32 line\n"};
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
