#include "odometry/visual/translation_ransac.h"

#include <algorithm>
#include <cmath>

namespace arex {
namespace {

/// Distance of `after` from the line on which a translation along t puts it.
double off_line(const Vec3& t, const Vec3& before, const Vec3& after) {
  const Vec3 line = t.cross(before);
  const double slope = line.head<2>().norm();
  // A point that lies where the translation leads to stays where it is.
  constexpr double kNoLine = 1e-9;
  if (slope < kNoLine) return (after - before).head<2>().norm();
  return std::abs(line.dot(after)) / slope;
}

}  // namespace

std::vector<bool> fit_translation(std::span<const Vec3> before, std::span<const Vec3> after,
                                  double threshold, int trials, RandomStream random) {
  const std::size_t n = before.size();
  std::vector<bool> best(n, true);
  // What has not moved fits any translation.
  const auto still = [&](std::size_t i) {
    return (after[i] - before[i]).head<2>().norm() <= threshold;
  };
  std::vector<std::size_t> moving;
  for (std::size_t i = 0; i < n; ++i) {
    if (!still(i)) moving.push_back(i);
  }
  constexpr std::size_t kLeast = 3;
  if (moving.size() < kLeast) return best;
  std::ptrdiff_t most = -1;
  const int last = static_cast<int>(moving.size()) - 1;
  for (int trial = 0; trial < trials; ++trial) {
    const std::size_t a = moving[static_cast<std::size_t>(random.uniform_int(0, last))];
    const std::size_t b = moving[static_cast<std::size_t>(random.uniform_int(0, last))];
    const Vec3 t = before[a].cross(after[a]).cross(before[b].cross(after[b]));
    if (a == b || t.norm() < 1e-12) continue;
    std::vector<bool> fits(n);
    for (std::size_t i = 0; i < n; ++i) {
      fits[i] = still(i) || off_line(t, before[i], after[i]) <= threshold;
    }
    const std::ptrdiff_t count = std::count(fits.begin(), fits.end(), true);
    if (count > most) {
      most = count;
      best = std::move(fits);
    }
  }
  return best;
}

}  // namespace arex
