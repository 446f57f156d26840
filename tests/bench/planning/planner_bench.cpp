/// Random pillar fields (support/pillar_field.h): success, limits and time of the local planner.
///
///     planner_bench [cases per setting] [seed] [folder]
///
/// With a folder each failed or slow case is listed, and failed ones and the first few are written
/// there: the grid's middle layer, then the flown points.
///
/// A case counts as solved when the planner says ok and the trajectory, checked every 1 ms to its
/// very end, touches no inflated cell; the denominator is the cases that a complete 3D A* (26-
/// connected, corners may be cut, no budget) solves. Times are single-thread CPU time of plan().
/// Cruise cases start at 1.5 m/s towards the goal, whatever stands there. Of some it is proven that
/// no motion within the limits plus 5 % avoids the inflation (support/unavoidable.h): the second
/// share leaves these out, nothing else.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "planning/bspline_planner.h"
#include "support/pillar_field.h"
#include "support/unavoidable.h"

namespace {

using namespace arex;

constexpr double kDistance_m = 7.5;
constexpr double kCruise_mps = 1.5;
constexpr double kTolerance = 1.05;  ///< of the limits, as required
constexpr int kShown = 6;            ///< first cases written in any event
constexpr double kSlow_ms = 8.0;     ///< listed

double cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

struct Tally {
  int solvable = 0, solved = 0, impossible = 0;
  double max_speed = 0, max_acceleration = 0, worst_boundary = 0, slowness = 0;
  std::vector<double> ms;
  std::map<std::string_view, int> stages, failures;
};

bool touches(const GridView& grid, const UniformBspline& spline, Tally& tally) {
  bool touched = false;
  const int steps = static_cast<int>(spline.duration_s() / 1e-3) + 1;
  for (int k = 0; k <= steps; ++k) {
    const MotionState state = spline.state(1e-3 * k);
    touched |= grid.inflated(state.p) || !grid.contains(grid.cell_of(state.p));
    tally.max_speed = std::max(tally.max_speed, state.v.norm());
    tally.max_acceleration = std::max(tally.max_acceleration, state.a.norm());
  }
  return touched;
}

void dump(const support::PillarField& field, const UniformBspline& spline,
          const std::string& name) {
  if (std::FILE* file = std::fopen(name.c_str(), "w")) {
    const GridView grid = field.view();
    std::fprintf(file, "%d %d %g\n", grid.size.x(), grid.size.y(), grid.resolution_m);
    for (int x = 0; x < grid.size.x(); ++x) {
      for (int y = 0; y < grid.size.y(); ++y) {
        std::fputc('0' + (grid.cells[grid.index({x, y, 15})] & 3), file);
      }
      std::fputc('\n', file);
    }
    for (double t = 0; t < spline.duration_s(); t += 0.01) {
      const Vec3 p = spline.position(t);
      std::fprintf(file, "%g %g %g\n", p.x(), p.y(), p.z());
    }
    std::fclose(file);
  }
}

void run(int pillars, double inflation, bool cruise, int cases, std::uint64_t seed,
         const std::string& folder) {
  const bool verbose = !folder.empty();
  LocalPlannerConfig config;
  BsplinePlanner planner(config);
  GridAstar oracle;
  Tally tally;
  support::PillarFieldOptions options;
  options.pillars = pillars;
  options.inflation_m = inflation;
  for (int i = 0; i < cases; ++i) {
    const auto index = static_cast<std::uint64_t>(i);
    const support::PillarField field(options, seed, index);
    const GridView grid = field.view();
    const auto drawn =
        support::draw_case(grid, RandomStream(seed, "pillar_case").fork(index), kDistance_m);
    if (!drawn.valid) continue;
    const auto way = oracle.search(grid, grid.cell_of(drawn.start), grid.cell_of(drawn.goal),
                                   {1 << 30, -1, -1, true, false});
    if (way.status != AstarStatus::kFound) continue;
    PlanRequest request;
    request.start.p = drawn.start;
    request.goal = drawn.goal;
    request.seed = seed + index;
    if (cruise) request.start.v = kCruise_mps * (drawn.goal - drawn.start).normalized();
    const double begin = cpu_seconds();
    const PlanResult result = planner.plan(grid, request);
    const double ms = 1e3 * (cpu_seconds() - begin);
    tally.ms.push_back(ms);
    const bool touched = result.ok() && touches(grid, result.trajectory, tally);
    const bool solved = result.ok() && !touched;
    const bool impossible =
        !solved && support::is_collision_unavoidable(grid, request.start.p, request.start.v,
                                                     kTolerance * config.max_acceleration_mps2);
    if (result.ok()) {
      tally.worst_boundary =
          std::max({tally.worst_boundary, (result.trajectory.position(0) - request.start.p).norm(),
                    (result.trajectory.velocity(0) - request.start.v).norm(),
                    (result.trajectory.position(1e9) - request.goal).norm()});
      tally.slowness += result.trajectory.duration_s();
    }
    ++tally.solvable;
    tally.solved += solved;
    tally.impossible += impossible;
    ++tally.stages[to_string(result.diagnostics.stage)];
    if (!solved && !impossible) ++tally.failures[touched ? "touched" : to_string(result.status)];
    if (verbose && ((!solved && !impossible) || ms > kSlow_ms)) {
      const PlanDiagnostics& d = result.diagnostics;
      std::printf(
          "  case %d: %s stage %s %.2f ms attempts %d rebounds %d it %d ev %d astar %d/%d\n", i,
          std::string(to_string(result.status)).c_str(), std::string(to_string(d.stage)).c_str(),
          ms, d.attempts, d.rebounds, d.iterations, d.evaluations, d.astar_searches,
          d.astar_expansions);
    }
    if (verbose && (i < kShown || (!solved && !impossible))) {
      const UniformBspline line(
          {drawn.start, drawn.start, drawn.start, drawn.goal, drawn.goal, drawn.goal}, 1.0);
      dump(field, result.ok() ? result.trajectory : line,
           folder + "/" + std::to_string(pillars) + "_" + std::to_string(inflation).substr(0, 3) +
               (cruise ? "_cruise_" : "_rest_") + std::to_string(i) + ".txt");
    }
  }
  std::sort(tally.ms.begin(), tally.ms.end());
  const auto at = [&](double q) {
    return tally.ms[static_cast<std::size_t>(q * static_cast<double>(tally.ms.size() - 1))];
  };
  std::printf(
      "%3d pillars, %.1f m, %-6s: %d/%d = %.2f %%  median %.2f p90 %.2f p99 %.2f max %.2f ms"
      "  |v| %.3f |a| %.3f  boundary %.0e  mean %.2f s",
      pillars, inflation, cruise ? "cruise" : "rest", tally.solved, tally.solvable,
      100.0 * tally.solved / std::max(1, tally.solvable), at(0.5), at(0.9), at(0.99), at(1),
      tally.max_speed, tally.max_acceleration, tally.worst_boundary,
      tally.slowness / std::max<double>(1, static_cast<double>(tally.ms.size())));
  if (tally.impossible > 0) {
    std::printf("\n     without the %d that are impossible: %.2f %%", tally.impossible,
                100.0 * tally.solved / std::max(1, tally.solvable - tally.impossible));
  }
  std::printf("\n     stages:");
  for (const auto& [name, count] : tally.stages)
    std::printf(" %s %d", std::string(name).c_str(), count);
  for (const auto& [name, count] : tally.failures)
    std::printf(" !%s %d", std::string(name).c_str(), count);
  std::printf("\n");
}

}  // namespace

int main(int argc, char** argv) {
  const int cases = argc > 1 ? std::atoi(argv[1]) : 500;
  const std::uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  const std::string folder = argc > 3 ? argv[3] : "";
  for (const bool cruise : {false, true}) {
    for (const int pillars : {90, 180}) {
      for (const double inflation : {0.3, 0.5})
        run(pillars, inflation, cruise, cases, seed, folder);
    }
  }
}
