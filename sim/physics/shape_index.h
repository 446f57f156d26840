#pragma once

#include <cstdint>
#include <vector>

#include "math/types.h"
#include "worlds/world.h"

namespace arex::sim {

/// Distance from a point to a solid, m; 0 inside.
double distance_to(const worlds::CollisionShape& shape, const Vec3& point);

/// Distance of the solid's farthest point from a point, m.
double reach_from(const worlds::CollisionShape& shape, const Vec3& point);

/// Which shapes are near a point: a grid over x and y, every shape in each cell its bounds touch.
class ShapeIndex {
 public:
  struct Neighbour {
    std::uint32_t shape = 0;
    double distance_m = 0;
  };

  explicit ShapeIndex(const std::vector<worlds::CollisionShape>& shapes);

  /// All shapes within `radius_m` of `point`, nearest first, equal distances by index.
  void find(const Vec3& point, double radius_m, std::vector<Neighbour>& out) const;

 private:
  struct Range {
    int first_column, last_column, first_row, last_row;
  };
  [[nodiscard]] Range cells_of(const Vec2& low, const Vec2& high) const;

  const std::vector<worlds::CollisionShape>& shapes_;
  Vec2 origin_ = Vec2::Zero();
  double cell_m_ = 2.0;
  int columns_ = 0, rows_ = 0;
  std::vector<std::uint32_t> cell_start_;  ///< columns * rows + 1
  std::vector<std::uint32_t> members_;     ///< ascending within a cell
};

}  // namespace arex::sim
