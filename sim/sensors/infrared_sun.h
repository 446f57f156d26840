#pragma once

#include <array>
#include <vector>

#include "math/pose.h"
#include "sensors/eight.h"
#include "sensors/infrared_config.h"
#include "worlds/world.h"

namespace arex::sim {

/// Which places of a world the sun reaches: a picture of the world as the sun sees it, taken once.
class SunMap {
 public:
  /// @param texels along the longer side of the picture
  SunMap(const InfraredLightConfig& light, const worlds::World& world, int texels = kTexels);

  /// Share of the sun that reaches a point in W, 0 to 1: the mean of four texels, weighted by
  /// distance, so that the borders of shadows are a texel wide. 1 outside of the picture.
  [[nodiscard]] float visible(const Vec3f& p_W) const {
    // A surface does not shade itself: it is asked for a little nearer the sun.
    const Vec3f p = axes_ * (p_W - eye_) + lift_;
    const float q = 1 / p.z();
    const float u = fx_ * p.x() * q + cx_, v = fx_ * p.y() * q + cy_;
    if (!(u >= 0 && v >= 0 && u < last_u_ && v < last_v_)) return 1;
    const auto column = static_cast<int>(u), row = static_cast<int>(v);
    const float du = u - static_cast<float>(column), dv = v - static_cast<float>(row);
    const float* at = &inverse_depth_[static_cast<std::size_t>(row * width_ + column)];
    const float* below = at + width_;
    const auto lit = [q](float nearest) { return nearest > q ? 0.0F : 1.0F; };
    const float upper = lit(at[0]) + du * (lit(at[1]) - lit(at[0]));
    const float lower = lit(below[0]) + du * (lit(below[1]) - lit(below[0]));
    return upper + dv * (lower - upper);
  }
  /// The same of eight points, by their coordinates.
  [[nodiscard]] Float8 visible(const std::array<Float8, 3>& p_W) const {
    const std::array<Float8, 3> d{p_W[0] - eye_.x(), p_W[1] - eye_.y(), p_W[2] - eye_.z()};
    const auto in_S = [&](int i) {
      return axes_(i, 0) * d[0] + (axes_(i, 1) * d[1] + axes_(i, 2) * d[2]) + lift_[i];
    };
    const Float8 q = 1 / in_S(2);
    const Float8 u = fx_ * in_S(0) * q + cx_, v = fx_ * in_S(1) * q + cy_;
    const Float8 zero{}, one = zero + 1.0F;
    const Int8 inside = (u >= zero) & (v >= zero) & (u < last_u_) & (v < last_v_);
    const Int8 column = __builtin_convertvector(inside ? u : zero, Int8);
    const Int8 row = __builtin_convertvector(inside ? v : zero, Int8);
    const Float8 du = u - __builtin_convertvector(column, Float8);
    const Float8 dv = v - __builtin_convertvector(row, Float8);
    const Int8 at = row * width_ + column;
    const auto lit = [&](const Float8& nearest) { return nearest > q ? zero : one; };
    const auto along = [&](const float* texels) {
      const Neighbours nearest = gather_neighbours(texels, at);
      const Float8 left = lit(nearest.left);
      return left + du * (lit(nearest.right) - left);
    };
    const Float8 upper = along(inverse_depth_.data());
    const Float8 lower = along(inverse_depth_.data() + width_);
    return inside ? upper + dv * (lower - upper) : one;
  }
  /// Towards the sun, in W, unit.
  [[nodiscard]] const Vec3f& direction_W() const { return direction_; }
  /// Side of a texel at the world's middle, m.
  [[nodiscard]] double texel_m() const { return texel_m_; }

  static constexpr int kTexels = 2048;

 private:
  Vec3f direction_;
  Eigen::Matrix3f axes_;  ///< R_SW; S: z away from the sun
  Vec3f eye_;             ///< p_WS: so far off that its rays are as good as parallel, m
  Vec3f lift_;            ///< towards the sun, in S, m
  float fx_ = 0, cx_ = 0, cy_ = 0, last_u_ = 0, last_v_ = 0;
  int width_ = 0;
  double texel_m_ = 0;
  std::vector<float> inverse_depth_;
};

/// Towards the sun, in W, unit.
Vec3 sun_direction(const InfraredLightConfig& light);

}  // namespace arex::sim
