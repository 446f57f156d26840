#include "run/perfect_tracking.h"

#include "control/tracker.h"
#include "math/so3.h"

namespace arex::sim {
namespace {

// Fast beside what is flown, slow beside the tick: an error is gone within half a second.
constexpr double kPositionBandwidth = 8;  // rad/s
constexpr double kAttitudeBandwidth = 25;
// A jump of the estimate is made up for, not leapt over.
constexpr double kMostAcceleration = 15;  // m/s^2
constexpr double kMostAngular = 200;      // rad/s^2

Vec3 limited(const Vec3& v, double most) {
  const double norm = v.norm();
  return norm > most ? Vec3(v * (most / norm)) : v;
}

/// The pull of a critically damped spring.
Vec3 spring(double bandwidth, const Vec3& error, const Vec3& rate_error) {
  return bandwidth * bandwidth * error + 2 * bandwidth * rate_error;
}

CarriedMotion limited(const Vec3& a_WB, const Vec3& alpha_WB_B) {
  return {limited(a_WB, kMostAcceleration), limited(alpha_WB_B, kMostAngular)};
}

}  // namespace

bool has_setpoint(const FlightView& view) {
  return view.odometry.status != OdometryStatus::kInitialising &&
         view.odometry.status != OdometryStatus::kLost && view.state != MissionState::kLost;
}

CarriedMotion carried_along(const FlightView& view, const Truth& truth) {
  const TrajectorySetpoint& setpoint = view.setpoint;
  const Odometry& odometry = view.odometry;
  // From the frame in which the software thinks to the world, as far as a heading can tell.
  const Mat3 R_WO = heading_between(truth.X_WB.R, odometry.X_OB.R);
  const Vec3 missing =
      spring(kPositionBandwidth, setpoint.p_OB - odometry.X_OB.p, setpoint.v_OB - odometry.v_OB);
  const Mat3 R_WB_wanted =
      R_WO * attitude_from_force(setpoint.a_OB + Vec3(0, 0, kGravity), setpoint.yaw_rad);
  const Vec3 turn = so3::Log(truth.X_WB.R.transpose() * R_WB_wanted);
  const Vec3 rate = truth.X_WB.R.transpose() * Vec3(0, 0, setpoint.yaw_rate_radps);
  return limited(R_WO * (setpoint.a_OB + missing),
                 spring(kAttitudeBandwidth, turn, rate - truth.w_WB_B));
}

CarriedMotion carried_down(double descent_speed_mps, const Truth& truth) {
  const Vec3 too_slow = Vec3(0, 0, -descent_speed_mps) - truth.v_WB;
  const Mat3 level = so3::from_yaw(so3::yaw(truth.X_WB.R));
  const Vec3 turn = so3::Log(truth.X_WB.R.transpose() * level);
  return limited(spring(kPositionBandwidth, Vec3::Zero(), too_slow),
                 spring(kAttitudeBandwidth, turn, -truth.w_WB_B));
}

}  // namespace arex::sim
