#pragma once

#include <cstddef>
#include <filesystem>

namespace arex::sim::test {

/// What a recorded flight looks like on the disk, without the minutes that flying one takes.
struct SyntheticRun {
  double duration_s = 30;
  std::size_t cloud_points = 20'000;
  std::size_t decisions = 20;
  std::size_t candidates = 10;  ///< of each decision
  bool finished = true;         ///< with a summary
};

/// Writes a run folder: a helix through a square room whose walls appear one after the other.
void write_synthetic_run(const std::filesystem::path& folder, const SyntheticRun& run);

/// Writes the folder of a sweep: two keys (3 x 2 values), four seeds, one run crashed and one
/// collided. The first run is there in full, the others have their row only.
void write_synthetic_sweep(const std::filesystem::path& folder);

/// Writes the sweep.csv of a Latin hypercube: two keys, 40 points, no two values the same.
void write_synthetic_hypercube(const std::filesystem::path& folder);

/// Writes the sweep.csv of two configurations, four seeds each, the largest there are: of the
/// second `successes` succeed, of the first all, or none if that is none; failures flew a fifth as
/// far.
void write_synthetic_failures(const std::filesystem::path& folder, int successes);

}  // namespace arex::sim::test
