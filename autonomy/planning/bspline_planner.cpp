#include "planning/bspline_planner.h"

#include <algorithm>
#include <cmath>

#include "math/random.h"
#include "planning/curve_check.h"
#include "planning/free_space.h"
#include "planning/quintic.h"
#include "planning/stopping.h"

namespace arex {
namespace {

constexpr double kPathSpacing = 0.02;     ///< m between points of an initial path
constexpr double kSlower = 0.8;           ///< between attempts to time a path
constexpr double kCollisionGrowth = 2.0;  ///< of lambda_c per rebound (EGO-Planner)
/// Corner roundings (m) tried for a path, from fast to close.
constexpr double kRoundings[] = {0.4, 0.25, 0.12, 0.05, 0.02};
constexpr double kShortcutMargins[] = {0.06, 0.01};
constexpr double kJoinRoundings[] = {0.25, 0.05};
constexpr double kJoins[] = {1.2, 0.8, 0.5};  ///< m ahead where a moving start joins a path
constexpr double kAllClearance = 1e3;         ///< m: the inflation may shrink to the true radius
constexpr double kAtRest = 1e-3;              ///< m/s, m/s^2

std::vector<Vec3> sample_quintic(const Quintic& motion, double length_m) {
  const int n = std::max(4, static_cast<int>(std::ceil(1.3 * length_m / kPathSpacing)));
  std::vector<Vec3> points;
  points.reserve(static_cast<std::size_t>(n) + 1);
  for (int i = 0; i <= n; ++i) points.push_back(motion.position(motion.duration_s() * i / n));
  return points;
}

/// The first spans, which the start's state decides.
UniformBspline leading_part(const UniformBspline& spline) {
  constexpr std::ptrdiff_t kLeading = 7;
  const auto& q = spline.control_points();
  return {{q.begin(), q.begin() + std::min(kLeading, std::ssize(q))}, spline.knot_span_s()};
}

}  // namespace

bool BsplinePlanner::within_limits(const UniformBspline& spline, const MotionState& start,
                                   const MotionLimits& limits) const {
  // A start beyond the limits cannot be undone at once; nothing may go further.
  const double slack = 1.0 + config_.limit_tolerance;
  return spline.speed_bound() <= std::max(slack * limits.max_speed_mps, start.v.norm() + 1e-6) &&
         spline.acceleration_bound() <=
             std::max(slack * limits.max_acceleration_mps2, start.a.norm() + 1e-6);
}

std::vector<Vec3> BsplinePlanner::polynomial_path(const PlanRequest& request) const {
  const double distance = (request.goal - request.start.p).norm();
  const double speed = config_.limits().max_speed_mps;
  const double duration = distance / speed + speed / config_.max_acceleration_mps2;
  return sample_quintic(
      Quintic(request.start, {request.goal, Vec3::Zero(), Vec3::Zero()}, duration), distance);
}

std::vector<Vec3> BsplinePlanner::previous_path(const PlanRequest& request) const {
  std::vector<Vec3> path = sample_path(*request.previous, kPathSpacing, request.previous_time_s);
  path.front() = request.start.p;
  if ((path.back() - request.goal).norm() > kPathSpacing) {
    path.push_back(request.goal);
    path = round_corners(path, config_.control_point_distance_m / 2);
    path.front() = request.start.p;
  }
  return path;
}

std::vector<Vec3> BsplinePlanner::random_path(const PlanRequest& request, int index) const {
  RandomStream random =
      RandomStream(request.seed, "planning.random_start").fork(static_cast<std::uint64_t>(index));
  std::vector<Vec3> path = polynomial_path(request);
  const Vec3 way = request.goal - request.start.p;
  const double distance = way.norm();
  Vec3 offset = random.normal3();
  offset.z() *= 0.3;  // the grid is flat
  if (distance > 1e-6) offset -= offset.dot(way) / (distance * distance) * way;
  offset *= config_.random_amplitude * distance;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const double tau = static_cast<double>(i) / static_cast<double>(path.size() - 1);
    const double bump = 4 * tau * (1 - tau);
    path[i] += bump * bump * bump * offset;  // twice differentiable, flat at both ends
  }
  return path;
}

