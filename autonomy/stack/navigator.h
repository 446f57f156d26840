#pragma once

#include <memory>
#include <string_view>
#include <utility>
#include <vector>

#include "jobs/job_queue.h"
#include "mapping/local_grid.h"
#include "messages/motion.h"
#include "planning/guide_path.h"
#include "planning/replan_machine.h"
#include "stack/stack_config.h"

namespace arex {

/// Flies to goals that are further than the local grid: a guide over the 2D map in its own lane,
/// the replanning machine along it.
class Navigator {
 public:
  /// @param force_lag_s from the controller's demand to the real force
  /// @param planner of another make; null: the B-spline planner
  Navigator(const PlanningConfig& config, double force_lag_s, JobQueue& jobs, std::uint64_t seed,
            std::unique_ptr<LocalPlanner> planner = nullptr);

  /// Takes the vehicle over at rest at the setpoint of another module.
  void take_over(const TrajectorySetpoint& from, Stamp now);
  /// A new goal. @pre the request is a kGoTo.
  void fly_to(const MotionRequest& request, const Odometry& odometry,
              const std::shared_ptr<const OccupancyMap2D>& map, Stamp now);

  /// Comes to rest. @pre the request is a kHold.
  void hold(const MotionRequest& request, Stamp now);

  /// One control step. @param grid, map the newest; may be null before the first.
  TrajectorySetpoint update(const std::shared_ptr<const GridSnapshot>& grid,
                            const std::shared_ptr<const OccupancyMap2D>& map,
                            const Odometry& odometry, Stamp now);

  /// The request that it serves.
  [[nodiscard]] const MotionRequest& request() const { return request_; }
  [[nodiscard]] MotionProgress progress() const { return progress_; }
  [[nodiscard]] std::string_view cause() const { return to_string(machine_.cause()); }
  [[nodiscard]] const PlanCounts& counts() const { return machine_.counts(); }
  /// What of the trajectory in force is still to be flown, in O; empty where that is over.
  [[nodiscard]] std::vector<Vec3> planned_path(Stamp now) const;
  std::vector<PlannerEvent> take_events() { return std::exchange(events_, {}); }

 private:
  void start_guide(const Odometry& odometry, const std::shared_ptr<const OccupancyMap2D>& map,
                   Stamp now);

  PlanningConfig config_;
  double force_lag_s_;
  JobQueue& jobs_;
  JobQueue::Lane planner_lane_;  ///< checks without a plan
  JobQueue::Lane replan_lane_;   ///< checks that made a plan, or tried to
  JobQueue::Lane guide_lane_;
  ReplanMachine machine_;
  Stamp check_period_;
  Stamp next_check_ = 0;
  Stamp next_guide_ = 0;
  MotionRequest request_;
  int goal_number_ = 0;      ///< guides for older goals are dropped
  bool has_target_ = false;  ///< the machine knows the goal
  MotionProgress progress_ = MotionProgress::kArrived;
  std::vector<PlannerEvent> events_;
};

}  // namespace arex
