#pragma once

#include <map>
#include <string>
#include <vector>

#include "math/stream_watch.h"
#include "math/vibration_watch.h"
#include "messages/events.h"
#include "messages/sensors.h"

namespace arex {

/// What the stack calls wrong with its sensors and its flight.
struct HealthWatchConfig {
  VibrationWatchConfig vibration;
  double blind_share = 0.4;        ///< of the usual valid pixels; sound flights stay above 0.6
  double rough_factor = 3;         ///< of the usual roughness of a depth image
  int frames = 5;                  ///< in a row
  double attitude_limit_rad = 0.2; ///< a tenth of it is what two sound estimates differ by
  double off_path_m = 0.8;         ///< sound flights stay below 0.3
  double lasting_s = 0.2;          ///< of the two above

  void fields(auto& f) {
    f("vibration", vibration, "when the airframe is called shaking, by the IMU's output");
    f("blind_share", blind_share,
      "a depth image with less than this part of the usual pixels is blinded");
    f("rough_factor", rough_factor, "one that is this much rougher than usual is noisy");
    f("frames", frames, "in a row");
    f("attitude_limit_rad", attitude_limit_rad,
      "autopilot and odometry contradict each other if their verticals differ by more");
    f("off_path_m", off_path_m, "the vehicle is off its path if it is further from its setpoint");
    f("lasting_s", lasting_s, "for so long");
    f.check(blind_share > 0 && blind_share < 1, "0 < blind_share < 1");
    f.check(rough_factor > 1, "rough_factor > 1");
    f.check(frames >= 1 && frames <= 1000, "1 <= frames <= 1000");
    f.check(attitude_limit_rad > 0 && off_path_m > 0 && lasting_s >= 0,
            "attitude_limit_rad, off_path_m > 0, lasting_s >= 0");
  }
};

/// What the companion computer can tell of its sensors without a word from their makers: whether
/// messages come, change and are in time, what a depth image looks like against those before, and
/// whether the vehicle does as it is told. What the LiDAR's points say is LidarWatch's.
class HealthWatch {
 public:
  explicit HealthWatch(const HealthWatchConfig& config);

  // What arrives, between two calls of update.
  void add_imu(Stamp now, const ImuSample& imu);
  void add_scan(Stamp now, const LidarScan& scan);
  void add_depth(Stamp now, const DepthImage& image);
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

 private:
  /// One depth camera's images against its usual ones.
  struct Images {
    double usual_valid = -1;  ///< share; -1: none yet
    double usual_rough = -1;
    int blind = 0, rough = 0;  ///< frames in a row
    bool told_blind = false, told_rough = false;
  };
  /// Something that must last before it is told.
  struct Lasting {
    Stamp since = -1;
    bool told = false;
    /// @return whether it is new
    bool holds(bool now_so, Stamp now, double for_s);
  };

  StreamWatch& stream(const std::string& name, const StreamWatchConfig& config);
  void report(Stamp now, EventKind kind, std::string detail);
  void tell_images(Stamp now, const std::string& name, Images& images);

  HealthWatchConfig config_;
  VibrationWatch vibration_;
  std::map<std::string, StreamWatch> streams_;
  std::map<std::string, Images> images_;
  Lasting contradicts_, off_path_;
  std::vector<Event> events_;
};

}  // namespace arex
