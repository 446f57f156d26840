#pragma once

#include <cstdint>
#include <vector>

#include "math/random.h"
#include "math/types.h"
#include "messages/sensors.h"
#include "support/analytic_motion.h"

/// Worlds of boxes, upright cylinders and a smooth rough ground, with exact ray casts, and the
/// sensors that see them: what the odometry's tests fly through.
namespace arex::test {

class AnalyticWorld {
 public:
  /// Trunks of 0.1-0.3 m on rough ground, none within 2 m of the path's ellipse.
  static AnalyticWorld forest(std::uint64_t seed, double length_x_m, double length_y_m);
  /// A closed hall of 30 x 20 x 4 m with pillars.
  static AnalyticWorld hall();
  /// Nothing but a flat ground: a vehicle above it cannot tell where it is.
  static AnalyticWorld plain();
  /// The plain with a car parked on it, 4.4 x 1.8 x 1.5 m, its middle 10 m ahead of the start.
  static AnalyticWorld parked_car();

  /// Distance along a unit direction, infinity for none; and the surface's unit normal.
  [[nodiscard]] double cast(const Vec3& origin, const Vec3& direction, Vec3& normal) const;
  /// Distance from a point to the nearest surface (ground: measured vertically, times its slope).
  [[nodiscard]] double distance(const Vec3& p) const;

 private:
  struct Cylinder {
    Vec2 centre;
    double radius, low, high;
  };
  struct Box {
    Vec3 low, high;
    bool inside_out = false;  ///< a room: seen from within
  };
  [[nodiscard]] double ground(double x, double y) const;

  std::vector<Cylinder> cylinders_;
  std::vector<Box> boxes_;
  double ground_z_ = 0;
  double roughness_m_ = 0;
  bool has_ground_ = false;
};

/// Noise of the sensors; zero is a noise-free sensor (models/arex/README.md).
struct SensorNoise {
  double lidar = 1;  ///< factor on the range noise's model
  double extra_range_m = 0;
  double lidar_angle_rad = 1.745e-3;
  double imu = 1;        ///< factor on the densities and walks
  double vibration = 1;  ///< factor on the tones
  Vec3 gyro_bias = Vec3(0.004, -0.003, 0.002);
  Vec3 accel_bias = Vec3(0.03, -0.04, 0.05);
  static SensorNoise none();
};

/// IMU samples at 200 Hz over [0, end], stamps multiples of 5 ms, the first at 0.
std::vector<ImuSample> simulate_imu(const AnalyticMotion& motion, Stamp end,
                                    const SensorNoise& noise, std::uint64_t seed);

/// One 0.1 s frame from `stamp` on; every `stride`-th firing. Ranges to 40 m.
LidarScan simulate_scan(const AnalyticWorld& world, const AnalyticMotion& motion, const Pose& X_BL,
                        Stamp stamp, const SensorNoise& noise, std::uint64_t seed, int stride);

}  // namespace arex::test