void BsplinePlanner::optimise(std::vector<Vec3>& q, double dt, const Anchors& anchors,
                              const FitnessReference* reference, double collision_scale,
                              double safe_distance_m, const LbfgsConfig& budget,
                              PlanDiagnostics& diagnostics) {
  if (q.size() < 7) return;
  const FeasibilityLimits feasibility{
      {config_.max_speed_mps, config_.feasibility_threshold, config_.feasibility_junction},
      {config_.max_acceleration_mps2, config_.feasibility_threshold, config_.feasibility_junction},
      {config_.max_jerk_mps3, config_.feasibility_threshold, config_.feasibility_junction},
      config_.weight_speed,
      config_.weight_acceleration,
      config_.weight_jerk};
  const double lambda_s = config_.weight_smoothness * std::pow(dt, 6);
  const std::size_t free = q.size() - 6;  // three at each end hold the boundary states
  std::vector<Vec3> gradient(q.size());
  std::vector<Vec3> x(q.begin() + 3, q.end() - 3);
  const MinimiseResult result = minimise(
      x,
      [&](std::span<const Vec3> at, std::span<Vec3> g) {
        std::copy(at.begin(), at.end(), q.begin() + 3);
        std::fill(gradient.begin(), gradient.end(), Vec3::Zero());
        double cost = smoothness_cost(q, dt, lambda_s, gradient);
        cost += collision_cost(q, anchors, safe_distance_m,
                               collision_scale * config_.weight_collision, gradient);
        cost += feasibility_cost(q, dt, feasibility, config_.weight_feasibility, gradient);
        if (reference) cost += fitness_cost(q, *reference, config_.weight_fitness, gradient);
        std::copy_n(gradient.begin() + 3, free, g.begin());
        return cost;
      },
      budget);
  std::copy(x.begin(), x.end(), q.begin() + 3);
  diagnostics.iterations += result.iterations;
  diagnostics.evaluations += result.evaluations;
}

std::optional<UniformBspline> BsplinePlanner::rebound(const GridView& grid,
                                                      const PlanRequest& request,
                                                      const std::vector<Vec3>& path, double dt,
                                                      double safe_distance_m,
                                                      PlanDiagnostics& diagnostics) {
  MotionLimits slower = config_.limits();
  slower.max_speed_mps *= config_.initial_speed_share;
  UniformBspline spline = time_path(path, request.start, slower, dt);
  Anchors anchors(spline.control_points().size());
  double collision_scale = 1.0;
  for (int k = 0; k <= config_.max_rebounds; ++k) {
    const std::vector<TimeInterval> collisions = find_collisions(grid, spline);
    if (k > 0 && collisions.empty()) return spline;
    if (k == config_.max_rebounds) break;
    AnchorReport report;
    const bool detoured =
        add_anchors(grid, spline, collisions, config_.search, astar_, anchors, report);
    diagnostics.astar_searches += report.searches;
    diagnostics.astar_expansions += report.expansions;
    diagnostics.anchors_dropped += report.dropped;
    if (!detoured) break;
    std::vector<Vec3> q = spline.control_points();
    optimise(q, dt, anchors, nullptr, collision_scale, safe_distance_m, config_.rebound,
             diagnostics);
    ++diagnostics.rebounds;
    spline = UniformBspline(std::move(q), dt);
    collision_scale *= kCollisionGrowth;
  }
  return std::nullopt;
}

