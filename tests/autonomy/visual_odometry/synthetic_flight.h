#pragma once

#include <functional>
#include <vector>

#include "odometry/visual/visual_inertial_odometry.h"
#include "support/analytic_motion.h"
#include "support/analytic_world.h"

/// Flights along motions in closed form past points whose projections are exact but for the noise
/// asked for: every feature is followed without a mistake.
namespace arex::test {

struct SyntheticConfig {
  double pixel_std = 0;
  SensorNoise imu = SensorNoise::none();
  std::uint64_t seed = 1;
  int rounds = 1;       ///< of a loop, 24 x 16 m
  double rest_s = 2.5;  ///< before it
  double speed_mps = 1.5;
  double rate_hz = 10;
  int right_every = 1;
  int features = 150;
  double clock_offset_s = 0;  ///< of the camera's stamps, ahead of the IMU's
  Vec3 mount_error_rad = Vec3::Zero();
  double wall_m = 0;  ///< thickness of the layer of points; 0: a forest
};

struct SyntheticFlight {
  AnalyticMotion motion;
  std::vector<ImuSample> imu;
  std::vector<FeatureFrame> frames;  ///< stamps by the camera's clock
  Stamp clock_offset = 0;
  double path_m = 0;  ///< from take-off on
};

/// Where the drawings have the left eye.
[[nodiscard]] Pose camera_mount();
[[nodiscard]] SyntheticFlight synthesise(const SyntheticConfig& config);

/// Readings without delay, as the synthetic IMU's are.
[[nodiscard]] VisualInertialConfig synthetic_defaults();

struct SyntheticRun {
  std::vector<Odometry> fast;  ///< at every IMU sample
  std::vector<VisualUpdate> updates;
  std::vector<std::string> faults;
  double ate_m = 0;  ///< RMS over the fast output
  double worst_m = 0;
  double end_m = 0;
  double worst_yaw_rad = 0;
  double nees_position = 0;   ///< mean of e' P^-1 e in flight, 3 expected
  double largest_step_m = 0;  ///< of the fast output, by an update
};

/// What becomes of a frame before the odometry gets it.
using TamperFrame = std::function<void(FeatureFrame&)>;

/// @param latency_s from an exposure to its update
[[nodiscard]] SyntheticRun fly(const SyntheticFlight& flight, const VisualInertialConfig& config,
                               const TamperFrame& tamper = {}, double latency_s = 0.06);

}  // namespace arex::test
