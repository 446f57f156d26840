#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "math/pose.h"
#include "messages/sensors.h"
#include "physics/truth.h"
#include "sensors/scene.h"
#include "support/analytic_motion.h"
#include "worlds/world.h"

/// Flights for the odometry's benchmark: motions in closed form through the simulator's worlds,
/// seen by its MID-360 and its IMU.
namespace arex::bench {

struct FlightOptions {
  std::string world = "forest";  ///< forest or garage
  std::uint64_t seed = 1;
  double speed_mps = 1.5;
  double longest_s = 1e9;          ///< the flight is cut there
  double lidar_noise_floor_m = 0;  ///< least range sigma
  double imu_noise_factor = 1;     ///< on densities and walks
  Vec3 extrinsic_error_rad = Vec3::Zero();
  bool noise_free = false;
  [[nodiscard]] std::string name() const;
};

class Flight {
 public:
  /// Builds the world and the sensors. With a directory, scans are kept there and read back the
  /// next time.
  Flight(const FlightOptions& options, const std::filesystem::path& recordings);
  ~Flight();

  [[nodiscard]] const std::vector<ImuSample>& imu() const { return imu_; }
  [[nodiscard]] int scans() const { return scans_; }
  /// The scan over [i, i + 1) * 0.1 s.
  [[nodiscard]] LidarScanPtr scan(int i);
  [[nodiscard]] Pose X_WB(Stamp stamp) const;
  [[nodiscard]] sim::Truth truth(Stamp stamp) const;
  [[nodiscard]] const worlds::World& world() const;
  [[nodiscard]] const sim::Scene& scene() const;
  [[nodiscard]] double distance_m() const;  ///< flown
  /// From a point in W to the nearest surface, leaves included.
  [[nodiscard]] double surface_distance(const Vec3& p_W) const;

 private:
  struct Simulation;
  FlightOptions options_;
  std::filesystem::path file_;
  std::unique_ptr<Simulation> simulation_;
  std::vector<ImuSample> imu_;
  int scans_ = 0;
};

}  // namespace arex::bench