std::optional<UniformBspline> BsplinePlanner::refine(const GridView& grid,
                                                     const UniformBspline& spline,
                                                     const PlanRequest& request,
                                                     PlanDiagnostics& diagnostics) {
  const MotionLimits limit = config_.limits();
  const double ratio =
      std::max({1.0, spline.speed_bound() / limit.max_speed_mps,
                std::sqrt(spline.acceleration_bound() / limit.max_acceleration_mps2)});
  std::vector<Vec3> q = spline.control_points();
  const double dt = spline.knot_span_s() * ratio;
  FitnessReference reference{{}, {}, config_.fitness_along_m2, config_.fitness_across_m2};
  for (std::size_t i = 1; i + 1 < q.size(); ++i) {
    const Vec3 along = q[i + 1] - q[i - 1];
    reference.points.push_back((q[i - 1] + 4 * q[i] + q[i + 1]) / 6.0);
    reference.tangents.push_back(along.norm() > 1e-9 ? Vec3(along.normalized()) : Vec3::UnitX());
  }
  // The start's state is given, so its control points move with the knot span.
  const auto head = UniformBspline::boundary(request.start, dt);
  std::copy(head.begin(), head.end(), q.begin());
  optimise(q, dt, Anchors(q.size()), &reference, 0.0, config_.safe_distance_m, config_.refine,
           diagnostics);
  diagnostics.reallocated = true;
  UniformBspline refined(std::move(q), dt);
  if (!within_limits(refined, request.start, limit) || first_collision(grid, refined)) {
    return std::nullopt;
  }
  return refined;
}

std::optional<UniformBspline> BsplinePlanner::time_within_limits(
    const GridView& grid, const std::vector<Vec3>& path, const MotionState& start,
    const MotionLimits& limit, double knot_span_s, const SpeedCap& cap) const {
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    if (!is_segment_free(grid, path[i], path[i + 1])) return std::nullopt;
  }
  MotionLimits tried = limit;
  for (int k = 0; k < config_.timing_attempts; ++k) {
    UniformBspline timed = time_path(path, start, tried, knot_span_s, cap);
    const bool within = within_limits(timed, start, limit);
    if (within && !first_collision(grid, timed)) return timed;
    // What is wrong at the start follows from the start's own state: slower does not mend it.
    if (!within && !within_limits(leading_part(timed), start, limit)) break;
    tried.max_acceleration_mps2 *= kSlower;
    tried.max_speed_mps *= kSlower;
  }
  return std::nullopt;
}

std::optional<UniformBspline> BsplinePlanner::bring_within_limits(const GridView& grid,
                                                                  const UniformBspline& spline,
                                                                  const PlanRequest& request,
                                                                  PlanDiagnostics& diagnostics) {
  const MotionLimits limit = config_.limits();
  if (within_limits(spline, request.start, limit)) return spline;
  if (auto refined = refine(grid, spline, request, diagnostics)) return refined;
  auto timed = time_within_limits(grid, sample_path(spline, kPathSpacing), request.start, limit,
                                  config_.timing_knot_span_s);
  diagnostics.retimed = timed.has_value();
  return timed;
}

AstarResult BsplinePlanner::guide(const GridView& grid, const Vec3& from, const Vec3& goal,
                                  PlanDiagnostics& diagnostics) {
  const SearchConfig& search = config_.search;
  AstarResult result;
  for (const AstarOptions& options :
       {AstarOptions{search.level_max_expansions, -1, search.level_height_cells, false, true},
        AstarOptions{search.max_expansions, -1, -1, false, true}}) {
    result = astar_.search(grid, grid.cell_of(from), grid.cell_of(goal), options);
    ++diagnostics.astar_searches;
    diagnostics.astar_expansions += result.expansions;
    if (result.status == AstarStatus::kFound) break;
  }
  if (result.status == AstarStatus::kFound) {
    // Start and goal are tied to the centres of their cells: a straight line from elsewhere in the
    // cell to the next centre may cut a blocked corner.
    if (result.path.size() == 1) result.path.clear();
    result.path.insert(result.path.begin(), from);
    result.path.push_back(goal);
  }
  return result;
}

