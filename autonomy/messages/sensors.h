#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "math/pose.h"
#include "math/types.h"

/// What the vehicle's sensors deliver. Stamps are the devices' own, integer nanoseconds.
namespace arex {

/// One sample of the autopilot's IMU, in B.
struct ImuSample {
  Stamp stamp = 0;
  Vec3 gyro_radps = Vec3::Zero();  ///< angular rate of B, rad/s
  Vec3 accel_mps2 = Vec3::Zero();  ///< specific force, m/s^2: +g along z at rest on level ground
};

/// Magnetometer and barometer of the autopilot.
struct MagnetometerSample {
  Stamp stamp = 0;
  Vec3 field_gauss = Vec3::Zero();  ///< in B
};
struct BarometerSample {
  Stamp stamp = 0;
  double pressure_pa = 0;
};

/// What the autopilot reads of its battery.
struct BatterySample {
  Stamp stamp = 0;
  double voltage_v = 0;
  double current_a = 0;
};

/// One LiDAR return. Points without a return are not in the scan.
struct LidarPoint {
  Vec3f p_L = Vec3f::Zero();    ///< in the LiDAR's frame at the point's own time, m
  float intensity = 0;          ///< reflectivity as the device reports it, 0..255
  std::uint32_t offset_ns = 0;  ///< since the scan's stamp
  std::uint8_t line = 0;        ///< laser line, 0..3
  std::uint8_t tag = 0;         ///< the device's confidence tag; 0 normal
};

/// One LiDAR frame: everything fired in [stamp, end), in firing order, distorted by the motion.
struct LidarScan {
  std::string device;  ///< its name where there are several; empty: the first
  Stamp stamp = 0;     ///< of the first firing
  Stamp end = 0;       ///< end of the frame; the last firing lies before it
  std::vector<LidarPoint> points;
};

/// Pinhole intrinsics, pixels; pixel centres at integer coordinates. Camera frame C: z forward, x
/// right, y down.
struct PinholeCamera {
  int width = 0;
  int height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;

  /// The point of C at depth `z_m` seen by pixel (u, v).
  [[nodiscard]] Vec3 unproject(double u, double v, double z_m) const {
    return {(u - cx) / fx * z_m, (v - cy) / fy * z_m, z_m};
  }
};

/// One depth frame, rows from the top. Global shutter: all pixels at `stamp`.
struct DepthImage {
  std::string device;  ///< its name where there are several; empty: the first
  Stamp stamp = 0;
  PinholeCamera camera;
  std::vector<float> depth_m;  ///< width * height z-depths, m; 0 where there is no measurement

  [[nodiscard]] float at(int u, int v) const {
    return depth_m[static_cast<std::size_t>(v) * static_cast<std::size_t>(camera.width) +
                   static_cast<std::size_t>(u)];
  }
};

/// An external tracking system's measurement of the vehicle ('mocap' odometry): the oracle.
struct MocapSample {
  Stamp stamp = 0;
  Pose X_OB;
  Vec3 v_OB = Vec3::Zero();
};

// Scans and frames are large and read by several jobs at once: they travel by shared pointer.
using LidarScanPtr = std::shared_ptr<const LidarScan>;
using DepthImagePtr = std::shared_ptr<const DepthImage>;

}  // namespace arex
