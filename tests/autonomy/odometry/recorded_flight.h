#pragma once

#include <functional>
#include <vector>

#include "odometry/lidar_inertial_odometry.h"
#include "support/analytic_world.h"

/// Flights through analytic worlds, recorded once and given to the odometry as a vehicle would.
namespace arex::test {

inline constexpr Stamp kFrame = 100'000'000;
inline constexpr Stamp kPeriod = 5'000'000;
inline constexpr double kRadius = 0.3;

Pose mounting();

/// A recorded flight: simulated once, flown by several tests.
struct Recording {
  AnalyticWorld world;
  AnalyticMotion motion;
  std::vector<ImuSample> imu;
  std::vector<LidarScanPtr> scans;
  Stamp imu_clock_offset = 0;  ///< of the stamps, ahead of the time that the samples arrive
};

/// @param stride of the scans' points
Recording record(const AnalyticWorld& world, const AnalyticMotion& motion, double duration_s,
                 const SensorNoise& noise, std::uint64_t seed, int stride,
                 const Pose& X_BL = mounting());

const Recording& forest();    ///< 16 s along a loop
const Recording& standing();  ///< a minute in a hall

/// The same flight with an IMU whose gyro reads so many times too much, by a clock that is off.
Recording with_imu(Recording recording, const Vec3& gyro_scale, Stamp clock_offset);

/// What the outside sees at each IMU sample, and each scan's update.
struct Flown {
  std::vector<Odometry> fast;
  std::vector<ScanUpdate> updates;
  double largest_step_m = 0, largest_step_rad = 0;
  OdometryNeed need = OdometryNeed::kNothing;  ///< at the end
};

using Tamper = std::function<LidarScanPtr(const LidarScanPtr&)>;

/// The analytic IMU reads without delay.
LidarInertialConfig defaults();

/// @param tamper what becomes of each scan; null: it is not delivered
Flown fly(const Recording& r, const LidarInertialConfig& config = defaults(),
          Stamp latency = 20'000'000, const Tamper& tamper = {});

/// m, from the true motion.
double position_error(const Recording& r, Stamp stamp, const Vec3& p_OB);
double worst_error(const Recording& r, const Flown& run);  ///< of the scans once it has started

/// So many of the fast outputs have that status.
int count(const Flown& run, OdometryStatus status);

}  // namespace arex::test
