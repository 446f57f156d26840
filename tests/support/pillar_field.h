#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "mapping/grid_view.h"
#include "math/random.h"

namespace arex::support {

/// A random pillar field: 30 x 30 x 3 m at 0.1 m, upright pillars of radius 0.1-0.3 m over the
/// whole height at uniform places, and cubic inflation: every cell within ceil(inflation / 0.1)
/// cells of an occupied one, on each axis, is inflated.
struct PillarFieldOptions {
  int pillars = 90;  ///< per 900 m^2
  double inflation_m = 0.3;
  double min_radius_m = 0.1;
  double max_radius_m = 0.3;
  double size_m = 30.0;
  double height_m = 3.0;
  double resolution_m = 0.1;
};

class PillarField {
 public:
  struct Pillar {
    Vec2 centre;
    double radius;
  };

  PillarField(const PillarFieldOptions& options, std::uint64_t seed, std::uint64_t index = 0)
      : options_(options) {
    RandomStream random = RandomStream(seed, "pillar_field").fork(index);
    const double half = options.size_m / 2;
    for (int i = 0; i < options.pillars; ++i) {
      const double x = random.uniform(-half, half), y = random.uniform(-half, half);
      pillars_.push_back({{x, y}, random.uniform(options.min_radius_m, options.max_radius_m)});
    }
    build();
  }

  [[nodiscard]] GridView view() const {
    GridView grid;
    grid.cells = cells_.data();
    grid.low = {-options_.size_m / 2, -options_.size_m / 2, 0.0};
    grid.resolution_m = options_.resolution_m;
    grid.size = {side_, side_, layers_};
    return grid;
  }
  [[nodiscard]] const std::vector<Pillar>& pillars() const { return pillars_; }
  /// The cells, for tests that change them.
  [[nodiscard]] std::vector<std::uint8_t>& cells() { return cells_; }

 private:
  void build() {
    side_ = static_cast<int>(std::lround(options_.size_m / options_.resolution_m));
    layers_ = static_cast<int>(std::lround(options_.height_m / options_.resolution_m));
    const int reach =
        static_cast<int>(std::ceil(options_.inflation_m / options_.resolution_m - 1e-9));
    const auto n = static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_);
    std::vector<std::uint8_t> layer(n, GridView::kKnown);
    const double half = options_.size_m / 2;
    for (const Pillar& pillar : pillars_) {
      const auto cell = [&](double v) {
        return static_cast<int>(std::floor((v + half) / options_.resolution_m));
      };
      const int x0 = cell(pillar.centre.x() - pillar.radius),
                x1 = cell(pillar.centre.x() + pillar.radius);
      const int y0 = cell(pillar.centre.y() - pillar.radius),
                y1 = cell(pillar.centre.y() + pillar.radius);
      for (int x = x0; x <= x1; ++x) {
        for (int y = y0; y <= y1; ++y) {
          if (!touches(pillar, x, y)) continue;
          mark(layer, x, y, GridView::kOccupied);
          for (int i = x - reach; i <= x + reach; ++i) {
            for (int j = y - reach; j <= y + reach; ++j) mark(layer, i, j, GridView::kInflated);
          }
        }
      }
    }
    cells_.reserve(n * static_cast<std::size_t>(layers_));
    for (int z = 0; z < layers_; ++z) cells_.insert(cells_.end(), layer.begin(), layer.end());
  }
  /// Whether the pillar's disc reaches into the cell.
  [[nodiscard]] bool touches(const Pillar& pillar, int x, int y) const {
    const double r = options_.resolution_m, half = options_.size_m / 2;
    const double dx =
        std::clamp(pillar.centre.x(), x * r - half, (x + 1) * r - half) - pillar.centre.x();
    const double dy =
        std::clamp(pillar.centre.y(), y * r - half, (y + 1) * r - half) - pillar.centre.y();
    return dx * dx + dy * dy <= pillar.radius * pillar.radius;
  }
  void mark(std::vector<std::uint8_t>& layer, int x, int y, std::uint8_t flag) const {
    if (x < 0 || y < 0 || x >= side_ || y >= side_) return;
    auto& value = layer[static_cast<std::size_t>(x) * static_cast<std::size_t>(side_) +
                        static_cast<std::size_t>(y)];
    value = static_cast<std::uint8_t>(value | flag);
  }

  PillarFieldOptions options_;
  std::vector<Pillar> pillars_;
  std::vector<std::uint8_t> cells_;
  int side_ = 0, layers_ = 0;
};

/// Start and goal `distance_m` apart in free cells of a field, at mid height.
struct PillarCase {
  bool valid = false;
  Vec3 start, goal;
};
inline PillarCase draw_case(const GridView& grid, RandomStream random, double distance_m) {
  PillarCase drawn;
  const double half = 0.5 * grid.resolution_m * grid.size.x() - 1.0;
  const double z = grid.low.z() + 0.5 * grid.resolution_m * grid.size.z() + 0.013;
  for (int i = 0; i < 1000 && !drawn.valid; ++i) {
    drawn.start = {random.uniform(-half, half), random.uniform(-half, half), z};
    const double heading = random.uniform(-std::numbers::pi, std::numbers::pi);
    drawn.goal = drawn.start + distance_m * Vec3(std::cos(heading), std::sin(heading), 0.0);
    drawn.valid = std::abs(drawn.goal.x()) < half && std::abs(drawn.goal.y()) < half &&
                  !grid.inflated(drawn.start) && !grid.inflated(drawn.goal);
  }
  return drawn;
}

}  // namespace arex::support
