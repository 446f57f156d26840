#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "math/random.h"
#include "math/types.h"

namespace arex::test {

/// A stem in closed form: an upright or leaning cone frustum, seen over part of its girth.
struct AnalyticStem {
  Vec2 foot = Vec2::Zero();  ///< of the axis, on the ground
  double radius = 0.15;      ///< at breast height, m
  Vec2 lean = Vec2::Zero();  ///< of the axis, per metre of height
  double taper = 0.01;       ///< by which the radius shrinks per metre
  double height = 8;         ///< m
  double seen_from_rad = 0;  ///< first angle of the seen part of the girth
  double seen_rad = 2 * std::numbers::pi;

  [[nodiscard]] Vec2 at_breast() const { return foot + 1.3 * lean; }
};

/// Clouds in closed form, with the noise of a LiDAR at a few metres.
class AnalyticForest {
 public:
  AnalyticForest(const Vec2& slope, std::uint64_t seed)
      : slope_(slope), random_(seed, "analytic_forest") {}

  double noise_m = 0.01;
  double spacing_m = 0.06;  ///< of the points on surfaces

  [[nodiscard]] double ground(const Vec2& p) const { return slope_.dot(p); }

  void add_ground(double half_side) {
    for (double x = -half_side; x <= half_side; x += 2 * spacing_m) {
      for (double y = -half_side; y <= half_side; y += 2 * spacing_m) {
        const Vec2 p(x + spacing_m * random_.uniform(), y + spacing_m * random_.uniform());
        add({p.x(), p.y(), ground(p)});
      }
    }
  }
  void add_stem(const AnalyticStem& stem) {
    for (double h = 0; h < stem.height; h += spacing_m) {
      const double radius = std::max(0.02, stem.radius - stem.taper * (h - 1.3));
      for (double a = 0; a < stem.seen_rad; a += spacing_m / radius) {
        const double angle = stem.seen_from_rad + a;
        const Vec2 p = stem.foot + h * stem.lean + radius * Vec2(std::cos(angle), std::sin(angle));
        add({p.x(), p.y(), ground(stem.foot) + h});
      }
    }
  }
  /// Leaves: uniform in a ball.
  void add_foliage(const Vec3& centre, double radius, int count) {
    for (int i = 0; i < count; ++i) {
      const Vec3 d = random_.normal3().normalized() * radius * std::cbrt(random_.uniform());
      add(centre + Vec3(0, 0, ground(centre.head<2>())) + d);
    }
  }
  void add(const Vec3& p) { points.push_back((p + noise_m * random_.normal3()).cast<float>()); }
  RandomStream& random() { return random_; }

  std::vector<Vec3f> points;

 private:
  Vec2 slope_;
  RandomStream random_;
};

}  // namespace arex::test
