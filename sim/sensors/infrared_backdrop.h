#pragma once

#include <array>

#include "sensors/eight.h"
#include "sensors/infrared_config.h"
#include "sensors/infrared_materials.h"
#include "worlds/world.h"

namespace arex::sim {

/// What is seen past a world's edge: its ground going on, a wall of trees around it, the sky. All
/// of it stands in W, so that it moves in the image as far things do.
class Backdrop {
 public:
  Backdrop(const InfraredLightConfig& light, const worlds::World& world);

  /// Light that comes along a ray from `eye` in W, as that of a white surface, lx.
  /// @param direction in W, not zero
  /// @param pixel_rad what a pixel covers
  [[nodiscard]] float at(const Vec3f& eye, const Vec3f& direction, float pixel_rad) const;
  /// The same along eight rays, by their coordinates.
  using Rays = std::array<Float8, 3>;
  [[nodiscard]] Float8 at(const Vec3f& eye, const Rays& direction, float pixel_rad) const;

 private:
  /// @param from the eye, from `middle_`
  /// @param squared of the rays' lengths
  [[nodiscard]] Float8 ground(const Vec3f& from, const Rays& direction, const Float8& squared,
                              float pixel_rad) const;
  [[nodiscard]] Float8 sky(const Rays& direction, const Float8& norm, float pixel_rad) const;

  Vec3f middle_;          ///< of the wall of trees, at the ground's height
  Eigen::Vector2f half_;  ///< of its sides, m
  float ground_lx_ = 0, wall_lx_ = 0, sky_lx_ = 0;  ///< as white surfaces
  Material ground_, trees_, clouds_;
};

}  // namespace arex::sim
