#pragma once

#include <vector>

#include "control/s_curve.h"
#include "math/types.h"
#include "messages/estimates.h"

namespace arex {

struct TimedPathConfig {
  double max_speed_mps = 1.5;
  double max_acceleration_mps2 = 1.5;
  double max_jerk_mps3 = 3.0;
  double climb_speed_mps = 0.8;  ///< of vertical legs
  double landing_speed_mps = 0.4;
  double max_yaw_rate_radps = 1.0;
  double max_yaw_acceleration_radps2 = 1.5;
  double max_yaw_jerk_radps3 = 4.0;
  double moving_heading_rad = 0.5;  ///< a leg starts once the nose is this close to its direction

  void fields(auto& f) {
    f("max_speed_mps", max_speed_mps, "speed along a leg");
    f("max_acceleration_mps2", max_acceleration_mps2, "acceleration along a leg");
    f("max_jerk_mps3", max_jerk_mps3, "jerk along a leg");
    f("climb_speed_mps", climb_speed_mps, "speed along a vertical leg");
    f("landing_speed_mps", landing_speed_mps, "speed of the landing");
    f("max_yaw_rate_radps", max_yaw_rate_radps, "yaw rate");
    f("max_yaw_acceleration_radps2", max_yaw_acceleration_radps2, "yaw acceleration");
    f("max_yaw_jerk_radps3", max_yaw_jerk_radps3, "yaw jerk");
    f("moving_heading_rad", moving_heading_rad, "a leg starts once the nose is this close to it");
    f.check(max_speed_mps > 0, "max_speed_mps > 0");
    f.check(max_acceleration_mps2 > 0, "max_acceleration_mps2 > 0");
    f.check(max_jerk_mps3 > 0, "max_jerk_mps3 > 0");
    f.check(climb_speed_mps > 0, "climb_speed_mps > 0");
    f.check(landing_speed_mps > 0, "landing_speed_mps > 0");
    f.check(max_yaw_rate_radps > 0, "max_yaw_rate_radps > 0");
    f.check(max_yaw_acceleration_radps2 > 0, "max_yaw_acceleration_radps2 > 0");
    f.check(max_yaw_jerk_radps3 > 0, "max_yaw_jerk_radps3 > 0");
    f.check(moving_heading_rad > 0, "moving_heading_rad > 0");
  }
};

/// A path in O as a function of time: straight legs from rest to rest, so that it never leaves the
/// lines that were checked for collisions. The nose turns into each leg, before it when the turn is
/// large, within the yaw limits. Position, velocity, acceleration, yaw and yaw rate are continuous.
class TimedPath {
 public:
  TimedPath(const TimedPathConfig& config, const Vec3& start_p_O, double start_yaw_rad);

  /// A leg to `p_O` at the configured speed, nose ahead; a vertical leg keeps the heading.
  void fly_to(const Vec3& p_O);
  /// Straight up or down to height `z_m` without turning.
  void climb_to(double z_m);
  /// The same at landing speed. A target below the ground takes the thrust away after touchdown.
  void land_to(double z_m);
  /// Stays.
  void wait(double duration_s);

  /// The setpoint at `time_s` after the start; at rest at the ends before and after.
  [[nodiscard]] TrajectorySetpoint sample(double time_s) const;
  [[nodiscard]] double duration_s() const { return duration_; }
  [[nodiscard]] const Vec3& end() const { return p_; }
  [[nodiscard]] double end_yaw_rad() const { return yaw_; }

 private:
  struct Leg {
    double begin = 0;
    double move_begin = 0;  ///< after the leg's begin: the turn comes first
    Vec3 from = Vec3::Zero();
    Vec3 direction = Vec3::Zero();  ///< unit
    SCurve motion;
    double yaw_from = 0;
    double yaw_sign = 1;
    SCurve turn;
  };

  void append(const Vec3& p_O, double speed_mps, double yaw_rad, double duration_s);

  TimedPathConfig config_;
  std::vector<Leg> legs_;
  Vec3 p_;
  double yaw_;
  double duration_ = 0;
};

}  // namespace arex
