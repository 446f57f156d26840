#pragma once

#include <map>
#include <numbers>
#include <string>

#include "math/pose.h"
#include "math/types.h"

namespace arex {

/// Where a further sensor sits, as the stack believes.
struct MountConfig {
  Vec3 position_m = Vec3::Zero();
  Vec3 rotation_rad = Vec3::Zero();

  void fields(auto& f) {
    f("position_m", position_m, "of the sensor's origin in B");
    f("rotation_rad", rotation_rad,
      "rotation vector from B's axes to the sensor's: a LiDAR's x forward, y left, z up; a camera "
      "looks along its x here");
  }
  /// A LiDAR's frame in B.
  [[nodiscard]] Pose X_BL() const { return {so3::Exp(rotation_rad), position_m}; }
  /// A camera's frame in B: z forward, x right, y down.
  [[nodiscard]] Pose X_BC() const { return {so3::Exp(rotation_rad) * forward(), position_m}; }
  /// Looking along x.
  [[nodiscard]] static Mat3 forward() {
    Mat3 R;
    R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    return R;
  }
};

/// What the stack knows of its vehicle by weighing, measuring and calibrating: the belief, not the
/// truth (models/arex/arex.xml). A test holds the two together.
struct VehicleConfig {
  double mass_kg = 1.9;  ///< paper, II-A
  Vec3 rotor_offset_m{0.095, 0.1645,
                      0.0};            ///< |x|, |y|, z of each rotor in B (models/arex/README.md)
  double thrust_coefficient = 9.1e-6;  ///< kT, N/(rad/s)^2
  double torque_ratio_m = 0.0143;      ///< rotor drag torque per thrust
  double radius_m = 0.305;  ///< of the sphere about B that holds the airframe, propellers included
  /// 3 sigma of the range to propellers that the LiDAR sees edge-on (35 mm at 87 degrees of
  /// incidence).
  double own_returns_margin_m = 0.105;
  double ground_offset_m = 0.14;                  ///< height of B above the ground when standing
  Vec3 lidar_position_m{0.15, 0.0, 0.01};         ///< p_BL
  double lidar_pitch_rad = std::numbers::pi / 4;  ///< the dome leans forward by this (paper, II-A)
  Vec3 lidar_rotation_rad = Vec3::Zero();         ///< of other people's mounts, before the lean
  Vec3 camera_position_m{0.14, 0.0,
                         0.07};   ///< p_BC, the left imager: above the LiDAR (paper, II-A)
  double camera_pitch_rad = 0.0;  ///< positive looks down
  std::map<std::string, MountConfig> mounts;  ///< of further devices, by name

  /// Returns nearer to B are the vehicle's own, to the maps.
  [[nodiscard]] double own_returns_m() const { return radius_m + own_returns_margin_m; }
  /// LiDAR frame in B: turned, then rotated about its y.
  [[nodiscard]] Pose X_BL() const {
    const Mat3 lean = so3::Exp({0, lidar_pitch_rad, 0});
    // A product with the identity may change the sign of a zero, and so the hash of a flight.
    const bool leans_only = lidar_rotation_rad.isZero(0);
    return {leans_only ? lean : Mat3(so3::Exp(lidar_rotation_rad) * lean), lidar_position_m};
  }
  /// Camera frame in B: z forward, x right, y down.
  [[nodiscard]] Pose X_BC() const {
    return {so3::Exp({0, camera_pitch_rad, 0}) * MountConfig::forward(), camera_position_m};
  }
  /// The same of a device by its name; empty: the first. @throws std::out_of_range
  [[nodiscard]] Pose X_BL(const std::string& device) const {
    return device.empty() ? X_BL() : mounts.at(device).X_BL();
  }
  [[nodiscard]] Pose X_BC(const std::string& device) const {
    return device.empty() ? X_BC() : mounts.at(device).X_BC();
  }

  void fields(auto& f) {
    f("mass_kg", mass_kg, "all-up mass (paper, II-A)");
    f("rotor_offset_m", rotor_offset_m, "|x|, |y|, z of each rotor in B");
    f("thrust_coefficient", thrust_coefficient, "rotor thrust per squared speed, N/(rad/s)^2");
    f("torque_ratio_m", torque_ratio_m, "rotor drag torque per thrust");
    f("radius_m", radius_m, "sphere about B that holds the airframe");
    f("own_returns_margin_m", own_returns_margin_m,
      "returns within this of the sphere are the vehicle's own, to the maps");
    f("ground_offset_m", ground_offset_m, "height of B above the ground when standing");
    f("lidar_position_m", lidar_position_m, "LiDAR origin in B");
    f("lidar_pitch_rad", lidar_pitch_rad, "forward lean of the LiDAR (paper, II-A)");
    f("lidar_rotation_rad", lidar_rotation_rad,
      "rotation vector from B's axes to those that the LiDAR leans in; for recordings of other "
      "vehicles");
    f("camera_position_m", camera_position_m, "left imager in B");
    f("camera_pitch_rad", camera_pitch_rad, "camera pitch, positive looks down");
    f("mounts", mounts,
      "of further devices, by their names under devices; left out: as the scenario mounts them");
    f.check(mass_kg > 0, "mass_kg > 0");
    f.check(radius_m > 0, "radius_m > 0");
    f.check(own_returns_margin_m >= 0, "own_returns_margin_m >= 0");
    f.check(thrust_coefficient > 0, "thrust_coefficient > 0");
  }
};

}  // namespace arex
