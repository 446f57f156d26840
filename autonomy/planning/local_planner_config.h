#pragma once

#include "planning/anchors.h"
#include "planning/lbfgs_minimiser.h"
#include "planning/path_timing.h"

namespace arex {

/// Parameters of the local planner. Defaults from EGO-Planner (autonomy/README.md) unless noted.
struct LocalPlannerConfig {
  double max_speed_mps = 2.0;
  double max_acceleration_mps2 = 3.0;
  double max_jerk_mps3 = 4.0;
  double limit_tolerance = 0.04;  ///< on norms; the requirement is 5 %
  double control_point_distance_m = 0.4;
  double knot_span_ratio = 1.2;       ///< knot span = ratio * distance / speed
  double initial_speed_share = 0.85;  ///< leaves room for detours; tests/bench/planning

  double weight_smoothness = 1.0;   ///< lambda_s dt^-6: the published weight is per knot span
  double weight_collision = 0.5;    ///< lambda_c
  double weight_feasibility = 0.1;  ///< lambda_d
  double weight_fitness = 1.0;
  double safe_distance_m = 0.5;  ///< s_f
  double tight_share = 0.4;      ///< of s_f after the first rungs failed; tests/bench/planning
  double feasibility_threshold = 0.95;  ///< lambda of f
  double feasibility_junction = 1.5;    ///< c_j / c_m of f
  double weight_speed = 1.0;            ///< w_v
  double weight_acceleration = 1.0;     ///< w_a
  double weight_jerk = 0.001;           ///< w_j
  double fitness_along_m2 = 25.0;       ///< a^2
  double fitness_across_m2 = 1.0;       ///< b^2

  LbfgsConfig rebound{16, 60, 0.01};
  LbfgsConfig refine{16, 80, 0.001};
  int max_rebounds = 6;
  int random_starts = 1;
  double random_amplitude = 0.3;  ///< of the distance
  bool grid_fallback = true;
  SearchConfig search;

  double timing_knot_span_s = 0.05;   ///< of path-following splines
  double evasive_knot_span_s = 0.02;  ///< of stops for which that is too slow: half of it is lost
  double timing_jerk_mps3 = 30.0;     ///< build-up of acceleration along a path
  int timing_attempts = 5;

  double vehicle_radius_m = 0.305;  ///< handed down from vehicle.radius_m
  double max_goal_shift_m = 1.5;
  double leave_distance_m = 0.3;  ///< with the stopping distance: where the inflation is shrunk
  double escape_distance_m = 1.5;
  double escape_speed_mps = 0.5;
  bool stop_in_known_space = true;
  double unknown_speed_mps = 0.3;  ///< stops within the inflation
  double reaction_s = 0.1;         ///< between seeing and braking: one LiDAR frame

  [[nodiscard]] MotionLimits limits() const {
    return {max_speed_mps, max_acceleration_mps2, timing_jerk_mps3};
  }

