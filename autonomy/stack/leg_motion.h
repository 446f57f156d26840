#pragma once

#include "control/timed_path.h"
#include "mapping/grid_view.h"
#include "messages/estimates.h"
#include "messages/motion.h"

namespace arex {

/// How the motion side answers a weak odometry.
struct CautionConfig {
  double degenerate_speed_fraction = 0.4;  ///< of the path's speed while the odometry is degenerate
  double change_per_s = 1.0;               ///< how fast the speed fraction changes

  void fields(auto& f) {
    f("degenerate_speed_fraction", degenerate_speed_fraction,
      "part of the speed that is flown while the odometry is degenerate");
    f("change_per_s", change_per_s, "how fast that part changes");
    f.check(degenerate_speed_fraction > 0 && degenerate_speed_fraction <= 1,
            "0 < degenerate_speed_fraction <= 1");
    f.check(change_per_s > 0, "change_per_s > 0");
  }
};

/// Motion along straight legs: turns the mission's requests into setpoints on a timed path. The
/// path's own clock runs slower while the odometry is degenerate.
class LegMotion {
 public:
  LegMotion(const TimedPathConfig& path, const CautionConfig& caution);

  /// Takes the vehicle over at rest at the setpoint of another module.
  void take_over(const TrajectorySetpoint& from);
  /// After a jump of the pose: what is asked for is flown anew from `from`.
  void start_again(const TrajectorySetpoint& from);

  /// One control step. @param follows the autopilot is past its spin-up.
  TrajectorySetpoint update(Stamp now, const MotionRequest& request, const Odometry& odometry,
                            bool follows);

  /// Looks ahead along the leg: while something stands there the path's clock is stopped. A leg is
  /// known to be free by who asks for it; this is for when that is not so.
  void look_ahead(const GridView& grid, double radius_m);
  [[nodiscard]] bool blocked() const { return blocked_; }

 private:
  void plan(const MotionRequest& request, const Odometry& odometry);
  void advance_clock(Stamp now, const Odometry& odometry);
  [[nodiscard]] TrajectorySetpoint sample() const;

  TimedPathConfig path_config_;
  CautionConfig caution_;
  MotionRequest request_;  ///< the one that path_ serves
  TimedPath path_;
  bool started_ = false;
  bool blocked_ = false;  ///< by what the newest grid shows
  double path_time_s_ = 0;
  double clock_rate_ = 1;          ///< path seconds per second
  double clock_acceleration_ = 0;  ///< 1/s
  double spin_yaw_rad_ = 0;        ///< turned beyond the path's end
  double spin_rate_radps_ = 0;
  Stamp last_ = 0;
};

}  // namespace arex
