#include "bag/display_writer.h"

#include <array>
#include <charconv>
#include <cmath>
#include <string_view>

#include "bag/ros_messages.h"

namespace arex::sim {
namespace {

constexpr std::int32_t kAdd = 0, kDeleteAll = 3;  // of visualization_msgs/Marker
constexpr double kCandidate_m = 0.3, kChosen_m = 0.6, kLine_m = 0.05, kText_m = 0.35;
constexpr std::uint8_t kFloat32 = 7;  // of sensor_msgs/PointField

/// By Verdict.
constexpr std::array<Colour, kVerdictNames.size()> kVerdictColours{{{0.2F, 0.7F, 1.0F, 0.9F},
                                                                    {0.9F, 0.3F, 0.2F, 0.5F},
                                                                    {0.6F, 0.6F, 0.6F, 0.5F},
                                                                    {0.9F, 0.6F, 0.1F, 0.7F},
                                                                    {0.3F, 0.3F, 0.3F, 0.7F},
                                                                    {0.7F, 0.3F, 0.8F, 0.5F}}};
constexpr Colour kChosen{0.1F, 0.9F, 0.3F, 1}, kReached{0.2F, 0.8F, 0.3F, 0.7F},
    kGoal{1, 0.2F, 0.6F, 0.9F}, kWriting{1, 1, 1, 1};

/// With so many digits behind the point.
std::string text_of(double value, int digits) {
  std::array<char, 48> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value,
                                 std::chars_format::fixed, digits);
  return end.ec == std::errc() ? std::string(text.data(), end.ptr) : "?";
}

Pose at(const Vec3& p) { return {Mat3::Identity(), p}; }

Marker sphere(std::string space, std::int32_t number, const Vec3& p, double size_m, Colour colour) {
  return {std::move(space), number, Marker::Shape::kSphere, at(p), Vec3::Constant(size_m), colour};
}

Marker writing(std::string space, std::int32_t number, const Vec3& p, std::string text) {
  const Vec3 above = p + Vec3(0, 0, kCandidate_m);
  return {std::move(space), number, Marker::Shape::kText, at(above), Vec3::Constant(kText_m),
          kWriting,         {},     std::move(text)};
}

/// What the explorer said, and of a chosen candidate its terms.
std::string text_of(const Decision& decision) {
  std::string text(kDecisionKindNames[static_cast<std::size_t>(decision.kind)]);
  if (decision.kind == DecisionKind::kStop) {
    text += ": ";
    text += kStopReasonNames[static_cast<std::size_t>(decision.stop_reason)];
  }
  if (!decision.winner) return text;
  const Candidate& c = decision.candidates[*decision.winner];
  text += "\nrevenue " + text_of(c.revenue, 2) + "\nf_I " + text_of(c.information_m2, 1) +
          " m2, f_N " + text_of(c.distance_m, 1) + " m, f_D " + text_of(c.direction, 2);
  return text;
}

/// By the kind alone: 0 information, 1 warning, 2 error.
int severity_of(EventKind kind) {
  switch (kind) {
    case EventKind::kCollision:
    case EventKind::kStuck:
      return 2;
    case EventKind::kTargetDropped:
    case EventKind::kPlanner:
    case EventKind::kRecovery:
    case EventKind::kSensorFault:
    case EventKind::kVehicleFault:
    case EventKind::kVibration:
    case EventKind::kMapFull:
      return 1;
    default:
      return 0;
  }
}

}  // namespace

DisplayWriter::DisplayWriter(MessageStream& stream)
    : stream_(stream),
      message_(stream.message()),
      map_(stream.topic("/map", occupancy_grid_type(), true)),
      cloud_(stream.topic("/map_cloud", point_cloud_type(), true)),
      grid_(stream.topic("/local_grid", point_cloud_type())),
      path_(stream.topic("/path", path_type())),
      plan_(stream.topic("/plan", path_type())),
      targets_(stream.topic("/targets", marker_array_type(), true)),
      decisions_(stream.topic("/decisions", marker_array_type())),
      vehicle_(stream.topic("/vehicle", marker_array_type(), true)),
      log_(stream.topic("/rosout", log_type())) {}

void DisplayWriter::put_pose(const Pose& X) {
  message_.put(X.p);
  message_.put(X.quaternion());
}

