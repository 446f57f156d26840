#pragma once

#include <optional>
#include <string_view>

#include "math/types.h"
#include "odometry/registration.h"

namespace arex {

struct LidarWatchConfig {
  double silent_after_s = 0.25;
  int least_points = 500;
  double refused_fraction = 0.75;
  double memory_scans = 20;

  void fields(auto& f) {
    f("silent_after_s", silent_after_s, "without a scan for longer: silent");
    f("least_points", least_points, "a scan of fewer returns is none");
    f("refused_fraction", refused_fraction,
      "less than this share of the usual matched share: the returns are false");
    f("memory_scans", memory_scans, "over which the usual share is averaged");
    f.check(silent_after_s > 0 && memory_scans >= 1, "silent_after_s > 0, memory_scans >= 1");
    f.check(refused_fraction > 0 && refused_fraction < 1, "0 < refused_fraction < 1");
  }
};

/// Says when the LiDAR fails and when it is sound again.
class LidarWatch {
 public:
  explicit LidarWatch(const LidarWatchConfig& config) : config_(config) {}

  /// A scan of so many returns came.
  void add_scan(Stamp now, std::size_t points);
  /// What the odometry made of a scan.
  void add_registration(const RegistrationReport& report);
  /// @return what changed since the last call, for an event.
  std::optional<std::string_view> update(Stamp now);

 private:
  enum class State { kSound, kSilent, kFalse };

  LidarWatchConfig config_;
  Stamp last_scan_ = -1;         ///< with returns; none yet: -1
  double usual_share_ = 0;       ///< of the scan's points, matched; none yet: 0
  bool false_returns_ = false;   ///< the newest scan
  State state_ = State::kSound;  ///< as told
};

}  // namespace arex
