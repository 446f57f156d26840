#pragma once

#include <span>
#include <vector>

#include "math/types.h"

/// The cost J = lambda_s J_s + lambda_c J_c + lambda_d J_d of the paper's local planner (eq.
/// (15)) over the control points Q of a uniform cubic B-spline, and the fitness term of
/// the refinement. Each function returns weight * J and adds weight * dJ/dQ to `gradient`, which
/// has the size of `q`.
namespace arex {

/// One {p, v} pair of a control point: p lies on the surface of an obstacle and v (unit) points out
/// of it; d = (Q - p) . v is the distance to the obstacle (paper, eq. (14)).
struct Anchor {
  Vec3 p = Vec3::Zero();
  Vec3 v = Vec3::UnitX();
};
using Anchors = std::vector<std::vector<Anchor>>;  ///< one list per control point

/// f of the feasibility penalty (paper, eq. (22)): zero up to lambda c_m, then cubic, from c_j on
/// quadratic; the pieces meet in value, slope and curvature.
struct FeasibilityPenalty {
  double threshold;  ///< lambda c_m
  double junction;   ///< c_j

  /// @param limit c_m
  /// @param tolerance lambda < 1
  /// @param junction_ratio c_j / c_m
  FeasibilityPenalty(double limit, double tolerance, double junction_ratio)
      : threshold(tolerance * limit), junction(junction_ratio * limit) {}
  /// f(c), and f'(c) in `slope`.
  double operator()(double c, double& slope) const;
};

/// Limits of the feasibility term, per axis as printed.
struct FeasibilityLimits {
  FeasibilityPenalty speed, acceleration, jerk;
  double weight_speed, weight_acceleration, weight_jerk;  ///< w_v, w_a, w_j
};

/// What the refinement holds on to: where the curve was at each interior knot, and its direction.
struct FitnessReference {
  std::vector<Vec3> points;    ///< of B_i = (Q_{i-1} + 4 Q_i + Q_{i+1}) / 6, i = 1 .. n-2
  std::vector<Vec3> tangents;  ///< unit
  double along_squared;        ///< a^2, m^2: forgiving along the path
  double across_squared;       ///< b^2, m^2: strict across it
};

/// J_s = sum |A_i|^2 + sum |J_i|^2 (paper, eq. (17)).
double smoothness_cost(std::span<const Vec3> q, double knot_span_s, double weight,
                       std::span<Vec3> gradient);

/// J_c = sum over control points and their anchors of j_c(s_f - d) (paper, eqs. (18)-(19)).
double collision_cost(std::span<const Vec3> q, const Anchors& anchors, double safe_distance_m,
                      double weight, std::span<Vec3> gradient);

/// J_d = sum w_v F(V_i) + sum w_a F(A_i) + sum w_j F(J_i), F(C) = f(C_x) + f(C_y) + f(C_z)
/// (paper, eqs. (20)-(21)).
double feasibility_cost(std::span<const Vec3> q, double knot_span_s,
                        const FeasibilityLimits& limits, double weight, std::span<Vec3> gradient);

/// J_f = sum (e_along^2 / a^2 + e_across^2 / b^2), e = B_i - reference_i.
double fitness_cost(std::span<const Vec3> q, const FitnessReference& reference, double weight,
                    std::span<Vec3> gradient);

}  // namespace arex
