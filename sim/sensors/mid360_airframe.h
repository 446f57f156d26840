#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "math/pose.h"
#include "worlds/world.h"

namespace arex::sim {

/// What the LiDAR sees of the airframe that carries it: constant in L, so a mask over all
/// directions is made once and only beams near a shape's outline are intersected.
class AirframeMask {
 public:
  /// Shapes in B (their X_WS is the pose in B). A shape that holds the LiDAR's origin is its own
  /// housing and does not block.
  AirframeMask(const std::vector<worlds::CollisionShape>& airframe_B, const Pose& X_BL);

  struct BodyHit {
    double distance_m = std::numeric_limits<double>::infinity();
    Vec3 normal_L = Vec3::Zero();  ///< unit, outwards
    [[nodiscard]] bool valid() const { return distance_m < 1e9; }
  };
  /// Nearest of the shapes along a unit direction from L's origin.
  [[nodiscard]] BodyHit cast(const Vec3& direction_L) const;

  /// False only where no shape can be met: the cheap question.
  [[nodiscard]] bool near_body(float x, float y, float z) const {
    return near_[cell_of(x, y, z)] != 0;
  }

 private:
  static constexpr int kCells = 256;  ///< each way, on the octahedron unfolded into a square
  static std::size_t cell_of(float x, float y, float z);

  struct Shape {
    worlds::CollisionShape::Kind kind;
    Pose X_SL;
    Vec3 size;
  };
  std::vector<Shape> shapes_;
  std::vector<std::uint8_t> near_;
};

inline std::size_t AirframeMask::cell_of(float x, float y, float z) {
  const float scale = 1 / (std::abs(x) + std::abs(y) + std::abs(z));
  float u = x * scale, v = y * scale;
  if (z < 0) {
    const float folded = (1 - std::abs(v)) * (u < 0 ? -1.0F : 1.0F);
    v = (1 - std::abs(u)) * (v < 0 ? -1.0F : 1.0F);
    u = folded;
  }
  constexpr float kHalf = kCells / 2.0F;
  const int column = std::min(static_cast<int>((u + 1) * kHalf), kCells - 1);
  const int row = std::min(static_cast<int>((v + 1) * kHalf), kCells - 1);
  return static_cast<std::size_t>(row * kCells + column);
}

}  // namespace arex::sim
