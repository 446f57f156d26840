#pragma once

#include <vector>

#include "mapping/grid_view.h"
#include "math/random.h"

namespace arex::test {

/// A small grid of its own cells, all known and free at first.
class TestGrid {
 public:
  TestGrid(int x, int y, int z, double resolution_m = 0.1, const Vec3& low = Vec3::Zero())
      : size_(x, y, z),
        low_(low),
        resolution_m_(resolution_m),
        cells_(static_cast<std::size_t>(x * y * z), GridView::kKnown) {}

  [[nodiscard]] GridView view() const { return {cells_.data(), low_, resolution_m_, size_}; }
  [[nodiscard]] std::uint8_t& at(int x, int y, int z) { return cells_[view().index({x, y, z})]; }
  /// Sets flags in a box of cells, both corners included.
  void mark(const Eigen::Vector3i& low, const Eigen::Vector3i& high, std::uint8_t flags) {
    for (int x = low.x(); x <= high.x(); ++x) {
      for (int y = low.y(); y <= high.y(); ++y) {
        for (int z = low.z(); z <= high.z(); ++z) {
          at(x, y, z) = static_cast<std::uint8_t>(at(x, y, z) | flags);
        }
      }
    }
  }
  void forget(const Eigen::Vector3i& low, const Eigen::Vector3i& high) {
    for (int x = low.x(); x <= high.x(); ++x) {
      for (int y = low.y(); y <= high.y(); ++y) {
        for (int z = low.z(); z <= high.z(); ++z) at(x, y, z) = 0;
      }
    }
  }
  /// An occupied box and its cubic inflation by `cells`.
  void add_obstacle(const Eigen::Vector3i& low, const Eigen::Vector3i& high, int cells) {
    const Eigen::Vector3i reach = Eigen::Vector3i::Constant(cells);
    mark((low - reach).cwiseMax(0), (high + reach).cwiseMin(size_ - Eigen::Vector3i::Ones()),
         GridView::kInflated);
    mark(low, high, GridView::kOccupied);
  }

 private:
  Eigen::Vector3i size_;
  Vec3 low_;
  double resolution_m_;
  std::vector<std::uint8_t> cells_;
};

inline Vec3 random_point(RandomStream& random, double low, double high) {
  const double x = random.uniform(low, high), y = random.uniform(low, high);
  return {x, y, random.uniform(low, high)};
}

}  // namespace arex::test
