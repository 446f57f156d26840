#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "mapping/grid_view.h"
#include "math/progress_watch.h"
#include "messages/estimates.h"
#include "planning/bspline_planner.h"
#include "planning/yaw_planner.h"

namespace arex {

enum class ReplanState {
  kInit,
  kWaitTarget,
  kGenNewTraj,
  kReplanTraj,
  kExecTraj,
  kEmergencyStop,
};
[[nodiscard]] std::string_view to_string(ReplanState state);

/// Why the planner cannot go on.
enum class StuckCause {
  kNone,
  kStartInInflation,
  kGoalInInflation,
  kNoPath,
  kOptimiserFailed,
  kRefineRejected,
  kOdometryLost,
  kNoProgress,
  kGoalAboveCeiling,
  kGoalBelowFloor,
};
[[nodiscard]] std::string_view to_string(StuckCause cause);

struct ReplanConfig {
  double check_rate_hz = 20.0;         ///< of tick(): collision check (paper, III-A)
  double horizon_m = 7.5;              ///< to the local target (EGO-Planner)
  double replan_after_m = 1.5;         ///< from the start of a trajectory (EGO-Planner)
  double no_replan_within_m = 2.0;     ///< of the goal (EGO-Planner)
  double emergency_time_s = 1.0;       ///< to a collision (EGO-Planner)
  double replan_slowed_after_s = 0.3;  ///< a trajectory that slows before unknown cells
  double planning_latency_s = 0.02;    ///< modelled: a plan begins this much after its tick
  double max_tracking_error_m = 1.0;   ///< beyond, plans start at the vehicle, not the setpoint
  double goal_tolerance_m = 0.3;
  double target_timeout_s = 20.0;     ///< without getting nearer along the guide
  int max_detours = 8;                ///< longer guides granted without getting nearer at all
  double degenerate_speed_mps = 0.8;  ///< handed down: caution's fraction of the speed limit
  bool recovers = true;               ///< false: as the paper, a failed start is the end of it
  bool follow_ground = false;         ///< handed down: guides go up and down with the ground
  int tries_per_recovery = 3;         ///< plans tried before the next rung
  double back_off_m = 2.0;            ///< along the flown path
  double back_off_speed_mps = 0.7;
  double track_spacing_m = 0.2;  ///< between kept points of the flown path
  int track_points = 60;

  void fields(auto& f) {
    f("check_rate_hz", check_rate_hz, "collision checks (paper, III-A)");
    f("horizon_m", horizon_m, "to the local target");
    f("replan_after_m", replan_after_m, "distance flown on a trajectory before replanning");
    f("no_replan_within_m", no_replan_within_m, "distance to the goal below which none is needed");
    f("emergency_time_s", emergency_time_s, "stop when a collision is nearer than this");
    f("replan_slowed_after_s", replan_slowed_after_s, "age of a plan slowed by unknown cells");
    f("planning_latency_s", planning_latency_s, "modelled compute time of a plan");
    f("max_tracking_error_m", max_tracking_error_m, "beyond, plans start at the vehicle");
    f("goal_tolerance_m", goal_tolerance_m, "the target counts as reached");
    f("target_timeout_s", target_timeout_s,
      "a target is given up after so long without getting nearer to it along the guide");
    f("max_detours", max_detours,
      "how often the way may turn out longer before that must bring the vehicle nearer than ever");
    f("recovers", recovers,
      "out of inflation that has closed around it, and back along the flown path; false: it gives "
      "its target up where it is, as the paper's program does");
    f("tries_per_recovery", tries_per_recovery, "failed plans before the next recovery");
    f("back_off_m", back_off_m, "distance of a retreat along the flown path");
    f("back_off_speed_mps", back_off_speed_mps, "speed of that");
    f("track_spacing_m", track_spacing_m, "between kept points of the flown path");
    f("track_points", track_points, "kept points of the flown path");
    f.check(check_rate_hz >= 1 && check_rate_hz <= 1000, "1 <= check_rate_hz <= 1000");
    f.check(horizon_m > 0 && horizon_m <= 60, "0 < horizon_m <= 60");
    f.check(planning_latency_s >= 0, "planning_latency_s >= 0");
    f.check(tries_per_recovery > 0, "tries_per_recovery > 0");
    f.check(track_points >= 2 && track_points <= 100000, "2 <= track_points <= 100000");
  }
};

enum class PlannerEventKind {
  kStateChanged,
  kPlanned,
  kPlanFailed,
  kEscape,        ///< recovery 1: out of the inflation
  kBackOff,       ///< recovery 2: along the flown path
  kAskForTarget,  ///< recovery 3: the mission should choose another target
  kEmergencyStop,
  kTargetReached,
};
[[nodiscard]] std::string_view to_string(PlannerEventKind kind);

struct PlannerEvent {
  Stamp stamp = 0;
  PlannerEventKind kind = PlannerEventKind::kStateChanged;
  StuckCause cause = StuckCause::kNone;
  ReplanState state = ReplanState::kInit;
};

/// Flies to targets by replanning: INIT, WAIT_TARGET, GEN_NEW_TRAJ, REPLAN_TRAJ, EXEC_TRAJ,
/// EMERGENCY_STOP (EGO-Planner's states). Driven by stamps only: tick() at check_rate_hz with
/// the newest grid, setpoint() at the controller's rate. A plan made at a tick takes effect
/// planning_latency_s later, from the state that the trajectory then in force has at that moment:
/// position, velocity and acceleration are continuous.
/// When plans fail, recoveries are tried in turn: out of the inflation along the gradient of
/// clearance; back along the flown path, which it knows to be free because it flew it, on and on
/// while no plan leads even back there; another target (needs_target() with the cause).
class ReplanMachine {
 public:
  /// @param other whose trajectories it flies; null: the B-spline planner's own, which escapes and
  ///   stops in any case
  ReplanMachine(const ReplanConfig& config, const LocalPlannerConfig& planner, const YawConfig& yaw,
                std::uint64_t seed, std::unique_ptr<LocalPlanner> other = nullptr);

