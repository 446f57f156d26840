#include "worlds/poisson_disc.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace arex::worlds {
namespace {

/// A bucket grid whose cells hold one point at most.
class Buckets {
 public:
  Buckets(const Vec2& extent, double spacing)
      : spacing_(spacing),
        cell_(spacing / std::numbers::sqrt2),
        columns_(static_cast<int>(extent.x() / cell_) + 1),
        rows_(static_cast<int>(extent.y() / cell_) + 1),
        point_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), kNone) {}

  [[nodiscard]] bool is_free(const Vec2& p, const std::vector<Vec2>& points) const {
    const int column = static_cast<int>(p.x() / cell_);
    const int row = static_cast<int>(p.y() / cell_);
    for (int r = std::max(row - 2, 0); r <= std::min(row + 2, rows_ - 1); ++r) {
      for (int c = std::max(column - 2, 0); c <= std::min(column + 2, columns_ - 1); ++c) {
        const int other = point_[slot(c, r)];
        if (other != kNone && (points[static_cast<std::size_t>(other)] - p).norm() < spacing_) {
          return false;
        }
      }
    }
    return true;
  }
  void insert(const Vec2& p, int index) {
    point_[slot(static_cast<int>(p.x() / cell_), static_cast<int>(p.y() / cell_))] = index;
  }

 private:
  static constexpr int kNone = -1;
  [[nodiscard]] std::size_t slot(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }
  double spacing_, cell_;
  int columns_, rows_;
  std::vector<int> point_;
};

}  // namespace

std::vector<Vec2> scatter_discs(const Vec2& low, const Vec2& high, double density_per_m2,
                                double spacing_m, RandomStream random) {
  const Vec2 extent = high - low;
  std::vector<Vec2> points;
  if ((extent.array() <= 0).any()) return points;
  const auto wanted = static_cast<std::size_t>(std::lround(density_per_m2 * extent.prod()));
  Buckets buckets(extent, spacing_m);
  // Far below jamming a few darts in a hundred still find room at the end: this never runs out.
  const std::size_t max_darts = 20000 * (wanted + 1);
  for (std::size_t dart = 0; dart < max_darts && points.size() < wanted; ++dart) {
    const double x = random.uniform(0, extent.x());
    const double y = random.uniform(0, extent.y());
    const Vec2 p(x, y);
    if (!buckets.is_free(p, points)) continue;
    buckets.insert(p, static_cast<int>(points.size()));
    points.push_back(p);
  }
  for (Vec2& p : points) p += low;
  return points;
}

}  // namespace arex::worlds
