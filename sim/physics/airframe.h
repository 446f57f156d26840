#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "math/pose.h"
#include "math/types.h"
#include "worlds/world.h"

namespace arex::sim {

enum class AirframePart : std::uint8_t { kBody, kArm, kRotor, kLidar, kCamera, kLeg };

/// Sense of each rotor's rotation about B's z (MotorCommand's order).
inline constexpr std::array<double, 4> kRotorSpin{1, 1, -1, -1};

/// The true vehicle in B: models/arex/arex.xml, and what a scenario makes of it.
struct Airframe {
  double mass_kg = 0;
  Vec3 p_BBcm = Vec3::Zero();        ///< centre of mass, m
  Mat3 inertia_kgm2 = Mat3::Zero();  ///< about the centre of mass, axes of B
  std::array<Vec3, 4> p_BR;          ///< rotor hubs, in MotorCommand's order, m
  Pose X_BL;                         ///< LiDAR
  Pose X_BC;                         ///< depth camera's left imager
  /// The solids. `X_WS` is the pose in B, `object` the AirframePart. The LiDAR's own housing
  /// (kLidar) is among them: whoever casts the LiDAR's rays leaves it out.
  std::vector<worlds::CollisionShape> shapes;
  double radius_m = 0;           ///< of a sphere about B that holds all shapes
  double standing_height_m = 0;  ///< of B above level ground, on its legs
};

/// Reads the model that is built into the binary.
Airframe load_airframe();

}  // namespace arex::sim
