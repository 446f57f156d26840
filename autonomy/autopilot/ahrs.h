#pragma once

#include "autopilot/autopilot_config.h"
#include "messages/estimates.h"
#include "messages/sensors.h"

namespace arex {

/// Attitude and heading from IMU, magnetometer and barometer: a multiplicative error-state Kalman
/// filter.
///
/// Error state, 10x1: [R_AB, b_g, v, h]; rotation error on the right. Frame A: gravity-aligned,
/// x to magnetic north. v is the velocity in A, relative to the air in the horizontal, and h the
/// height above the place of initialisation.
///
/// A flying multicopter's accelerometer measures thrust and drag, not gravity: levelling by it
/// tilts the estimate with every manoeuvre. Instead the specific force is integrated to a velocity
/// and its component in the rotor plane, which is drag, measures that velocity (against the air):
/// a tilt error shows as a velocity that grows without the drag to go with it. On the ground the
/// velocity is known to be zero.
/// Source: Leishman, Macdonald, Beard and McLain, Quadrotors and accelerometers: state estimation
/// with an improved dynamic model, IEEE Control Systems 2014.
class Ahrs {
 public:
  static constexpr int kStates = 10;
  using Covariance = Eigen::Matrix<double, kStates, kStates>;

  explicit Ahrs(const AhrsConfig& config);

  /// Collects the static window, then propagates. @pre stamps increase.
  void add_imu(const ImuSample& imu);
  void add_magnetometer(const MagnetometerSample& sample);
  /// @param noise_pa RMS of its readings, as far as it is known to be a noisy one
  void add_barometer(const BarometerSample& sample, double noise_pa = 0);

  /// Whether the vehicle stands on the ground: its velocity is zero. Initially so.
  void set_on_ground(bool on_ground);

  [[nodiscard]] bool initialised() const { return initialised_; }
  [[nodiscard]] const Mat3& R_AB() const { return R_AB_; }
  [[nodiscard]] const Vec3& gyro_bias() const { return gyro_bias_; }
  /// Velocity in A, m/s: horizontally against the air, vertically against the ground.
  [[nodiscard]] const Vec3& velocity() const { return v_; }
  [[nodiscard]] double height_m() const { return height_; }
  [[nodiscard]] const Covariance& covariance() const { return P_; }

 private:
  using Row = Eigen::Matrix<double, 1, kStates>;

  /// Sums over the static window.
  struct StaticWindow {
    int samples = 0;
    Stamp begin = 0;
    Stamp checked = 0;
    Vec3 gyro = Vec3::Zero(), gyro2 = Vec3::Zero();
    Vec3 accel = Vec3::Zero(), accel2 = Vec3::Zero();
    int fields = 0;
    Vec3 field = Vec3::Zero();
    int pressures = 0;
    double pressure = 0;
  };

  void collect_static(const ImuSample& imu);
  void initialise(const StaticWindow& window);
  void propagate(const ImuSample& imu, double dt);
  void propagate_covariance();
  void correct_window();
  void correct_drag(const Vec3& mean_specific_force);
  void correct(const Row& H, double innovation, double variance, bool heading_only);

  AhrsConfig config_;
  bool initialised_ = false;
  bool on_ground_ = true;
  StaticWindow static_;
  Stamp last_stamp_ = 0;
  Stamp drag_from_ = 0;  ///< before, the feet may still carry what looks like drag

  Mat3 R_AB_ = Mat3::Identity();
  Vec3 gyro_bias_ = Vec3::Zero();
  Vec3 v_ = Vec3::Zero();
  double height_ = 0;
  double ground_pressure_pa_ = 0;  ///< 0 until known
  Covariance P_ = Covariance::Zero();

  // Since the last correction.
  double window_s_ = 0;
  Mat3 R_AB_window_ = Mat3::Identity();         ///< at its begin
  Vec3 window_force_B_ = Vec3::Zero();          ///< integral of the specific force in B, m/s
  Vec3 window_velocity_change_ = Vec3::Zero();  ///< the same in A
};

}  // namespace arex
