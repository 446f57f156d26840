#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "math/pose.h"
#include "math/types.h"

/// What the vehicle's sensors deliver. Stamps are the devices' own, integer nanoseconds.
namespace arex {

/// One sample of the autopilot's IMU, in B: nine axes (paper, III-A).
struct ImuSample {
  Stamp stamp = 0;
  Vec3 gyro_radps = Vec3::Zero();   ///< angular rate of B, rad/s
  Vec3 accel_mps2 = Vec3::Zero();   ///< specific force, m/s^2: +g along z at rest on level ground
  Vec3 field_gauss = Vec3::Zero();  ///< the magnetometer's newest sample
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

/// One LiDAR return. Firings without a return are not in the scan's points.
struct LidarPoint {
  Vec3f p_L = Vec3f::Zero();  ///< in the LiDAR's frame at the point's own time, m
  float intensity = 0;  ///< as the device reports it: 0..150 diffuse, 151..255 retro-reflector
  std::uint32_t offset_ns = 0;  ///< since the scan's stamp, by the device's stamps
  std::uint8_t line = 0;        ///< laser line, 0..3
  std::uint8_t tag = 0;         ///< how far to trust it; see LidarTag
  std::uint16_t firing = 0;     ///< its place among the scan's firings, if that has packets
};

/// The device's tag: in two bits each how far a point is to be trusted, 0 fully, 1 moderately, 2
/// hardly. Source: Livox's user manual of the Mid-360, tag information.
struct LidarTag {
  static constexpr int kMergedShift = 0;  ///< drawn out between two surfaces that are close
  static constexpr int kWeakShift = 2;    ///< as faint as rain, fog or dust
  static constexpr std::uint8_t kModerate = 1, kLow = 2;
};

/// One LiDAR frame, distorted by the motion. Points stand in the order they were fired in; their
/// times jitter from packet to packet and may run backwards, and may lie past `end` by less than a
/// millisecond. Whoever needs them in order of time sorts.
struct LidarScan {
  // Of the MID-360.
  static constexpr int kPacketPoints = 96;           ///< firings that share one stamp
  static constexpr std::uint32_t kFiring_ns = 5000;  ///< between two of them
  static constexpr int kLines = 4;                   ///< that fire in turn

  std::string device;  ///< its name where there are several; empty: the first
  Stamp stamp = 0;     ///< the earliest point's
  Stamp end = 0;       ///< when the frame was closed: all of it had been fired
  std::vector<LidarPoint> points;
  /// Since `stamp`, of each packet, in the order sent. Empty: who made the scan knows no packets.
  std::vector<std::uint32_t> packets_ns{};

  /// Firings of the frame, with and without a return.
  [[nodiscard]] std::int64_t firings() const {
    return packets_ns.empty() ? static_cast<std::int64_t>(points.size())
                              : kPacketPoints * static_cast<std::int64_t>(packets_ns.size());
  }
  /// Firings without a return.
  [[nodiscard]] std::int64_t misses() const {
    return firings() - static_cast<std::int64_t>(points.size());
  }
  /// When a firing took place by its packet's stamp, ns since the scan's. @pre it has packets
  [[nodiscard]] std::uint32_t firing_ns(std::int64_t firing) const {
    return packets_ns[static_cast<std::size_t>(firing / kPacketPoints)] +
           static_cast<std::uint32_t>(firing % kPacketPoints) * kFiring_ns;
  }
  /// Where in the frame a point was fired: 0 its begin, 1 its end.
  [[nodiscard]] float fraction_of(const LidarPoint& point) const {
    const double fraction = point.offset_ns / static_cast<double>(end - stamp);
    return static_cast<float>(fraction < 1 ? fraction : 1);
  }
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
