#include "stack/navigator.h"

#include <algorithm>
#include <utility>

namespace arex {

Navigator::Navigator(const PlanningConfig& config, double force_lag_s, JobQueue& jobs,
                     std::uint64_t seed, std::unique_ptr<LocalPlanner> planner)
    : config_(config),
      force_lag_s_(force_lag_s),
      jobs_(jobs),
      planner_lane_(jobs.add_lane("planner")),
      replan_lane_(jobs.add_lane("replan")),
      guide_lane_(jobs.add_lane("guide")),
      machine_(config.replan, config.local, config.yaw, seed, std::move(planner)),
      check_period_(from_seconds(1 / config.replan.check_rate_hz)) {}

void Navigator::take_over(const TrajectorySetpoint& from, Stamp now) {
  machine_.start_at(from.p_OB, from.yaw_rad, now);
  next_check_ = now;
}

void Navigator::fly_to(const MotionRequest& request, const Odometry& odometry,
                       const std::shared_ptr<const OccupancyMap2D>& map, Stamp now) {
  request_ = request;
  ++goal_number_;
  has_target_ = false;
  progress_ = MotionProgress::kUnderWay;
  const double height = request.goal_O.z();
  if (height > config_.ceiling_m || height < config_.floor_m) {
    machine_.set_target(request_.goal_O, {}, now);
    machine_.give_up(
        height > config_.ceiling_m ? StuckCause::kGoalAboveCeiling : StuckCause::kGoalBelowFloor,
        now);
    has_target_ = true;
    return;
  }
  if (config_.guide.mode == GuideMode::kStraight || !map) {
    machine_.set_target(request_.goal_O, {}, now);
    has_target_ = true;
  } else {
    start_guide(odometry, map, now);
  }
}

void Navigator::hold(const MotionRequest& request, Stamp now) {
  request_ = request;
  ++goal_number_;
  has_target_ = false;
  progress_ = MotionProgress::kUnderWay;
  machine_.drop_target(now);
}

void Navigator::start_guide(const Odometry& odometry,
                            const std::shared_ptr<const OccupancyMap2D>& map, Stamp now) {
  next_guide_ = now + from_seconds(1 / config_.guide_rate_hz);
  jobs_.start(guide_lane_, now, from_seconds(config_.guide_latency_s),
              [this, map, from = odometry.X_OB.p, to = request_.goal_O, number = goal_number_, now,
               latency = from_seconds(config_.guide_latency_s)]() -> JobQueue::Delivery {
                const GuidePath path =
                    plan_guide(*map, from.head<2>(), to.head<2>(), config_.guide);
                const bool follows = config_.guide.follow_ground && !map->ground.heights.empty();
                auto lifted = follows ? lift_path(path.points, from.z(), to.z(), map->ground)
                                      : lift_path(path.points, from.z(), to.z());
                return [this, guide = std::move(lifted), number, now, latency] {
                  if (number != goal_number_) return;
                  if (has_target_) {
                    machine_.set_guide(guide);
                  } else {
                    machine_.set_target(request_.goal_O, guide, now + latency);
                    has_target_ = true;
                  }
                };
              });
}

TrajectorySetpoint Navigator::update(const std::shared_ptr<const GridSnapshot>& grid,
                                     const std::shared_ptr<const OccupancyMap2D>& map,
                                     const Odometry& odometry, Stamp now) {
  if (grid && now >= next_check_) {
    next_check_ = now + check_period_;
    jobs_.run([&] {
      const auto asked = [&] { return machine_.counts().plans + machine_.counts().failures; };
      const int before = asked();
      machine_.tick(grid->view, odometry, now);
      return asked() == before ? planner_lane_ : replan_lane_;
    });
  }
  if (!grid && has_target_) machine_.watch_progress(odometry, now);
  const bool guided = config_.guide.mode == GuideMode::kAstar && map && has_target_;
  if (guided && progress_ == MotionProgress::kUnderWay && now >= next_guide_) {
    start_guide(odometry, map, now);
  }
  for (const PlannerEvent& event : machine_.take_events()) {
    if (event.kind == PlannerEventKind::kTargetReached && has_target_) {
      progress_ = MotionProgress::kArrived;
    }
    events_.push_back(event);
  }
  if (has_target_ && progress_ == MotionProgress::kUnderWay && machine_.needs_target()) {
    progress_ = MotionProgress::kFailed;
  }
  return machine_.setpoint(now, force_lag_s_);
}

std::vector<Vec3> Navigator::planned_path(Stamp now) const {
  constexpr double kStep_s = 0.1;
  const UniformBspline& curve = machine_.trajectory();
  const double duration = curve.duration_s();
  // Before its motion begins the vehicle turns.
  const double begin = std::max(0.0, to_seconds(now - machine_.trajectory_start()));
  std::vector<Vec3> points;
  if (begin >= duration) return points;
  for (int i = 0; begin + i * kStep_s < duration; ++i) {
    points.push_back(curve.position(begin + i * kStep_s));
  }
  points.push_back(curve.position(duration));
  return points;
}

}  // namespace arex