/// Leaves in the direction of flight and joins the path `reach_m` further on, at rest in neither
/// direction nor curvature.
std::vector<Vec3> BsplinePlanner::join_path(const MotionState& start, std::span<const Vec3> path,
                                            double reach_m) {
  const std::vector<Vec3> points = resample(path, kPathSpacing);
  const auto join = std::min(points.size() - 2, static_cast<std::size_t>(reach_m / kPathSpacing));
  const Vec3 along = (points[join + 1] - points[join]).normalized();
  const double speed = start.v.norm();
  const double duration = reach_m / speed;
  const Quintic lead(start, {points[join], speed * along, Vec3::Zero()}, duration);
  std::vector<Vec3> joined = sample_quintic(lead, reach_m);
  joined.insert(joined.end(), points.begin() + static_cast<std::ptrdiff_t>(join) + 1, points.end());
  return joined;
}

std::optional<UniformBspline> BsplinePlanner::follow_path(const GridView& grid,
                                                          const std::vector<Vec3>& path,
                                                          const MotionState& start,
                                                          const MotionLimits& limit,
                                                          double knot_span_s) const {
  for (const double margin : kShortcutMargins) {
    const std::vector<Vec3> corners = shortcut(grid, path, margin);
    for (const double rounding : kRoundings) {
      if (auto timed = time_within_limits(grid, round_corners(corners, rounding), start, limit,
                                          knot_span_s)) {
        return timed;
      }
    }
  }
  return std::nullopt;
}

std::optional<UniformBspline> BsplinePlanner::join_and_follow(const GridView& grid,
                                                              const std::vector<Vec3>& path,
                                                              const MotionState& start,
                                                              const MotionLimits& limit) const {
  const std::vector<Vec3> corners = shortcut(grid, path, kShortcutMargins[0]);
  for (const double rounding : kJoinRoundings) {
    const std::vector<Vec3> rounded = round_corners(corners, rounding);
    for (const double reach : kJoins) {
      const auto joined = join_path(start, rounded, reach);
      if (auto timed = time_within_limits(grid, joined, start, limit, config_.timing_knot_span_s))
        return timed;
    }
  }
  return std::nullopt;
}

std::optional<UniformBspline> BsplinePlanner::plan_stop(const GridView& grid,
                                                        const MotionState& state,
                                                        const MotionLimits& limit,
                                                        const Vec3& towards) const {
  if (auto stop = find_stop(grid, state, limit, config_.timing_knot_span_s, towards)) return stop;
  MotionLimits all = limit;
  all.max_acceleration_mps2 *= 1.0 + config_.limit_tolerance;
  const double dt = config_.evasive_knot_span_s;
  return find_stop(grid, state, all, dt, towards);
}

std::optional<UniformBspline> BsplinePlanner::stop_and_follow(const GridView& grid,
                                                              const PlanRequest& request,
                                                              PlanDiagnostics& diagnostics) {
  const auto stop = plan_stop(grid, request.start, config_.limits(), request.goal);
  if (!stop) return std::nullopt;
  const MotionState rest{stop->control_points().back(), Vec3::Zero(), Vec3::Zero()};
  const AstarResult way = guide(grid, rest.p, request.goal, diagnostics);
  if (way.status != AstarStatus::kFound) return std::nullopt;
  const auto follow = follow_path(grid, way.path, rest, config_.limits(), stop->knot_span_s());
  if (!follow) return std::nullopt;
  std::vector<Vec3> q = stop->control_points();  // ends with the three that the next begins with
  q.insert(q.end(), follow->control_points().begin() + 3, follow->control_points().end());
  UniformBspline whole(std::move(q), stop->knot_span_s());
  if (first_collision(grid, whole)) return std::nullopt;
  return whole;
}

