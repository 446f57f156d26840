#include "run/flight_display.h"

#include <array>

#include "jobs/job_queue.h"

namespace arex::sim {
namespace {

constexpr Stamp kTick = kNanosecondsPerTick;
constexpr Stamp kWayPeriod = 200 * kTick;   // 5 Hz
constexpr Stamp kMapPeriod = 1000 * kTick;  // at most, and when there is a new one
constexpr Stamp kCloudDue = 1000 * kTick;   // nobody waits for it
constexpr double kPathStep_m = 0.25;        // between points of the path
// The cloud is written whole each time: when it has grown by a tenth, all of them together are
// eleven times the last; and when it has grown at all in so long.
constexpr std::size_t kGrowth = 10;
constexpr Stamp kCloudPeriod = 10'000 * kTick;

/// By AirframePart.
constexpr std::array<Colour, 6> kPartColours{{{0.25F, 0.25F, 0.28F, 1},
                                              {0.15F, 0.15F, 0.15F, 1},
                                              {0.2F, 0.5F, 0.9F, 0.4F},
                                              {0.1F, 0.1F, 0.12F, 1},
                                              {0.8F, 0.8F, 0.82F, 1},
                                              {0.5F, 0.5F, 0.5F, 1}}};

std::vector<Marker> solids_of(const Airframe& airframe) {
  std::vector<Marker> solids;
  for (const worlds::CollisionShape& shape : airframe.shapes) {
    Marker marker;
    marker.space = "vehicle";
    marker.number = static_cast<std::int32_t>(solids.size());
    marker.X = shape.X_WS;
    marker.colour = kPartColours.at(shape.object);
    const bool box = shape.kind == worlds::CollisionShape::Kind::kBox;
    marker.shape = box ? Marker::Shape::kBox : Marker::Shape::kCylinder;
    // Half lengths there, whole ones here; a capsule without its caps.
    marker.size_m = box ? Vec3(2 * shape.size)
                        : Vec3(2 * shape.size.x(), 2 * shape.size.x(), 2 * shape.size.y());
    solids.push_back(std::move(marker));
  }
  return solids;
}

bool has_goal(MissionState state) {
  return state == MissionState::kEntry || state == MissionState::kFly ||
         state == MissionState::kExplore || state == MissionState::kReturn;
}

}  // namespace

FlightDisplay::FlightDisplay(BagWriter& bag, FlightSoftware& software, const Airframe& airframe)
    : writer_(bag.display()), software_(software) {
  writer_.vehicle(0, solids_of(airframe));
}

void FlightDisplay::decision(const Decision& decision) {
  // Where the target is kept there is nothing new to see.
  if (decision.candidates.empty() && decision.kind != DecisionKind::kStop) return;
  writer_.decision(decision, software_.view().odometry.X_OB.p.z());
}

void FlightDisplay::update(Stamp now) {
  if (now % kWayPeriod != 0) return;
  const FlightView view = software_.view();
  show_way(now, view);
  show_targets(now, view);
  if (now % kMapPeriod != 0) return;
  show_maps(now, view);
  show_cloud(now);
}

void FlightDisplay::show_way(Stamp now, const FlightView& view) {
  if (view.odometry.status != OdometryStatus::kInitialising) {
    const Pose& X_OB = view.odometry.X_OB;
    if (path_.empty() || (X_OB.p - path_.back().X_OB.p).norm() > kPathStep_m) {
      path_.push_back({now, X_OB});
    }
  }
  if (now % kMapPeriod == 0 && path_.size() > path_shown_) {
    path_shown_ = path_.size();
    writer_.path(now, path_);
  }
  const std::vector<Vec3> plan = software_.planned_path();
  if (!plan.empty() || plan_shown_) writer_.plan(now, plan);
  plan_shown_ = !plan.empty();
}

void FlightDisplay::show_targets(Stamp now, const FlightView& view) {
  const bool goal = has_goal(view.state);
  const bool same =
      view.targets.size() == targets_ && goal == goal_shown_ && (!goal || view.goal_O == goal_O_);
  if (same) return;
  targets_ = view.targets.size();
  goal_shown_ = goal;
  goal_O_ = view.goal_O;
  std::vector<Vec3> reached;
  for (const MissionTarget& target : view.targets) reached.push_back(target.p_O);
  writer_.targets(now, reached, goal ? &goal_O_ : nullptr);
}

void FlightDisplay::show_maps(Stamp now, const FlightView& view) {
  if (view.map_2d && view.map_2d != map_) writer_.map(now, *view.map_2d);
  if (view.grid && view.grid != grid_) writer_.grid(now, view.grid->view);
  map_ = view.map_2d;
  grid_ = view.grid;
}

void FlightDisplay::show_cloud(Stamp now) {
  software_.read_cloud(
      now + kCloudDue, [this, now](const PointCloudMap& cloud) -> JobQueue::Delivery {
        const std::size_t size = cloud.size();
        const bool much = kGrowth * (size - cloud_points_) >= cloud_points_;
        if (size == cloud_points_ || (!much && now - cloud_stamp_ < kCloudPeriod)) return nullptr;
        cloud_points_ = size;
        cloud_stamp_ = now;
        return [this, now, points = cloud.points()] { writer_.cloud(now, points); };
      });
}

}  // namespace arex::sim
