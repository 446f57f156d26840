#pragma once

#include "math/types.h"
#include "messages/estimates.h"
#include "messages/vehicle.h"

namespace arex {

struct TrackerConfig {
  Vec3 position_gain{11.1, 11.1, 12.0};  ///< kx, N/m at 1.9 kg
  Vec3 velocity_gain{6.6, 6.6, 7.8};     ///< kv, N/(m/s) at 1.9 kg
  double tilt_limit_rad = to_radians(45);
  double min_lift_fraction = 0.2;  ///< of the weight: the vertical force is never less in the air
  double max_lift_fraction = 1.8;
  bool observe_disturbance = true;
  double observer_bandwidth_radps = 1.5;
  double observer_limit_n = 4.0;  ///< a fifth of the weight
  double attitude_lag_s = 0.15;   ///< from the demanded force to the real one
  double rate_hz = 100;           ///< paper, III-A

  void fields(auto& f) {
    f("position_gain", position_gain, "kx: force per position error, N/m");
    f("velocity_gain", velocity_gain, "kv: force per velocity error, N/(m/s)");
    f("tilt_limit_rad", tilt_limit_rad, "largest tilt of the demanded force");
    f("min_lift_fraction", min_lift_fraction, "least vertical force, part of the weight");
    f("max_lift_fraction", max_lift_fraction, "largest vertical force, part of the weight");
    f("observe_disturbance", observe_disturbance, "take wind, drag and trim errors from the PD");
    f("observer_bandwidth_radps", observer_bandwidth_radps, "of the disturbance observer");
    f("observer_limit_n", observer_limit_n, "largest disturbance it believes, each axis");
    f("attitude_lag_s", attitude_lag_s, "time constant from demanded to real force");
    f("rate_hz", rate_hz, "how often the tracker runs (paper, III-A)");
    f.check(tilt_limit_rad > 0 && tilt_limit_rad < 1.5, "0 < tilt_limit_rad < 1.5");
    f.check(min_lift_fraction > 0 && min_lift_fraction < 1, "0 < min_lift_fraction < 1");
    f.check(max_lift_fraction > 1, "max_lift_fraction > 1");
    f.check(observer_bandwidth_radps > 0, "observer_bandwidth_radps > 0");
    f.check(observer_limit_n >= 0, "observer_limit_n >= 0");
    f.check(attitude_lag_s > 0, "attitude_lag_s > 0");
    f.check(rate_hz > 0 && rate_hz <= 1000, "0 < rate_hz <= 1000");
  }
};

/// What the tracker asks for, in O.
struct TrackerOutput {
  Vec3 force_O = Vec3::Zero();           ///< demanded force, N, limits applied
  Mat3 R_OB_desired = Mat3::Identity();  ///< z along the force, heading as the setpoint says
  double yaw_rate_radps = 0;
  double thrust_n = 0;  ///< the force along the present body z
};

/// PD trajectory tracking: F = m g e3 + kx e_p + kv e_v + m a_des - F_d.
///
/// F_d is what a momentum observer attributes to wind, drag, thrust errors and a tilted attitude
/// estimate: d/dt F_d = L (m dv/dt - (F - m g e3) - F_d), F being the force demanded so far behind
/// the inner loop's lag. The paper's controller is the PD alone (observe_disturbance: false); that
/// stands off by F_d / kx, 8 cm in the drag of 1.5 m/s.
/// Source: Lee, Leok and McClamroch, Geometric tracking control of a quadrotor UAV on SE(3), 2010;
/// De Luca et al., Collision detection and safe reaction, 2006 (momentum observer).
class Tracker {
 public:
  Tracker(const TrackerConfig& config, const VehicleConfig& vehicle);

  /// One step at rate_hz. Without `in_flight` (feet on the ground) the observer stands still.
  TrackerOutput update(const TrajectorySetpoint& setpoint, const Odometry& odometry,
                       bool in_flight);

  /// Forgets the disturbance and the past.
  void reset();

  [[nodiscard]] const Vec3& disturbance_n() const { return disturbance_; }

 private:
  void observe(const Vec3& v_OB);
  [[nodiscard]] Vec3 limit(const Vec3& force) const;

  TrackerConfig config_;
  double mass_kg_;
  Vec3 disturbance_ = Vec3::Zero();
  Vec3 lagged_force_ = Vec3::Zero();
  Vec3 last_velocity_ = Vec3::Zero();
  Vec3 last_force_ = Vec3::Zero();
  bool flying_ = false;
};

/// The attitude whose z axis lies along `force` and whose x axis points to `yaw_rad`.
/// @pre force is not horizontal.
Mat3 attitude_from_force(const Vec3& force, double yaw_rad);

/// R_AO, the rotation from the odometry's frame to the autopilot's heading reference, from the two
/// attitudes of (nearly) one moment. Both frames are gravity-aligned, so it is a pure yaw: the one
/// nearest to R_AB R_OB^T. The command is then R_AB_desired = R_AO * R_OB_desired.
///
/// Only the yaw is taken over on purpose. The full product would make the autopilot track the
/// odometry's tilt, with its latency, its jumps at corrections and its failures; with the yaw alone
/// the fast loop levels by the autopilot's own estimate, which cannot be lost, and a constant
/// difference between the two tilts is one more disturbance for the tracker.
Mat3 heading_between(const Mat3& R_AB, const Mat3& R_OB);

}  // namespace arex
