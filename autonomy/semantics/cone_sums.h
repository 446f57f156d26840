#pragma once

#include <Eigen/Core>
#include <span>

#include "math/types.h"
#include "semantics/stem_fit.h"

namespace arex {

/// The normal equations of a step of a cone's fit: A step = b, for the corrections of the centre
/// (x, y), the lean (x, y), the radius and the taper.
struct ConeSums {
  Mat6 A;  ///< its lower triangle alone is set
  Vec6 b;
};

/// Points that a cone is fitted to, by coordinate: several are summed at once. Single precision
/// about a place among them, which is a hundred times finer than what a fit can tell.
class ConePoints {
 public:
  /// @param points (x, y, height above the ground)
  ConePoints(std::span<const Vec3> points, const Vec2& about);

  /// The sums for Geman-McClure weights of a scale, over the points' variance.
  /// @param most points further than this from the surface are left out
  [[nodiscard]] ConeSums sums(const Stem& stem, double scale, double sigma, double most) const;

 private:
  using Column = Eigen::ArrayXf;
  Vec2 about_;
  Column x_, y_, h_, hh_;  ///< h: above breast height, and its square
  mutable Column out_x_, out_y_, distance_, weight_, product_;  ///< kept for their memory
};

}  // namespace arex