  void fields(auto& f) {
    f("max_speed_mps", max_speed_mps, "limit of the speed's norm");
    f("max_acceleration_mps2", max_acceleration_mps2, "limit of the acceleration's norm");
    f("max_jerk_mps3", max_jerk_mps3, "jerk limit of the feasibility term");
    f("limit_tolerance", limit_tolerance, "share by which norms may exceed their limits");
    f("control_point_distance_m", control_point_distance_m, "between control points");
    f("knot_span_ratio", knot_span_ratio, "knot span = ratio * control point distance / speed");
    f("initial_speed_share", initial_speed_share, "of the speed limit for the initial path");
    f("weight_smoothness", weight_smoothness, "lambda_s in units of the knot span (paper)");
    f("weight_collision", weight_collision, "lambda_c (paper)");
    f("weight_feasibility", weight_feasibility, "lambda_d (paper)");
    f("weight_fitness", weight_fitness, "of keeping the shape in the refinement");
    f("safe_distance_m", safe_distance_m, "s_f, beyond the inflation (paper)");
    f("tight_share", tight_share, "of safe_distance_m once the first initial paths failed");
    f("feasibility_threshold", feasibility_threshold, "lambda of f (paper)");
    f("feasibility_junction", feasibility_junction, "c_j over c_m of f (paper)");
    f("weight_speed", weight_speed, "w_v (paper)");
    f("weight_acceleration", weight_acceleration, "w_a (paper)");
    f("weight_jerk", weight_jerk, "w_j (paper)");
    f("fitness_along_m2", fitness_along_m2, "a^2 of the refinement");
    f("fitness_across_m2", fitness_across_m2, "b^2 of the refinement");
    f("rebound", rebound, "minimisation of the rebound stage");
    f("refine", refine, "minimisation of the refine stage");
    f("max_rebounds", max_rebounds, "minimisations before an initial path is given up");
    f("random_starts", random_starts, "random polynomials tried");
    f("random_amplitude", random_amplitude, "sideways reach of those, share of the distance");
    f("grid_fallback", grid_fallback,
      "where the optimiser's own initial paths fail, a path of the grid search is optimised, then "
      "followed, slower; false: random initial paths only (EGO-Planner)");
    f("search", search, "A* budgets");
    f("timing_knot_span_s", timing_knot_span_s, "of path-following splines");
    f("evasive_knot_span_s", evasive_knot_span_s, "of stops for which that reacts too late");
    f("timing_jerk_mps3", timing_jerk_mps3, "build-up of acceleration along a path");
    f("timing_attempts", timing_attempts, "tries to time a path, each slower");
    f("max_goal_shift_m", max_goal_shift_m, "of a goal inside the inflation");
    f("leave_distance_m", leave_distance_m,
      "and the stopping distance: about a start in the inflation, shrunk to the room it has");
    f("escape_distance_m", escape_distance_m, "furthest way out of the inflation");
    f("escape_speed_mps", escape_speed_mps, "speed of an escape");
    f("stop_in_known_space", stop_in_known_space, "slow down before unknown cells");
    f("unknown_speed_mps", unknown_speed_mps, "speed at which unknown cells may be entered");
    f("reaction_s", reaction_s, "between seeing and braking");
    f.check(max_speed_mps >= 0.05 && max_speed_mps <= 50, "0.05 <= max_speed_mps <= 50");
    f.check(max_acceleration_mps2 >= 0.05 && max_acceleration_mps2 <= 200,
            "0.05 <= max_acceleration_mps2 <= 200");
    f.check(control_point_distance_m >= 0.05 && control_point_distance_m <= 10,
            "0.05 <= control_point_distance_m <= 10");
    f.check(knot_span_ratio > 0, "knot_span_ratio > 0");
    f.check(initial_speed_share > 0 && initial_speed_share <= 1, "0 < initial_speed_share <= 1");
    f.check(tight_share > 0 && tight_share <= 1, "0 < tight_share <= 1");
    f.check(safe_distance_m > 0, "safe_distance_m > 0");
    f.check(feasibility_threshold < feasibility_junction,
            "feasibility_threshold < feasibility_junction");
    f.check(leave_distance_m >= 0 && leave_distance_m <= 10, "0 <= leave_distance_m <= 10");
    f.check(max_rebounds >= 0 && max_rebounds <= 1000, "0 <= max_rebounds <= 1000");
    f.check(random_starts >= 0 && random_starts <= 1000, "0 <= random_starts <= 1000");
    f.check(timing_attempts >= 1 && timing_attempts <= 1000, "1 <= timing_attempts <= 1000");
    f.check(timing_jerk_mps3 > 0, "timing_jerk_mps3 > 0");
    f.check(max_goal_shift_m >= 0 && max_goal_shift_m <= 10, "0 <= max_goal_shift_m <= 10");
    f.check(escape_distance_m >= 0 && escape_distance_m <= 10, "0 <= escape_distance_m <= 10");
    f.check(escape_speed_mps > 0, "escape_speed_mps > 0");
    f.check(timing_knot_span_s >= 0.002 && timing_knot_span_s <= 1,
            "0.002 <= timing_knot_span_s <= 1");
    f.check(evasive_knot_span_s >= 0.002 && evasive_knot_span_s <= 1,
            "0.002 <= evasive_knot_span_s <= 1");
  }
};

}  // namespace arex