void DisplayWriter::map(Stamp stamp, const OccupancyMap2D& map) {
  stream_.begin_message(map_, stamp, kOdomFrame);
  message_.put(ros_time(stamp));  // map_load_time
  message_.put(static_cast<float>(map.resolution));
  message_.put(static_cast<std::uint32_t>(map.width));
  message_.put(static_cast<std::uint32_t>(map.height));
  put_pose(at({map.origin.x(), map.origin.y(), 0}));
  message_.put_length(map.cells.size());
  message_.reserve(message_.size() + map.cells.size());
  constexpr std::int8_t kCertain = 100;
  for (const std::int8_t cell : map.cells) {
    message_.put_packed(cell == OccupancyMap2D::kOccupied ? kCertain : cell);
  }
  stream_.write(map_);
}

void DisplayWriter::points(MessageStream::Topic& topic, Stamp stamp,
                           std::span<const Vec3f> points_O) {
  const auto count = static_cast<std::uint32_t>(points_O.size());
  constexpr std::array<std::string_view, 3> kFields{"x", "y", "z"};
  constexpr std::uint32_t kStep = kFields.size() * sizeof(float);
  stream_.begin_message(topic, stamp, kOdomFrame);
  message_.put(std::uint32_t{1});  // height: an unordered cloud
  message_.put(count);
  message_.put_length(kFields.size());
  for (std::size_t i = 0; i < kFields.size(); ++i) {
    message_.put(kFields[i]);
    message_.put(static_cast<std::uint32_t>(i * sizeof(float)));
    message_.put(kFloat32);
    message_.put(std::uint32_t{1});
  }
  message_.put(false);  // is_bigendian
  message_.put(kStep);
  message_.put(kStep * count);
  message_.put_length(std::size_t{kStep} * count);
  static_assert(sizeof(Vec3f) == kStep);
  message_.put_raw(points_O.data(), points_O.size_bytes());
  message_.put(true);  // is_dense
  stream_.write(topic);
}

void DisplayWriter::cloud(Stamp stamp, std::span<const Vec3f> points_O) {
  points(cloud_, stamp, points_O);
}

void DisplayWriter::grid(Stamp stamp, const GridView& grid) {
  std::vector<Vec3f> occupied;
  Eigen::Vector3i cell;
  for (cell.z() = 0; cell.z() < grid.size.z(); ++cell.z()) {
    for (cell.x() = 0; cell.x() < grid.size.x(); ++cell.x()) {
      for (cell.y() = 0; cell.y() < grid.size.y(); ++cell.y()) {
        if ((grid.cells[grid.index(cell)] & GridView::kOccupied) == 0) continue;
        occupied.push_back(grid.centre_of(cell).cast<float>());
      }
    }
  }
  points(grid_, stamp, occupied);
}

void DisplayWriter::path(Stamp stamp, std::span<const PathPose> poses) {
  stream_.begin_message(path_, stamp, kOdomFrame);
  message_.put_length(poses.size());
  MessageStream::Topic own;  // poses are not numbered by the path's count
  for (const PathPose& pose : poses) {
    stream_.put_header(own, pose.stamp, kOdomFrame);
    put_pose(pose.X_OB);
  }
  stream_.write(path_);
}

void DisplayWriter::plan(Stamp stamp, std::span<const Vec3> points_O) {
  stream_.begin_message(plan_, stamp, kOdomFrame);
  message_.put_length(points_O.size());
  MessageStream::Topic own;
  for (const Vec3& p : points_O) {
    stream_.put_header(own, stamp, kOdomFrame);
    put_pose(at(p));
  }
  stream_.write(plan_);
}

void DisplayWriter::targets(Stamp stamp, std::span<const Vec3> reached_O, const Vec3* goal_O) {
  std::vector<Marker> shown;
  for (const Vec3& p : reached_O) {
    const auto number = static_cast<std::int32_t>(shown.size() / 2);
    shown.push_back(sphere("reached", number, p, kCandidate_m, kReached));
    shown.push_back(writing("numbers", number, p, std::to_string(number + 1)));
  }
  if (goal_O) shown.push_back(sphere("goal", 0, *goal_O, kChosen_m, kGoal));
  markers(targets_, stamp, kOdomFrame, shown, true);
}

