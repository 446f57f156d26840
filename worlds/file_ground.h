#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "worlds/world.h"

namespace arex::worlds {

/// Corners of a triangle of the world, in W.
[[nodiscard]] std::array<Vec3, 3> corners_of(const World& world, std::size_t triangle);

/// The heights of what is level enough to stand on, above and below each other, leaves left out.
class Ground {
 public:
  static constexpr double kStandable = 0.7;  ///< cosine of the steepest ground to stand on
  static constexpr double kHeadroom = 0.8;   ///< of air that makes of something level a floor, m

  /// The world must outlive this.
  explicit Ground(const World& world);

  /// Those of the heights that nothing level is just above, ascending, in m: of two layers of one
  /// floor the upper, of a slab its top.
  [[nodiscard]] std::vector<double> floors(const Vec2& p) const;

  /// Ascending, in m.
  [[nodiscard]] std::vector<double> heights(const Vec2& p) const;

 private:
  [[nodiscard]] int column(double x) const;
  [[nodiscard]] int row(double y) const;
  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(x);
  }
  void add(const std::array<Vec3, 3>& corners, std::uint32_t triangle);

  const World& world_;
  Vec2 low_;
  double cell_m_ = 1;
  int columns_ = 0, rows_ = 0;
  std::vector<std::vector<std::uint32_t>> members_;
};

/// The ground of the storey that the start lies in: what is walked on from there, over ramps and
/// slopes; where that leads to several storeys, the one that is reached first. Beyond it, as high
/// as the nearest of it.
[[nodiscard]] HeightField storey_of(const World& world);

/// A world to be looked into from above: what is higher than `height_m` above the sheet is left
/// out, and what reaches through cut off there. Its shapes are not felt.
[[nodiscard]] World cut_above(const World& world, const HeightField& sheet, double height_m);

}  // namespace arex::worlds