  /// Takes the vehicle over at rest at the setpoint of another module.
  void start_at(const Vec3& p_OB, double yaw_rad, Stamp now);

  /// A new target; `guide` is a polyline in O that leads there (empty: straight).
  void set_target(const Vec3& target, std::vector<Vec3> guide, Stamp now);
  /// A better guide to the same target, as the map grows.
  void set_guide(std::vector<Vec3> guide) {
    guide_ = std::move(guide);
    new_guide_ = true;
  }
  /// Takes the target away: it comes to rest where there is room.
  void drop_target(Stamp now);
  /// Gives the target up: another one is needed.
  void give_up(StuckCause cause, Stamp now);
  /// Gives it up where the vehicle gets no nearer to it. tick() asks this, too.
  void watch_progress(const Odometry& odometry, Stamp now);

  /// @pre stamps increase.
  void tick(const GridView& grid, const Odometry& odometry, Stamp now);

  /// Where the vehicle should be. @pre stamps increase.
  /// @param force_lag_s what the controller demands now acts so much later: the acceleration is
  ///   that of then. Without it the vehicle stands off by force_lag_s m / kv times the
  ///   acceleration, 6 cm RMS on a winding way.
  [[nodiscard]] TrajectorySetpoint setpoint(Stamp now, double force_lag_s = 0.0);

  [[nodiscard]] ReplanState state() const { return state_; }
  [[nodiscard]] bool needs_target() const { return cause_ != StuckCause::kNone; }
  [[nodiscard]] StuckCause cause() const { return cause_; }
  [[nodiscard]] bool has_target() const { return target_.has_value(); }
  /// The trajectory in force and when it began.
  [[nodiscard]] const UniformBspline& trajectory() const { return current_.spline; }
  [[nodiscard]] Stamp trajectory_start() const { return current_.start; }
  [[nodiscard]] const PlanCounts& counts() const { return counts_; }
  /// Events since the last call.
  [[nodiscard]] std::vector<PlannerEvent> take_events();

 private:
  struct Flight {
    UniformBspline spline;
    Stamp takes_over = 0;
    Stamp start = 0;        ///< of the motion: later when the vehicle turns first
    bool slowed = false;    ///< for unknown space
    bool recovery = false;  ///< escape, back-off or stop: not replanned, not checked for inflation
    bool reaches_target = false;
    bool cautious = false;  ///< planned on a degenerate odometry, for less speed

    [[nodiscard]] double time(Stamp now) const { return to_seconds(now - start); }
    [[nodiscard]] MotionState state(Stamp now) const;
    [[nodiscard]] bool over(Stamp now) const { return time(now) >= spline.duration_s(); }
  };

  void enter(ReplanState state, Stamp now);
  void report(PlannerEventKind kind, Stamp now, StuckCause cause = StuckCause::kNone);
  void advance(Stamp now);
  void remember(const Vec3& p);
  void exec(const GridView& grid, const Odometry& odometry, Stamp now);
  void exec_recovery(Stamp now);
  [[nodiscard]] bool try_plan(const GridView& grid, const Odometry& odometry, Stamp now);
  void recover(const GridView& grid, const Odometry& odometry, Stamp now);
  [[nodiscard]] bool try_escape(const GridView& grid, const MotionState& start, Stamp begin,
                                Stamp now);
  [[nodiscard]] bool is_trapped(const GridView& grid, const MotionState& start);
  [[nodiscard]] bool try_back_off(const GridView& grid, const MotionState& start, Stamp begin,
                                  Stamp now);
  void stop(const GridView& grid, Stamp now, StuckCause cause);
  void adopt(Flight flight);
  [[nodiscard]] double way_left(const Vec3& p) const;
  [[nodiscard]] StuckCause cause_of_stall() const;
  void turn(const MotionState& state, Stamp now);
  [[nodiscard]] MotionState state_at(Stamp stamp, const Odometry& odometry) const;
  [[nodiscard]] Vec3 local_target(const GridView& grid, const Vec3& from, double horizon_m) const;
  [[nodiscard]] std::optional<double> next_collision(const GridView& grid, double t_s) const;
  [[nodiscard]] bool must_replan_for_space(const GridView& grid, Stamp now) const;

  ReplanConfig config_;
  std::unique_ptr<LocalPlanner> planner_;
  BsplinePlanner bspline_;
  YawPlanner yaw_planner_;
  std::uint64_t seed_;

  ReplanState state_ = ReplanState::kInit;
  StuckCause cause_ = StuckCause::kNone;
  std::optional<Vec3> target_;
  std::vector<Vec3> guide_;
  static constexpr double kProgress_m = 0.3;  ///< less is what a guide's changes amount to
  static constexpr double kDetour_m = 1.0;    ///< a guide longer by this is another way
  ProgressWatch progress_{kProgress_m};
  bool new_guide_ = false;  ///< since the last look at the progress
  double left_m_ = 0;       ///< of the way, at the last look
  double shortest_m_ = 0;   ///< way left, ever, to this target
  int detours_ = 0;         ///< since it was

  Flight current_;
  std::optional<Flight> next_;       ///< takes over at its start
  std::vector<Vec3> track_;          ///< flown path, oldest first
  std::array<int, 2> recoveries_{};  ///< escapes and retreats since the last success
  int tries_ = 0;
  Heading heading_;
  Stamp last_setpoint_ = 0;

  PlanCounts counts_;
  PlanResult last_plan_;
  std::vector<PlannerEvent> events_;
};

}  // namespace arex
