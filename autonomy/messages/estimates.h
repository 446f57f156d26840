#pragma once

#include <Eigen/Core>
#include <array>
#include <string_view>
#include <vector>

#include "math/pose.h"
#include "math/types.h"
#include "messages/events.h"

/// What the modules of the stack tell each other.
namespace arex {

/// Health of an odometry source.
enum class OdometryStatus { kInitialising, kOk, kDegenerate, kLost };
inline constexpr std::array<std::string_view, 4> kOdometryStatusNames{"initialising", "ok",
                                                                      "degenerate", "lost"};

/// Pose and velocity of B in O at `stamp`.
struct Odometry {
  Stamp stamp = 0;
  Stamp correction_stamp = 0;  ///< of the newest measurement other than the IMU that it contains
  Pose X_OB;
  Vec3 v_OB = Vec3::Zero();    ///< m/s, in O
  Vec3 w_OB_B = Vec3::Zero();  ///< rad/s, in B, bias removed
  /// Of [rotation in B, position in O], rad and m; zero: not known.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  OdometryStatus status = OdometryStatus::kInitialising;
};

/// The autopilot's own attitude estimate; its heading reference A differs from O's by a yaw.
struct AttitudeEstimate {
  Stamp stamp = 0;
  Mat3 R_AB = Mat3::Identity();
  Vec3 w_AB_B = Vec3::Zero();  ///< rad/s, in B, bias removed
};

/// What the autopilot tells the stack, 200 Hz.
struct AutopilotStatus {
  AttitudeEstimate attitude;
  bool ready = false;  ///< may be armed
  bool armed = false;
  bool follows = false;          ///< armed, and past its spin-up: tracks commands
  bool landed = true;            ///< not in the air as far as it knows
  std::vector<Event> notices{};  ///< what it has found to be wrong since it last told
};

/// Where the vehicle should be at one moment, in O.
struct TrajectorySetpoint {
  Vec3 p_OB = Vec3::Zero();
  Vec3 v_OB = Vec3::Zero();
  Vec3 a_OB = Vec3::Zero();
  double yaw_rad = 0;
  double yaw_rate_radps = 0;
};

}  // namespace arex
