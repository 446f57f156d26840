#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "bag/message_stream.h"
#include "exploration/explorer.h"
#include "mapping/grid_view.h"
#include "mapping/occupancy_map_2d.h"
#include "math/pose.h"
#include "messages/events.h"

namespace arex::sim {

struct Colour {
  float r = 1, g = 1, b = 1, a = 1;
};

/// One of a visualization_msgs/MarkerArray.
struct Marker {
  /// Their numbers in the message.
  enum class Shape : std::int32_t {
    kBox = 1,
    kSphere = 2,
    kCylinder = 3,
    kLineStrip = 4,
    kText = 9,
  };
  std::string space;  ///< with the number its name: the next of that name replaces it
  std::int32_t number = 0;
  Shape shape = Shape::kSphere;
  Pose X;                      ///< in the frame of the array
  Vec3 size_m = Vec3::Ones();  ///< text: its height is z; a line: its width is x
  Colour colour;
  std::vector<Vec3> points{};  ///< of a line
  std::string text{};
};

struct PathPose {
  Stamp stamp = 0;
  Pose X_OB;
};

/// What the flight software makes of what it senses, for people to look at in Foxglove or RViz. All
/// of it is in odom (O) but the vehicle, which is in base_link (B).
///
///     /map          nav_msgs/OccupancyGrid          the 2D map of the exploration: -1, 0, 100
///     /map_cloud    sensor_msgs/PointCloud2         the global cloud: x y z (float32)
///     /local_grid   sensor_msgs/PointCloud2         centres of the local grid's occupied cells
///     /path         nav_msgs/Path                   flown, as estimated
///     /plan         nav_msgs/Path                   still to be flown
///     /targets      visualization_msgs/MarkerArray  the goal, and the targets reached, numbered
///     /decisions    visualization_msgs/MarkerArray  candidates by what became of them, the revenue
///                                                   of those kept, and the one chosen
///     /vehicle      visualization_msgs/MarkerArray  its solids; latched
///     /rosout       rosgraph_msgs/Log               every event; in ROS 2 rcl_interfaces/Log
///
/// Stamps and arrival are as of BagWriter, whose recording this is a part of.
class DisplayWriter {
 public:
  explicit DisplayWriter(MessageStream& stream);

  void map(Stamp stamp, const OccupancyMap2D& map);
  void cloud(Stamp stamp, std::span<const Vec3f> points_O);
  void grid(Stamp stamp, const GridView& grid);
  void path(Stamp stamp, std::span<const PathPose> poses);
  /// @param points_O a polyline
  void plan(Stamp stamp, std::span<const Vec3> points_O);
  /// @param goal_O nullptr: there is none
  void targets(Stamp stamp, std::span<const Vec3> reached_O, const Vec3* goal_O);
  /// @param height_m at which the 2D candidates are shown, in O
  void decision(const Decision& decision, double height_m);
  /// @param solids in B; to be written once
  void vehicle(Stamp stamp, std::span<const Marker> solids);
  void event(const Event& event);

 private:
  void points(MessageStream::Topic& topic, Stamp stamp, std::span<const Vec3f> points_O);
  void put_pose(const Pose& X);
  /// @param replaces whether what the topic has shown so far goes
  void markers(MessageStream::Topic& topic, Stamp stamp, const char* frame,
               std::span<const Marker> markers, bool replaces);
  void put_marker(MessageStream::Topic& topic, Stamp stamp, const char* frame, const Marker& marker,
                  std::int32_t action);

  MessageStream& stream_;
  RosBytes& message_;  ///< of the stream
  MessageStream::Topic map_, cloud_, grid_, path_, plan_, targets_, decisions_, vehicle_, log_;
};

}  // namespace arex::sim
