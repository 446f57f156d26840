#pragma once

#include <map>
#include <string>
#include <vector>

#include "math/lasting.h"
#include "math/noise_watch.h"
#include "math/stream_watch.h"
#include "math/vibration_watch.h"
#include "messages/events.h"
#include "messages/sensors.h"
#include "messages/stereo_image.h"
#include "messages/vehicle.h"
#include "stack/field_watch.h"
#include "stack/health_watch_config.h"

namespace arex {

/// What the stack reads of its vehicle's sensors: silent is also what has not said a word by the
/// time that the vehicle is armed.
struct ExpectedSensors {
  bool imu = false, depth = false, infrared = false;
};

/// What the companion computer can tell of its sensors without a word from their makers: whether
/// messages come, change and are in time, what a depth image looks like against those before, and
/// whether the vehicle does as it is told. What the LiDAR's points say is LidarWatch's.
class HealthWatch {
 public:
  explicit HealthWatch(const HealthWatchConfig& config, VehicleConfig vehicle = {},
                       ExpectedSensors expected = {});

  // What arrives, between two calls of update.
  void add_imu(Stamp now, const ImuSample& imu);
  void add_scan(Stamp now, const LidarScanPtr& scan);
  void add_depth(Stamp now, const DepthImage& image);
  void add_images(Stamp now, const StereoImage& images);
  void add_mocap(Stamp now, const MocapSample& mocap);

  /// How it flies, as the stack knows it.
  struct Flight {
    bool armed = false;
    bool in_air = false;
    double attitude_difference_rad = 0;  ///< between the verticals of autopilot and odometry
    double off_path_m = 0;               ///< from the setpoint
  };
  /// @return what is new since the last call
  std::vector<Event> update(Stamp now, const Flight& flight);

  /// Whether nothing has been wrong with the IMU for a while: what else is measured with it, such
  /// as how well scans match, says something of others. Noise is known here before it is told:
  /// within two scans of a LiDAR.
  [[nodiscard]] bool imu_sound(Stamp now) const;

 private:
  /// What is wrong with images: it is told if it lasts, and over once it has been gone for long.
  struct Finding {
    int frames = 0;     ///< in a row that had it
    Stamp newest = -1;  ///< the last of them; none: -1
    bool told = false;
    void add(Stamp now, bool found) {
      frames = found ? frames + 1 : 0;
      if (found) newest = now;
    }
  };
  /// One depth camera's images against its usual ones.
  struct Images {
    double usual_valid = -1;  ///< share; -1: none yet
    double usual_rough = -1;
    double usual_holes = -1;
    Finding blind, rough, holes;
  };

  void expect(Stamp now);
  StreamWatch& stream(const std::string& name, const StreamWatchConfig& config);
  void report(Stamp now, EventKind kind, std::string detail);
  void tell_images(Stamp now, const std::string& name, Images& images);
  /// Whether a camera that measures little has little before it, by what the LiDAR meets.
  [[nodiscard]] bool is_excused(const DepthImage& image) const;

  HealthWatchConfig config_;
  VehicleConfig vehicle_;
  ExpectedSensors expected_;
  LidarScanPtr scan_;  ///< the newest of the first LiDAR; null before
  VibrationWatch vibration_;
  std::map<std::string, StreamWatch> streams_;
  std::map<std::string, Images> images_;
  FieldWatch field_;
  Lasting contradicts_, off_path_;
  NoiseWatch gyro_steps_;
  Stamp imu_faulty_ = -1;  ///< when it last was; never: -1
  std::vector<Event> events_;
};

}  // namespace arex
