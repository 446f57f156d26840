#pragma once

#include "sensors/infrared_config.h"

namespace arex::sim {

/// The D430's dot projector: a pattern of dots that moves with the camera and lies on whatever it
/// meets. To an odometry that follows corners the dots are things that fly along.
///
/// Source: D400 series datasheet: 850 nm, 360 mW on average, 86 x 57 deg, between the imagers. How
/// many dots, how large and where exactly it stands are estimates, and so is the pattern, which the
/// maker does not tell. Nothing stands in its light that the eye sees past: it is 29 mm beside it.
class DotProjector {
 public:
  static constexpr double kBesideLeftEye_m = 0.029;  ///< along C's x [E]

  explicit DotProjector(const InfraredLightConfig& light);

  /// Light on a surface square to the camera's axis at depth 1 m, lx; at depth z it is a z^2-th.
  /// @param a, b x/z and y/z in the projector's frame, which is C but for its place
  [[nodiscard]] float at(float a, float b) const;

  /// The same without dots: all of its light spread evenly over its field.
  [[nodiscard]] float mean_lx() const { return mean_lx_; }

 private:
  float cells_per_unit_;  ///< of the lattice that holds a dot in each cell, in a and b
  float mean_lx_;
};

}  // namespace arex::sim
