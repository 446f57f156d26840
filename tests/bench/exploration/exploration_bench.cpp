// Time of one exploration decision and of its parts on a half explored forest of 500 x 400 cells
// (50 x 40 m at 0.1 m, 300 trunks), one thread: exploration_bench
#include <cstdio>
#include <ctime>
#include <functional>

#include "autonomy/exploration/test_map.h"
#include "exploration/revenue_explorer.h"

namespace arex {
namespace {

OccupancyMap2D forest(RandomStream& random) {
  OccupancyMap2D map = test::make_map(500, 400, OccupancyMap2D::kFree);
  for (int k = 0; k < 300; ++k) {
    const Eigen::Vector2i low(random.uniform_int(0, 499), random.uniform_int(0, 399));
    const bool at_start = (low - Eigen::Vector2i(250, 200)).cwiseAbs().maxCoeff() < 15;
    if (!at_start) test::fill(map, low, low + Eigen::Vector2i(3, 3), OccupancyMap2D::kOccupied);
  }
  return map;
}

/// Best of `repeats` in CPU milliseconds: other load on the host adds to the rest.
double best_ms(int repeats, const std::function<void()>& run) {
  double best = 1e9;
  for (int i = 0; i < repeats; ++i) {
    const std::clock_t begin = std::clock();
    run();
    best = std::min(best, 1e3 * static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC);
  }
  return best;
}

void bench(std::uint64_t seed) {
  RandomStream random(seed, "bench");
  const OccupancyMap2D truth = forest(random);
  OccupancyMap2D map = test::unknown_like(truth);
  for (double x = -10; x <= 5; x += 5) test::reveal(truth, {x, 0.05}, 12, map);
  ExplorerConfig config;
  ExplorerInput input;
  input.p_OB = {0.05, 0.05, 1.5};
  const ExplorationSpace space(map, config.bounds, config.space, input.p_OB.head<2>());
  const double space_ms = best_ms(20, [&] {
    const ExplorationSpace s(map, config.bounds, config.space, input.p_OB.head<2>());
    (void)s;
  });
  FrontierDetector detector(config.detector, seed);
  const double detector_ms = best_ms(20, [&] { detector.update(space); });
  const double search_ms = best_ms(20, [&] { (void)find_frontiers(space); });
  RevenueExplorer explorer(config, map.resolution, seed);
  std::size_t candidates = 0;
  double decide_ms = 1e9, worst_ms = 0;
  input.progress = TargetProgress::kReached;  // a new choice each time
  for (int i = 0; i < 20; ++i) {
    const double ms =
        best_ms(1, [&] { candidates = explorer.decide(map, input).candidates.size(); });
    decide_ms = std::min(decide_ms, ms);
    worst_ms = std::max(worst_ms, ms);
  }
  std::printf("%4llu %10.2f %10.2f %10.2f %10.2f %10.2f %10zu\n",
              static_cast<unsigned long long>(seed), space_ms, detector_ms, search_ms, decide_ms,
              worst_ms, candidates);
}

}  // namespace
}  // namespace arex

int main() {
  std::printf("CPU ms (best of 20)\n%4s %10s %10s %10s %10s %10s %10s\n", "seed", "space",
              "detector", "exhaustive", "decision", "worst", "candidates");
  for (std::uint64_t seed = 1; seed <= 5; ++seed) arex::bench(seed);
  return 0;
}
