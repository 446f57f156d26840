#include "planning/replan_machine.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "math/so3.h"
#include "planning/curve_check.h"
#include "planning/free_space.h"
#include "planning/guide_path.h"
#include "planning/path_timing.h"
#include "planning/stopping.h"

namespace arex {
namespace {

constexpr double kAtRest_mps = 0.05;
constexpr double kClearanceStep_s = 0.05;
constexpr double kLeastAhead_m = 1.0;  ///< local targets nearer than this are not looked for
constexpr double kRounding_m = 1e-9;
constexpr double kBend_m = 0.25;  ///< of a guide above or below the straight way to a local target
constexpr double kParts[] = {0.25, 0.5, 0.75};
constexpr double kGridMargin_m = 0.25;  ///< local targets stay this far inside the grid
/// Shares of the horizon tried for a local target that cannot be reached.
constexpr double kShorter[] = {1.0, 0.6, 0.35};
constexpr int kMaxEscapes = 3, kMaxRetreats = 1;

StuckCause cause_of(PlanStatus status) {
  switch (status) {
    case PlanStatus::kOk:
      return StuckCause::kNone;
    case PlanStatus::kStartInInflation:
      return StuckCause::kStartInInflation;
    case PlanStatus::kGoalInInflation:
      return StuckCause::kGoalInInflation;
    case PlanStatus::kNoPath:
      return StuckCause::kNoPath;
    case PlanStatus::kOptimiserFailed:
      return StuckCause::kOptimiserFailed;
    case PlanStatus::kRefineRejected:
      return StuckCause::kRefineRejected;
  }
  return StuckCause::kOptimiserFailed;
}

bool is_usable(OdometryStatus status) {
  return status == OdometryStatus::kOk || status == OdometryStatus::kDegenerate;
}

bool is_weak(OdometryStatus status) { return status == OdometryStatus::kDegenerate; }

UniformBspline hold(const Vec3& p, double knot_span_s) {
  return {std::vector<Vec3>(7, p), knot_span_s};
}

}  // namespace

std::string_view to_string(ReplanState state) {
  static constexpr std::array<std::string_view, 6> kNames{
      "INIT", "WAIT_TARGET", "GEN_NEW_TRAJ", "REPLAN_TRAJ", "EXEC_TRAJ", "EMERGENCY_STOP"};
  return kNames[static_cast<std::size_t>(state)];
}

std::string_view to_string(StuckCause cause) {
  static constexpr std::array<std::string_view, 10> kNames{"none",
                                                           "start_in_inflation",
                                                           "goal_in_inflation",
                                                           "no_path",
                                                           "optimiser_failed",
                                                           "refine_rejected",
                                                           "odometry_lost",
                                                           "no_progress",
                                                           "goal_above_ceiling",
                                                           "goal_below_floor"};
  return kNames[static_cast<std::size_t>(cause)];
}

std::string_view to_string(PlannerEventKind kind) {
  static constexpr std::array<std::string_view, 8> kNames{
      "state_changed", "planned",        "plan_failed",    "escape",
      "back_off",      "ask_for_target", "emergency_stop", "target_reached"};
  return kNames[static_cast<std::size_t>(kind)];
}

MotionState ReplanMachine::Flight::state(Stamp now) const {
  MotionState state = spline.state(time(now));
  if (time(now) < 0 || over(now)) state.v = state.a = Vec3::Zero();  // both ends are at rest
  return state;
}

ReplanMachine::ReplanMachine(const ReplanConfig& config, const LocalPlannerConfig& planner,
                             const YawConfig& yaw, std::uint64_t seed,
                             std::unique_ptr<LocalPlanner> other)
    : config_(config),
      planner_(std::move(other)),
      bspline_(planner),
      yaw_planner_(yaw),
      seed_(seed) {}

void ReplanMachine::set_target(const Vec3& target, std::vector<Vec3> guide, Stamp now) {
  target_ = target;
  guide_ = std::move(guide);
  progress_.begin(now);
  new_guide_ = false;
  detours_ = 0;
  shortest_m_ = std::numeric_limits<double>::infinity();
  cause_ = StuckCause::kNone;
  tries_ = 0;
  recoveries_ = {};
  last_plan_.status = PlanStatus::kOk;  // none has failed on the way to this one
  if (state_ == ReplanState::kExecTraj && !current_.recovery) enter(ReplanState::kReplanTraj, now);
}

void ReplanMachine::drop_target(Stamp now) {
  target_.reset();
  guide_.clear();
  cause_ = StuckCause::kNone;
  if (state_ == ReplanState::kGenNewTraj) enter(ReplanState::kWaitTarget, now);
}

std::vector<PlannerEvent> ReplanMachine::take_events() { return std::exchange(events_, {}); }

void ReplanMachine::enter(ReplanState state, Stamp now) {
  if (state == state_) return;
  state_ = state;
  report(PlannerEventKind::kStateChanged, now);
}

void ReplanMachine::report(PlannerEventKind kind, Stamp now, StuckCause cause) {
  events_.push_back({now, kind, cause, state_});
}

void ReplanMachine::advance(Stamp now) {
  if (!next_ || now < next_->takes_over) return;
  current_ = *std::move(next_);
  next_.reset();
}

void ReplanMachine::adopt(Flight flight) { next_ = std::move(flight); }

void ReplanMachine::remember(const Vec3& p) {
  if (!track_.empty() && (track_.back() - p).norm() < config_.track_spacing_m) return;
  track_.push_back(p);
  if (static_cast<int>(track_.size()) > config_.track_points) track_.erase(track_.begin());
}

MotionState ReplanMachine::state_at(Stamp stamp, const Odometry& odometry) const {
  const MotionState planned = current_.state(stamp);
  if ((planned.p - odometry.X_OB.p).norm() <= config_.max_tracking_error_m) return planned;
  return {odometry.X_OB.p, odometry.v_OB, Vec3::Zero()};
}

void ReplanMachine::start_at(const Vec3& p_OB, double yaw_rad, Stamp now) {
  current_ = {hold(p_OB, bspline_.config().timing_knot_span_s), now, now};
  next_.reset();
  track_.clear();  // of another frame, after a jump; flown by somebody else otherwise
  heading_ = {yaw_rad, 0.0};
  enter(ReplanState::kWaitTarget, now);
}

void ReplanMachine::tick(const GridView& grid, const Odometry& odometry, Stamp now) {
  advance(now);
  if (state_ == ReplanState::kInit) {
    if (!is_usable(odometry.status)) return;
    start_at(odometry.X_OB.p, so3::yaw(odometry.X_OB.R), now);
  }
  if (!is_usable(odometry.status)) {
    const bool flying = state_ == ReplanState::kExecTraj || state_ == ReplanState::kReplanTraj;
    if (flying) stop(grid, now, StuckCause::kOdometryLost);
    if (has_target() && cause_ == StuckCause::kNone) give_up(StuckCause::kOdometryLost, now);
    return;
  }
  if (!current_.recovery) remember(odometry.X_OB.p);  // a retreat does not lengthen the way back
  if (next_) return;                                  // the newest plan has not taken over yet

  watch_progress(odometry, now);
  switch (state_) {
    case ReplanState::kInit:
      break;
    case ReplanState::kWaitTarget:
      if (!has_target() || needs_target()) break;
      enter(ReplanState::kGenNewTraj, now);
      [[fallthrough]];
    case ReplanState::kGenNewTraj:
      if (try_plan(grid, odometry, now)) {
        enter(ReplanState::kExecTraj, now);
      } else {
        recover(grid, odometry, now);
      }
      break;
    case ReplanState::kReplanTraj:
    case ReplanState::kExecTraj:
      current_.recovery ? exec_recovery(now) : exec(grid, odometry, now);
      break;
    case ReplanState::kEmergencyStop:
      if (current_.over(now)) {
        enter(has_target() && !needs_target() ? ReplanState::kGenNewTraj : ReplanState::kWaitTarget,
              now);
      }
      break;
  }
}

double ReplanMachine::way_left(const Vec3& p) const {
  if (guide_.size() < 2) return (*target_ - p).norm();
  return length_ahead(guide_, p) + (*target_ - guide_.back()).norm();
}

void ReplanMachine::watch_progress(const Odometry& odometry, Stamp now) {
  if (!has_target() || needs_target()) return;
  const double left = way_left(odometry.X_OB.p);
  if (left < shortest_m_ - kProgress_m) {
    shortest_m_ = left;
    detours_ = 0;
  }
  // The old way has turned out to be none. Who finds that again and again, without ever getting
  // nearer, flies to and fro.
  if (std::exchange(new_guide_, false) && left > left_m_ + kDetour_m &&
      detours_ < config_.max_detours) {
    progress_.lengthen(left);
    ++detours_;
  }
  left_m_ = left;
  progress_.update(left, now);
  if (to_seconds(now - progress_.since()) > config_.target_timeout_s) {
    give_up(cause_of_stall(), now);
  }
}

StuckCause ReplanMachine::cause_of_stall() const {
  const bool partial =
      guide_.size() >= 2 && (guide_.back() - *target_).head<2>().norm() > config_.goal_tolerance_m;
  if (partial) return StuckCause::kNoPath;
  const StuckCause plan = cause_of(last_plan_.status);
  return plan == StuckCause::kNone ? StuckCause::kNoProgress : plan;
}

void ReplanMachine::exec_recovery(Stamp now) {
  if (!current_.over(now)) return;
  enter(has_target() && !needs_target() ? ReplanState::kGenNewTraj : ReplanState::kWaitTarget, now);
}

void ReplanMachine::exec(const GridView& grid, const Odometry& odometry, Stamp now) {
  if (!has_target() || needs_target()) {  // it was taken away: stop where there is room
    stop(grid, now, cause_);
    return;
  }
  if (current_.over(now)) {
    const auto arrived = [&] {
      const Vec3& end = current_.spline.control_points().back();
      return (end - *target_).norm() <= config_.goal_tolerance_m;
    };
    if (current_.reaches_target && arrived()) {
      target_.reset();
      report(PlannerEventKind::kTargetReached, now);
      enter(ReplanState::kWaitTarget, now);
    } else if (current_.reaches_target && is_blocked(grid, *target_)) {
      give_up(StuckCause::kGoalInInflation, now);
      enter(ReplanState::kWaitTarget, now);
    } else {
      // Further on. Or the target was blocked when this was planned: a ghost, or better seen from
      // here.
      enter(ReplanState::kGenNewTraj, now);
    }
    return;
  }
  const double t = std::max(0.0, current_.time(now));
  const MotionState here = current_.state(now);
  const auto collision = next_collision(grid, t);
  const bool blind = must_replan_for_space(grid, now);
  const double flown = (here.p - current_.spline.position(0)).norm();
  const double left = (here.p - *target_).norm();
  const bool settled = current_.reaches_target && left < config_.no_replan_within_m;
  const bool due = flown > config_.replan_after_m && !settled;
  const bool slowed = current_.slowed && current_.time(now) > config_.replan_slowed_after_s;
  const bool asked =
      state_ == ReplanState::kReplanTraj || current_.cautious != is_weak(odometry.status);
  if (!collision && !blind && !due && !slowed && !asked) return;

  enter(ReplanState::kReplanTraj, now);
  if (!try_plan(grid, odometry, now)) {
    const bool near = collision && *collision - t < config_.emergency_time_s;
    if (near || blind) {
      stop(grid, now, cause_of(last_plan_.status));
      return;
    }
  }
  enter(ReplanState::kExecTraj, now);
}

/// When the trajectory next meets blocked cells. Inflation that has grown over the vehicle does not
/// count if the trajectory leaves it soon and comes, until then, neither nearer than the true
/// radius nor nearer than it is by more than a cell: stopping inside would be worse.
std::optional<double> ReplanMachine::next_collision(const GridView& grid, double t_s) const {
  const double radius = std::min(bspline_.config().vehicle_radius_m,
                                 clearance(grid, current_.spline.position(t_s),
                                           bspline_.config().vehicle_radius_m + grid.resolution_m) -
                                     grid.resolution_m);
  for (const TimeInterval& stretch : find_collisions(grid, current_.spline, t_s)) {
    bool leaves = stretch.begin_s <= t_s && stretch.end_s < t_s + config_.emergency_time_s;
    for (double t = stretch.begin_s; leaves && t <= stretch.end_s; t += kClearanceStep_s) {
      leaves = clearance(grid, current_.spline.position(t), radius) >= radius;
    }
    if (!leaves) return stretch.begin_s;
  }
  return std::nullopt;
}

bool ReplanMachine::must_replan_for_space(const GridView& grid, Stamp now) const {
  const LocalPlannerConfig& planner = bspline_.config();
  if (!planner.stop_in_known_space) return false;
  const double speed = current_.state(now).v.norm();
  if (speed <= planner.unknown_speed_mps * (1 + planner.limit_tolerance)) return false;
  const KnownPrefix prefix = known_prefix(grid, current_.spline, std::max(0.0, current_.time(now)),
                                          planner.vehicle_radius_m);
  const double reaction = config_.planning_latency_s + 1.0 / config_.check_rate_hz;
  return !prefix.whole &&
         prefix.length_m < stopping_distance(speed, planner.max_acceleration_mps2, reaction);
}

Vec3 ReplanMachine::local_target(const GridView& grid, const Vec3& from, double horizon_m) const {
  const auto ahead = [&](double way_m) {
    Vec3 target = *target_;
    if (guide_.size() >= 2) {
      target = point_ahead(guide_, from, way_m);
      if ((target - guide_.back()).norm() < 1e-9) target = *target_;
    }
    const Vec3 way = target - from;
    if (way.norm() > way_m) target = from + way * (way_m / way.norm());
    return target;
  };
  const Vec3 low = grid.low.array() + kGridMargin_m;
  const Vec3 high =
      (grid.low + grid.resolution_m * grid.size.cast<double>()).array() - kGridMargin_m;
  const auto leaves = [&](const Vec3& p) {
    return p.z() < low.z() - kRounding_m || p.z() > high.z() + kRounding_m;
  };
  const auto bends = [&](double way_m, const Vec3& end) {  // a crest, or a ramp's foot
    return std::any_of(std::begin(kParts), std::end(kParts), [&](double part) {
      return std::abs(ahead(part * way_m).z() - (from + part * (end - from)).z()) > kBend_m;
    });
  };
  Vec3 target = ahead(horizon_m);
  // On a ramp the guide leaves the flat grid above or below: as far as the grid shows it, and as
  // the straight way keeps to its height.
  while (config_.follow_ground && horizon_m > kLeastAhead_m &&
         (leaves(target) || bends(horizon_m, target))) {
    horizon_m = std::max(kLeastAhead_m, horizon_m - grid.resolution_m);
    target = ahead(horizon_m);
  }
  return target.cwiseMax(low).cwiseMin(high);
}

bool ReplanMachine::try_plan(const GridView& grid, const Odometry& odometry, Stamp now) {
  const Stamp begin = now + from_seconds(config_.planning_latency_s);
  PlanRequest request;
  request.start = state_at(begin, odometry);
  const bool cautious = is_weak(odometry.status);
  if (cautious) request.max_speed_mps = config_.degenerate_speed_mps;
  request.may_graze = true;
  request.seed = seed_ + static_cast<std::uint64_t>(counts_.plans + counts_.failures);
  const bool from_rest = request.start.v.norm() < kAtRest_mps;
  if (state_ == ReplanState::kReplanTraj && !from_rest) {
    request.previous = &current_.spline;
    request.previous_time_s = current_.time(begin);
  }
  // The paper's program judges by the inflated cell that it is in, and knows no way out of it.
  if (!config_.recovers && is_blocked(grid, request.start.p)) {
    last_plan_ = {};
    last_plan_.status = PlanStatus::kStartInInflation;
    counts_.add(last_plan_);
    report(PlannerEventKind::kPlanFailed, now, StuckCause::kStartInInflation);
    return false;
  }
  const bool was_inside = last_plan_.diagnostics.start_inflated;
  bool final_target = false;
  for (const double share : kShorter) {
    request.goal = local_target(grid, request.start.p, share * config_.horizon_m);
    final_target = (request.goal - *target_).norm() < 1e-6;
    last_plan_ = planner_ ? planner_->plan(grid, request) : bspline_.plan(grid, request);
    const bool shorter_helps = last_plan_.status == PlanStatus::kNoPath ||
                               last_plan_.status == PlanStatus::kGoalInInflation;
    // In flight the next tick is soon enough, and the trajectory in force still good.
    if (last_plan_.ok() || final_target || !shorter_helps || !from_rest) break;
  }
  counts_.add(last_plan_);
  if (last_plan_.diagnostics.start_inflated && !was_inside) {  // the plan leads out of it
    report(PlannerEventKind::kEscape, now, StuckCause::kStartInInflation);
  }
  if (!last_plan_.ok()) {
    report(PlannerEventKind::kPlanFailed, now, cause_of(last_plan_.status));
    return false;
  }
  tries_ = 0;
  Flight flight{last_plan_.trajectory, begin, begin};
  flight.cautious = cautious;
  flight.slowed = last_plan_.diagnostics.slowed;
  flight.reaches_target = final_target && !last_plan_.diagnostics.braked;
  if (from_rest && yaw_planner_.mode() == YawMode::kAlongPath) {  // look first, then fly
    const double wanted = yaw_planner_.wanted(flight.spline, 0.0, heading_.yaw_rad);
    flight.start += from_seconds(yaw_planner_.turn_time_s(heading_.yaw_rad, wanted));
  }
  adopt(std::move(flight));
  report(PlannerEventKind::kPlanned, now);
  return true;
}

void ReplanMachine::recover(const GridView& grid, const Odometry& odometry, Stamp now) {
  const StuckCause cause = cause_of(last_plan_.status);
  const Stamp begin = now + from_seconds(config_.planning_latency_s);
  const MotionState start = state_at(begin, odometry);
  if (cause == StuckCause::kStartInInflation) {
    if (config_.recovers && recoveries_[0] < kMaxEscapes && try_escape(grid, start, begin, now))
      return;
  } else if (++tries_ < config_.tries_per_recovery) {
    return;  // the next tick brings a newer grid and another seed
  }
  tries_ = 0;
  const bool may_retreat =
      config_.recovers && (recoveries_[1] < kMaxRetreats || is_trapped(grid, start));
  if (may_retreat && try_back_off(grid, start, begin, now)) return;
  give_up(cause, now);
  enter(ReplanState::kWaitTarget, now);
}

bool ReplanMachine::try_escape(const GridView& grid, const MotionState& start, Stamp begin,
                               Stamp now) {
  PlanResult escape = bspline_.plan_escape(grid, start);
  if (!escape.ok()) return false;
  ++recoveries_[0];
  Flight flight{std::move(escape.trajectory), begin, begin};
  flight.recovery = true;
  adopt(std::move(flight));
  report(PlannerEventKind::kEscape, now, StuckCause::kStartInInflation);
  enter(ReplanState::kExecTraj, now);
  return true;
}

/// Whether no plan leads even to where it was a retreat and a half ago: what has closed is not the
/// way to the target, but the one behind it.
bool ReplanMachine::is_trapped(const GridView& grid, const MotionState& start) {
  const double back = 1.5 * config_.back_off_m;
  const auto before = std::find_if(track_.rbegin(), track_.rend(),
                                   [&](const Vec3& p) { return (p - start.p).norm() >= back; });
  if (before == track_.rend()) return false;
  PlanRequest request;
  request.start = start;
  request.goal = *before;
  request.may_graze = true;
  request.seed = seed_;
  return !bspline_.plan(grid, request).ok();
}

bool ReplanMachine::try_back_off(const GridView& grid, const MotionState& start, Stamp begin,
                                 Stamp now) {
  std::vector<Vec3> path{start.p};
  double length = 0;
  while (!track_.empty() && length < config_.back_off_m) {
    const Vec3 p = track_.back();
    if ((grid.at(p) & GridView::kOccupied) != 0) break;  // it was free when flown
    length += (p - path.back()).norm();
    path.push_back(p);
    track_.pop_back();
  }
  if (length < config_.track_spacing_m) return false;
  ++recoveries_[1];
  const LocalPlannerConfig& planner = bspline_.config();
  MotionLimits limits = planner.limits();
  limits.max_speed_mps = config_.back_off_speed_mps;
  Flight flight{time_path(round_corners(path, config_.track_spacing_m), start, limits,
                          planner.timing_knot_span_s),
                begin, begin};
  flight.recovery = true;
  adopt(std::move(flight));
  report(PlannerEventKind::kBackOff, now, cause_of(last_plan_.status));
  enter(ReplanState::kExecTraj, now);
  return true;
}

void ReplanMachine::stop(const GridView& grid, Stamp now, StuckCause cause) {
  const LocalPlannerConfig& planner = bspline_.config();
  const MotionState start = current_.state(now);
  const Vec3 towards = target_.value_or(start.p);
  const double dt = planner.timing_knot_span_s;
  auto free = bspline_.plan_stop(grid, start, planner.limits(), towards);
  Flight flight{free ? *std::move(free) : widest_stop(grid, start, planner.limits(), dt), now, now};
  flight.recovery = true;
  adopt(std::move(flight));
  advance(now);  // a stop does not wait for the modelled planning time
  enter(ReplanState::kEmergencyStop, now);
  ++counts_.emergency_stops;
  report(PlannerEventKind::kEmergencyStop, now, cause);
}

void ReplanMachine::give_up(StuckCause cause, Stamp now) {
  cause_ = cause;
  report(PlannerEventKind::kAskForTarget, now, cause);
}

void ReplanMachine::turn(const MotionState& state, Stamp now) {
  const Stamp before = std::exchange(last_setpoint_, now);
  if (before == 0 || now <= before) return;
  if (yaw_planner_.mode() == YawMode::kTowardsTarget) {
    if (target_) heading_ = {yaw_planner_.towards(state.p, *target_, heading_.yaw_rad), 0.0};
    return;
  }
  const double t = std::max(0.0, current_.time(now));
  const double wanted = current_.recovery
                            ? heading_.yaw_rad
                            : yaw_planner_.wanted(current_.spline, t, heading_.yaw_rad);
  heading_ = yaw_planner_.step(heading_, wanted, to_seconds(now - before));
}

TrajectorySetpoint ReplanMachine::setpoint(Stamp now, double force_lag_s) {
  advance(now);
  TrajectorySetpoint setpoint;
  if (current_.spline.empty()) return setpoint;
  const MotionState state = current_.state(now);
  turn(state, now);
  setpoint.p_OB = state.p;
  setpoint.v_OB = state.v;
  const Stamp acts = now + from_seconds(force_lag_s);
  setpoint.a_OB = (next_ && acts >= next_->takes_over ? *next_ : current_).state(acts).a;
  setpoint.yaw_rad = heading_.yaw_rad;
  setpoint.yaw_rate_radps = heading_.rate_radps;
  return setpoint;
}

}  // namespace arex