void DisplayWriter::decision(const Decision& decision, double height_m) {
  std::vector<Marker> shown;
  const auto raised = [&](const Vec2& p) { return Vec3(p.x(), p.y(), height_m); };
  for (std::size_t i = 0; i < decision.candidates.size(); ++i) {
    const Candidate& c = decision.candidates[i];
    const auto verdict = static_cast<std::size_t>(c.verdict);
    const auto number = static_cast<std::int32_t>(i);
    const bool chosen = decision.winner == i;
    shown.push_back(sphere(std::string(kVerdictNames[verdict]), number, raised(c.point),
                           chosen ? kChosen_m : kCandidate_m,
                           chosen ? kChosen : kVerdictColours[verdict]));
    if (c.verdict == Verdict::kKept && !chosen) {
      shown.push_back(writing("revenue", number, raised(c.point), text_of(c.revenue, 2)));
    }
    if (!chosen) continue;
    shown.push_back({"chosen",
                     number,
                     Marker::Shape::kLineStrip,
                     Pose(),
                     Vec3(kLine_m, 0, 0),
                     kChosen,
                     {raised(c.viewpoint), raised(c.point)}});
  }
  const bool flies = decision.kind == DecisionKind::kNewTarget || decision.winner;
  const Vec3 where = flies ? raised(decision.target) : Vec3(0, 0, height_m);
  shown.push_back(writing("decision", 0, where, text_of(decision)));
  markers(decisions_, decision.stamp, kOdomFrame, shown, true);
}

void DisplayWriter::vehicle(Stamp stamp, std::span<const Marker> solids) {
  markers(vehicle_, stamp, kBodyFrame, solids, false);
}

void DisplayWriter::markers(MessageStream::Topic& topic, Stamp stamp, const char* frame,
                            std::span<const Marker> markers, bool replaces) {
  message_.clear();
  message_.put_length(markers.size() + replaces);
  if (replaces) put_marker(topic, stamp, frame, Marker(), kDeleteAll);
  for (const Marker& marker : markers) put_marker(topic, stamp, frame, marker, kAdd);
  stream_.write(topic);
}

void DisplayWriter::put_marker(MessageStream::Topic& topic, Stamp stamp, const char* frame,
                               const Marker& marker, std::int32_t action) {
  const bool ros2 = stream_.format() == WireFormat::kCdr;
  stream_.put_header(topic, stamp, frame);
  message_.put(marker.space);
  message_.put(marker.number);
  message_.put(static_cast<std::int32_t>(marker.shape));
  message_.put(action);
  put_pose(marker.X);
  message_.put(marker.size_m);
  for (const float value : {marker.colour.r, marker.colour.g, marker.colour.b, marker.colour.a}) {
    message_.put(value);
  }
  for (int i = 0; i < 2; ++i) message_.put(std::uint32_t{0});  // lifetime: until it is replaced
  message_.put(true);                                          // goes with its frame
  message_.put_length(marker.points.size());
  for (const Vec3& p : marker.points) message_.put(p);
  message_.put_length(0);  // colours of points
  if (ros2) {
    message_.put("");  // no texture: its name, its image, its coordinates
    MessageStream::Topic none;
    stream_.put_header(none, 0, "");
    message_.put("");
    message_.put_length(0);
    message_.put_length(0);
  }
  message_.put(marker.text);
  message_.put("");  // no mesh
  if (ros2) {
    message_.put("");
    message_.put_length(0);
  }
  message_.put(false);
}

void DisplayWriter::event(const Event& event) {
  constexpr std::array<std::uint8_t, 3> kRos1Levels{2, 4, 8}, kRos2Levels{20, 30, 40};
  const auto severity = static_cast<std::size_t>(severity_of(event.kind));
  const bool ros2 = stream_.format() == WireFormat::kCdr;
  message_.clear();
  if (ros2) {
    message_.put(ros_time(event.stamp));
    message_.put(kRos2Levels[severity]);
  } else {
    stream_.put_header(log_, event.stamp, "");
    message_.put(kRos1Levels[severity]);
  }
  std::string text(kEventKindNames[static_cast<std::size_t>(event.kind)]);
  if (!event.detail.empty()) text += ": " + event.detail;
  message_.put("arex");
  message_.put(text);
  for (int i = 0; i < 2; ++i) message_.put("");  // file, function
  message_.put(std::uint32_t{0});                // line
  if (!ros2) message_.put_length(0);             // topics
  stream_.write(log_);
}

}  // namespace arex::sim
