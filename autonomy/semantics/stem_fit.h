#pragma once

#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "math/types.h"
#include "semantics/semantic_config.h"

namespace arex {

using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat6 = Eigen::Matrix<double, 6, 6>;

inline constexpr double kBreastHeight = 1.3;  ///< forestry's convention, m above the ground

/// A stem near breast height: a cone that may lean.
struct Stem {
  Vec2 centre = Vec2::Zero();  ///< of the axis at breast height, m
  Vec2 lean = Vec2::Zero();    ///< of the axis, per metre of height
  double radius = 0;           ///< at breast height, m
  double taper = 0;            ///< by which the radius shrinks per metre of height

  [[nodiscard]] Vec2 centre_at(double height) const {
    return centre + (height - kBreastHeight) * lean;
  }
  [[nodiscard]] double radius_at(double height) const {
    return std::max(0.01, radius - taper * (height - kBreastHeight));
  }
  /// Distance of a point (x, y, height above the ground) from the surface, in its level; negative
  /// inside.
  [[nodiscard]] double distance(const Vec3& p) const {
    return (p.head<2>() - centre_at(p.z())).norm() - radius_at(p.z());
  }
  /// Distance of a point from the axis, across it.
  [[nodiscard]] double from_axis(const Vec3& p) const {
    const Vec2 out = p.head<2>() - centre_at(p.z());
    const double along = out.dot(lean);
    return std::sqrt(std::max(0.0, out.squaredNorm() - along * along / (1 + lean.squaredNorm())));
  }
};

/// What speaks for a stem.
struct StemEvidence {
  Stem stem;
  static constexpr double kLayer = 0.2;  ///< m
  int layers = 0;                        ///< of that height with points on the surface
  int inliers = 0;                       ///< points on the surface
  int inside = 0;                        ///< points well inside, where wood should be
  int around = 0;                        ///< points close around
  double seen_fraction = 0;  ///< share of the girth that shows bark nearly all the way up
  double median_residual = 0;
  double score = 0;

  /// 0 to 1: near 1 for bark over 1.6 m of height and 40 % of the girth on a thin surface with
  /// nothing inside or close around; a bush at its best reaches 0.3.
  [[nodiscard]] double confidence() const;
};

/// Fits a stem to points (x, y, height above the ground) that may hold clutter: from several starts
/// (circles by RANSAC, PCL's, and by moments), iteratively reweighted least squares with
/// Geman-McClure weights of a scale that shrinks; of the results, the one with most of its surface
/// covered and least inside.
/// @param about where the stem's surface is expected
std::optional<StemEvidence> fit_stem(std::span<const Vec3> points, const Vec2& about,
                                     const StemConfig& config);

/// What speaks for a stem in points (x, y, height above the ground).
StemEvidence weigh_stem(std::span<const Vec3> points, const Stem& stem);

}  // namespace arex
