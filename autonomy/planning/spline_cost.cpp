#include "planning/spline_cost.h"

namespace arex {
namespace {

/// j_c of the paper: zero, cubic, then quadratic beyond s_f.
double collision_penalty(double c, double s, double& slope) {
  if (c <= 0) {
    slope = 0;
    return 0;
  }
  if (c <= s) {
    slope = 3 * c * c;
    return c * c * c;
  }
  slope = 6 * s * c - 3 * s * s;
  return 3 * s * c * c - 3 * s * s * c + s * s * s;
}

/// Sum of f over the axes of c; its gradient in `slope`.
double penalise(const FeasibilityPenalty& f, const Vec3& c, Vec3& slope) {
  return f(c.x(), slope.x()) + f(c.y(), slope.y()) + f(c.z(), slope.z());
}

}  // namespace

double FeasibilityPenalty::operator()(double c, double& slope) const {
  const double magnitude = c < 0 ? -c : c, sign = c < 0 ? -1.0 : 1.0;
  if (magnitude <= threshold) {
    slope = 0;
    return 0;
  }
  const double excess = magnitude - threshold;
  if (magnitude < junction) {
    slope = sign * 3 * excess * excess;
    return excess * excess * excess;
  }
  // a2 c^2 + b2 c + c2 with the cubic's value, slope and curvature at c_j.
  const double at_junction = junction - threshold;
  const double a2 = 3 * at_junction;
  const double b2 = 3 * at_junction * at_junction - 2 * a2 * junction;
  const double c2 = at_junction * at_junction * at_junction - (a2 * junction + b2) * junction;
  slope = sign * (2 * a2 * magnitude + b2);
  return (a2 * magnitude + b2) * magnitude + c2;
}

double smoothness_cost(std::span<const Vec3> q, double dt, double weight,
                       std::span<Vec3> gradient) {
  const double per_acceleration = weight / (dt * dt * dt * dt);
  const double per_jerk = per_acceleration / (dt * dt);
  double cost = 0;
  for (std::size_t i = 0; i + 2 < q.size(); ++i) {
    const Vec3 bend = q[i + 2] - 2 * q[i + 1] + q[i];  // A_i dt^2
    cost += per_acceleration * bend.squaredNorm();
    const Vec3 g = 2 * per_acceleration * bend;
    gradient[i] += g;
    gradient[i + 1] -= 2 * g;
    gradient[i + 2] += g;
  }
  for (std::size_t i = 0; i + 3 < q.size(); ++i) {
    const Vec3 twist = q[i + 3] - 3 * q[i + 2] + 3 * q[i + 1] - q[i];  // J_i dt^3
    cost += per_jerk * twist.squaredNorm();
    const Vec3 g = 2 * per_jerk * twist;
    gradient[i] -= g;
    gradient[i + 1] += 3 * g;
    gradient[i + 2] -= 3 * g;
    gradient[i + 3] += g;
  }
  return cost;
}

double collision_cost(std::span<const Vec3> q, const Anchors& anchors, double safe_distance_m,
                      double weight, std::span<Vec3> gradient) {
  double cost = 0;
  for (std::size_t i = 0; i < q.size(); ++i) {
    for (const Anchor& anchor : anchors[i]) {
      const double d = (q[i] - anchor.p).dot(anchor.v);
      double slope = 0;
      cost += weight * collision_penalty(safe_distance_m - d, safe_distance_m, slope);
      gradient[i] -= weight * slope * anchor.v;
    }
  }
  return cost;
}

double feasibility_cost(std::span<const Vec3> q, double dt, const FeasibilityLimits& limits,
                        double weight, std::span<Vec3> gradient) {
  const double per_v = 1 / dt, per_a = per_v / dt, per_j = per_a / dt;
  double cost = 0;
  Vec3 slope;
  for (std::size_t i = 0; i + 1 < q.size(); ++i) {
    const double w = weight * limits.weight_speed;
    cost += w * penalise(limits.speed, (q[i + 1] - q[i]) * per_v, slope);
    const Vec3 g = w * per_v * slope;
    gradient[i] -= g;
    gradient[i + 1] += g;
  }
  for (std::size_t i = 0; i + 2 < q.size(); ++i) {
    const double w = weight * limits.weight_acceleration;
    cost += w * penalise(limits.acceleration, (q[i + 2] - 2 * q[i + 1] + q[i]) * per_a, slope);
    const Vec3 g = w * per_a * slope;
    gradient[i] += g;
    gradient[i + 1] -= 2 * g;
    gradient[i + 2] += g;
  }
  for (std::size_t i = 0; i + 3 < q.size(); ++i) {
    const double w = weight * limits.weight_jerk;
    cost +=
        w * penalise(limits.jerk, (q[i + 3] - 3 * q[i + 2] + 3 * q[i + 1] - q[i]) * per_j, slope);
    const Vec3 g = w * per_j * slope;
    gradient[i] -= g;
    gradient[i + 1] += 3 * g;
    gradient[i + 2] -= 3 * g;
    gradient[i + 3] += g;
  }
  return cost;
}

double fitness_cost(std::span<const Vec3> q, const FitnessReference& reference, double weight,
                    std::span<Vec3> gradient) {
  double cost = 0;
  for (std::size_t i = 1; i + 1 < q.size(); ++i) {
    const Vec3& t = reference.tangents[i - 1];
    const Vec3 e = (q[i - 1] + 4 * q[i] + q[i + 1]) / 6.0 - reference.points[i - 1];
    const double along = e.dot(t);
    const Vec3 across = e - along * t;
    cost += weight * (along * along / reference.along_squared +
                      across.squaredNorm() / reference.across_squared);
    const Vec3 g = weight * 2.0 *
                   (along / reference.along_squared * t + across / reference.across_squared) / 6.0;
    gradient[i - 1] += g;
    gradient[i] += 4 * g;
    gradient[i + 1] += g;
  }
  return cost;
}

}  // namespace arex