void BsplinePlanner::climb_ladder(const GridView& grid, const PlanRequest& request,
                                  PlanResult& result) {
  PlanDiagnostics& diagnostics = result.diagnostics;
  const MotionLimits limit = config_.limits();
  const double dt =
      config_.knot_span_ratio * config_.control_point_distance_m / limit.max_speed_mps;
  bool found_free = false;
  const auto accept = [&](PlanStage stage, std::optional<UniformBspline> spline) {
    if (!spline) return false;
    result.status = PlanStatus::kOk;
    result.trajectory = *std::move(spline);
    diagnostics.stage = stage;
    return true;
  };
  const auto attempt = [&](PlanStage stage, const std::vector<Vec3>& path, double safe_distance) {
    ++diagnostics.attempts;
    const auto free = rebound(grid, request, path, dt, safe_distance, diagnostics);
    found_free |= free.has_value();
    return free && accept(stage, bring_within_limits(grid, *free, request, diagnostics));
  };

  if (request.previous && !request.previous->empty() &&
      attempt(PlanStage::kPrevious, previous_path(request), config_.safe_distance_m)) {
    return;
  }
  if (attempt(PlanStage::kPolynomial, polynomial_path(request), config_.safe_distance_m)) return;

  // The complete search: it gives the next initial path and decides whether there is a way at all.
  const AstarResult way = guide(grid, request.start.p, request.goal, diagnostics);
  if (way.status != AstarStatus::kFound) {
    result.status = PlanStatus::kNoPath;
    return;
  }
  // Where the first rungs failed it is tight: ask for less room.
  const double tight = config_.tight_share * config_.safe_distance_m;
  if (config_.grid_fallback) {
    const std::vector<Vec3> corners = shortcut(grid, way.path, kShortcutMargins[0]);
    const std::vector<Vec3> guided = round_corners(corners, config_.control_point_distance_m);
    if (attempt(PlanStage::kGuided, guided, tight)) return;
    if (request.start.v.norm() > kAtRest || request.start.a.norm() > kAtRest) {
      auto joined = join_and_follow(grid, way.path, request.start, limit);
      if (accept(PlanStage::kPathFollowing, std::move(joined))) return;
      if (accept(PlanStage::kStopAndFollow, stop_and_follow(grid, request, diagnostics))) return;
    } else if (accept(PlanStage::kPathFollowing, follow_path(grid, way.path, request.start, limit,
                                                             config_.timing_knot_span_s))) {
      return;
    }
  }
  for (int i = 0; i < config_.random_starts; ++i) {
    if (attempt(PlanStage::kRandom, random_path(request, i), tight)) return;
  }
  result.status = found_free ? PlanStatus::kRefineRejected : PlanStatus::kOptimiserFailed;
}

void BsplinePlanner::slow_down(const GridView& grid, const PlanRequest& request,
                               PlanResult& result) {
  const double slower = request.max_speed_mps > 0 ? request.max_speed_mps : config_.max_speed_mps;
  KnownPrefix prefix{0, 0, true};
  if (config_.stop_in_known_space) {
    prefix = known_prefix(grid, result.trajectory, 0.0, config_.vehicle_radius_m);
  }
  if (prefix.whole && slower >= config_.max_speed_mps) return;
  const double braking = 0.8 * config_.max_acceleration_mps2;
  const auto cap = [&](double s) {
    if (prefix.whole) return slower;
    return std::min(slower,
                    std::max(config_.unknown_speed_mps,
                             stoppable_speed(prefix.length_m - s, braking, config_.reaction_s)));
  };
  std::vector<Vec3> path = sample_path(result.trajectory, kPathSpacing);
  if (!prefix.whole && config_.unknown_speed_mps <= 0) {  // not entered: come to rest before it
    double length = 0;
    std::size_t end = 1;
    while (end < path.size() && length < prefix.length_m) {
      length += (path[end] - path[end - 1]).norm();
      ++end;
    }
    path.resize(std::max<std::size_t>(2, end - 1));
    result.goal = path.back();
  }
  result.diagnostics.slowed = !prefix.whole;
  if (auto slowed = time_within_limits(grid, path, request.start, config_.limits(),
                                       config_.timing_knot_span_s, cap)) {
    result.trajectory = *std::move(slowed);
    return;
  }
  if (prefix.whole) return;  // it is free all the same
  // Too fast already for the unknown: brake as hard as the limits allow.
  auto stop = plan_stop(grid, request.start, config_.limits(), request.goal);
  if (stop) {
    result.trajectory = *std::move(stop);
    result.goal = result.trajectory.control_points().back();
    result.diagnostics.braked = true;
  } else {
    result.trajectory = {};
    result.status = PlanStatus::kRefineRejected;
  }
}

