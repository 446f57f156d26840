#include "exploration/mean_shift.h"

#include <algorithm>
#include <numeric>

namespace arex {
namespace {

constexpr int kMaxShifts = 100;
constexpr double kRestShare = 1e-3;  ///< of the bandwidth: a shorter shift is rest (scikit-learn)

/// The points in ascending x, so that a window touches only the strip that it overlaps.
class Strip {
 public:
  Strip(std::span<const Vec2> points, double bandwidth) : bandwidth_(bandwidth) {
    sorted_.assign(points.begin(), points.end());
    std::sort(sorted_.begin(), sorted_.end(), [](const Vec2& a, const Vec2& b) {
      return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
    });
  }

  /// Mean and number of the points within the bandwidth of `centre`.
  [[nodiscard]] std::pair<Vec2, int> window(const Vec2& centre) const {
    Vec2 sum = Vec2::Zero();
    int count = 0;
    auto it = std::lower_bound(sorted_.begin(), sorted_.end(), centre.x() - bandwidth_,
                               [](const Vec2& p, double x) { return p.x() < x; });
    for (; it != sorted_.end() && it->x() <= centre.x() + bandwidth_; ++it) {
      if ((*it - centre).squaredNorm() > bandwidth_ * bandwidth_) continue;
      sum += *it;
      ++count;
    }
    if (count == 0) return {centre, 0};
    return {sum / count, count};
  }

 private:
  double bandwidth_;
  std::vector<Vec2> sorted_;
};

}  // namespace

Clusters mean_shift(std::span<const Vec2> points, double bandwidth_m) {
  const Strip strip(points, bandwidth_m);
  std::vector<Vec2> rest(points.begin(), points.end());
  std::vector<int> density(points.size(), 0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (int shift = 0; shift < kMaxShifts; ++shift) {
      const auto [mean, count] = strip.window(rest[i]);
      const double moved = (mean - rest[i]).norm();
      rest[i] = mean;
      density[i] = count;
      if (moved < kRestShare * bandwidth_m) break;
    }
  }
  std::vector<std::size_t> order(points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return density[a] > density[b]; });
  Clusters result;
  for (const std::size_t i : order) {
    const bool apart = std::all_of(result.modes.begin(), result.modes.end(), [&](const Vec2& mode) {
      return (mode - rest[i]).squaredNorm() > bandwidth_m * bandwidth_m;
    });
    if (apart) result.modes.push_back(rest[i]);
  }
  for (const Vec2& p : points) {
    std::size_t nearest = 0;
    for (std::size_t m = 1; m < result.modes.size(); ++m) {
      if ((result.modes[m] - p).squaredNorm() < (result.modes[nearest] - p).squaredNorm()) {
        nearest = m;
      }
    }
    result.label.push_back(nearest);
  }
  return result;
}

}  // namespace arex
