#include "planning/lbfgs_minimiser.h"

#include <lbfgs.h>

#include <algorithm>
#include <memory>
#include <new>

namespace arex {
namespace {

/// The SSE build of liblbfgs wants multiples of 8; spare variables have no gradient and stay zero.
constexpr int kMultiple = 8;
constexpr int kMaxLineSearchSteps = 20;

struct Problem {
  const PointCost& cost;
  std::size_t points;
  MinimiseResult result;
};

double evaluate(void* instance, const double* x, double* g, const int n, const double /*step*/) {
  auto& problem = *static_cast<Problem*>(instance);
  ++problem.result.evaluations;
  std::fill(g, g + n, 0.0);
  // Vec3 is three packed doubles.
  static_assert(sizeof(Vec3) == 3 * sizeof(double));
  return problem.cost({reinterpret_cast<const Vec3*>(x), problem.points},
                      {reinterpret_cast<Vec3*>(g), problem.points});
}

int report(void* instance, const double*, const double*, const double, const double, const double,
           const double, int, int iteration, int) {
  static_cast<Problem*>(instance)->result.iterations = iteration;
  return 0;
}

}  // namespace

MinimiseResult minimise(std::span<Vec3> x, const PointCost& cost, const LbfgsConfig& config) {
  Problem problem{cost, x.size(), {}};
  if (x.empty()) return problem.result;
  const int variables = 3 * static_cast<int>(x.size());
  const int padded = (variables + kMultiple - 1) / kMultiple * kMultiple;
  std::unique_ptr<double, void (*)(double*)> buffer(lbfgs_malloc(padded), lbfgs_free);
  if (!buffer) throw std::bad_alloc();
  std::fill(buffer.get(), buffer.get() + padded, 0.0);
  std::copy_n(x.front().data(), variables, buffer.get());

  lbfgs_parameter_t parameters;
  lbfgs_parameter_init(&parameters);
  parameters.m = config.memory;
  parameters.max_iterations = config.max_iterations;
  parameters.epsilon = config.gradient_tolerance;
  parameters.max_linesearch = kMaxLineSearchSteps;
  // Every return code leaves the best point so far in the buffer; the caller checks the curve
  // itself.
  (void)lbfgs(padded, buffer.get(), &problem.result.cost, evaluate, report, &problem, &parameters);
  std::copy_n(buffer.get(), variables, x.front().data());
  return problem.result;
}

}  // namespace arex