PlanResult BsplinePlanner::plan(const GridView& grid, const PlanRequest& request) {
  const bool blocked = is_blocked(grid, request.start.p);
  if (blocked &&
      clearance(grid, request.start.p, config_.vehicle_radius_m) < config_.vehicle_radius_m) {
    PlanResult result;
    result.status = PlanStatus::kStartInInflation;
    result.goal = request.goal;
    return result;
  }
  PlanResult result = blocked ? plan_through_inflation(grid, request, grid.resolution_m)
                              : plan_from_free(grid, request);
  const bool no_spline =
      result.status == PlanStatus::kOptimiserFailed || result.status == PlanStatus::kRefineRejected;
  const bool in_need = blocked || request.start.v.norm() > kAtRest;
  if (!no_spline || !request.may_graze || !in_need) return result;
  PlanResult grazing = plan_through_inflation(grid, request, kAllClearance);
  return grazing.ok() ? grazing : result;
}

PlanResult BsplinePlanner::plan_through_inflation(const GridView& grid, const PlanRequest& request,
                                                  double yield_m) {
  const double reach =
      config_.leave_distance_m +
      stopping_distance(request.start.v.norm(), config_.max_acceleration_mps2, 0.0);
  PlanResult result = plan_from_free(
      shrunk_.around(grid, request.start.p, reach, config_.vehicle_radius_m, yield_m), request);
  result.diagnostics.start_inflated = true;
  return result;
}

PlanResult BsplinePlanner::plan_from_free(const GridView& grid, const PlanRequest& request) {
  PlanResult result;
  result.goal = request.goal;
  if (is_blocked(grid, request.start.p)) {  // outside the grid, or in an obstacle
    result.status = PlanStatus::kStartInInflation;
    return result;
  }
  PlanRequest shifted = request;
  if (is_blocked(grid, request.goal)) {
    const auto goal =
        nearest_free_goal(grid, request.start.p, request.goal, config_.max_goal_shift_m);
    if (!goal) {
      result.status = PlanStatus::kGoalInInflation;
      return result;
    }
    result.goal = shifted.goal = *goal;
    result.diagnostics.goal_shifted = true;
  }
  climb_ladder(grid, shifted, result);
  if (result.ok()) slow_down(grid, shifted, result);
  return result;
}

PlanResult BsplinePlanner::plan_escape(const GridView& grid, const MotionState& start) {
  PlanResult result;
  result.status = PlanStatus::kStartInInflation;
  result.goal = start.p;
  const std::vector<Vec3> path =
      escape_path(grid, start.p, config_.vehicle_radius_m, config_.escape_distance_m);
  if (path.size() < 2) return result;
  MotionLimits limit = config_.limits();
  limit.max_speed_mps = std::max(config_.escape_speed_mps, start.v.norm());
  result.trajectory =
      time_path(round_corners(path, grid.resolution_m), start, limit, config_.timing_knot_span_s);
  result.goal = path.back();
  result.status = PlanStatus::kOk;
  result.diagnostics.stage = PlanStage::kEscape;
  return result;
}

}  // namespace arex
