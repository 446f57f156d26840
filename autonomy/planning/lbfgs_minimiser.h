#pragma once

#include <functional>
#include <span>
#include <vector>

#include "math/types.h"

namespace arex {

/// Budgets of one minimisation (EGO-Planner's published defaults, autonomy/README.md).
struct LbfgsConfig {
  int memory = 16;
  int max_iterations = 200;
  double gradient_tolerance = 0.01;  ///< on |g| / max(1, |x|)

  void fields(auto& f) {
    f("memory", memory, "corrections that L-BFGS keeps (EGO-Planner)");
    f("max_iterations", max_iterations, "iterations of one minimisation (EGO-Planner)");
    f("gradient_tolerance", gradient_tolerance, "stop when |g| / max(1, |x|) is below");
    f.check(memory >= 1 && memory <= 100, "1 <= memory <= 100");
    f.check(max_iterations >= 1 && max_iterations <= 10000, "1 <= max_iterations <= 10000");
    f.check(gradient_tolerance > 0, "gradient_tolerance > 0");
  }
};

struct MinimiseResult {
  double cost = 0;
  int iterations = 0;
  int evaluations = 0;
};

/// Cost of points x; writes the gradient, which arrives zeroed.
using PointCost = std::function<double(std::span<const Vec3> x, std::span<Vec3> gradient)>;

/// Minimises `cost` over the points x in place with liblbfgs. Deterministic; the budgets are
/// iterations, and x is the best point found when they run out.
MinimiseResult minimise(std::span<Vec3> x, const PointCost& cost, const LbfgsConfig& config);

}  // namespace arex
