#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "math/pose.h"
#include "math/types.h"
#include "messages/sensors.h"

/// The state of the LiDAR-inertial filter, its error and its motion model.
///
/// Error state, 28x1: [R_OB, p_OB, v_OB, b_g, b_a, g_O | R_BL, p_BL | s_g, t_d], rotation errors on
/// the right (R <- R Exp(d)). What follows the first bar are the optional online extrinsics and the
/// IMU's intrinsics; with zero covariance they stay where they are. Sources: Xu and Zhang,
/// FAST-LIO, RA-L 2021; AREX paper, eqs. (2)-(3), (6)-(9); t_d as Qin and Shen, IROS 2018, estimate
/// it.
namespace arex {

struct NavigationState {
  Mat3 R_OB = Mat3::Identity();
  Vec3 p_OB = Vec3::Zero();
  Vec3 v_OB = Vec3::Zero();          ///< m/s, in O
  Vec3 b_g = Vec3::Zero();           ///< gyro bias, rad/s, in B
  Vec3 b_a = Vec3::Zero();           ///< accelerometer bias, m/s^2, in B
  Vec3 g_O = Vec3(0, 0, -kGravity);  ///< gravity, m/s^2, in O
  Pose X_BL;                         ///< LiDAR in B
  Vec3 s_g = Vec3::Zero();           ///< the rate is (1 + s_g) times the unbiased reading, per axis
  double t_d = 0;                    ///< s that the IMU's readings lie behind their stamps

  [[nodiscard]] Pose X_OB() const { return {R_OB, p_OB}; }
  /// The body's rate that a reading of the gyro means, rad/s.
  [[nodiscard]] Vec3 rate(const Vec3& gyro) const {
    return (gyro - b_g).cwiseProduct(Vec3::Ones() + s_g);
  }
};

inline constexpr int kErrorDim = 28;
inline constexpr int kNoiseDim = 12;
/// First index of each block of the error state.
enum ErrorBlock : int {
  kRotation = 0,
  kPosition = 3,
  kVelocity = 6,
  kGyroBias = 9,
  kAccelBias = 12,
  kGravityBlock = 15,
  kExtrinsicRotation = 18,
  kExtrinsicPosition = 21,
  kGyroScale = 24,
  kTimeOffset = 27,
};

using ErrorVector = Eigen::Matrix<double, kErrorDim, 1>;
using ErrorMatrix = Eigen::Matrix<double, kErrorDim, kErrorDim>;
using NoiseJacobian = Eigen::Matrix<double, kErrorDim, kNoiseDim>;

/// x [+] d.
NavigationState retract(const NavigationState& x, const ErrorVector& d);
/// y [-] x: the d with retract(x, d) == y.
ErrorVector local(const NavigationState& x, const NavigationState& y);
/// The derivative of local(x, retract(y, d)) by d at 0.
ErrorMatrix local_jacobian(const NavigationState& x, const NavigationState& y);
/// Its inverse.
ErrorMatrix local_jacobian_inverse(const NavigationState& x, const NavigationState& y);

/// The IMU at the two ends of a short interval.
struct ImuInterval {
  Stamp begin = 0;
  Stamp end = 0;
  Vec3 gyro_begin, gyro_end;        ///< rad/s
  Vec3 accel_begin, accel_end;      ///< m/s^2
  Vec3 field_begin = Vec3::Zero();  ///< magnetic, gauss; zero: not measured
  Vec3 gyro_level = Vec3::Zero();   ///< of all intervals at once, without what may be noise, rad/s
  Vec3 gyro_slope = Vec3::Zero();   ///< of the readings over all intervals at once, rad/s^2
  Vec3 accel_slope = Vec3::Zero();  ///< m/s^3
  /// White noise that has the effect of what is unknown of the slopes, per second of delay.
  Vec3 gyro_slope_noise = Vec3::Zero();   ///< rad/s^2/sqrt(Hz)
  Vec3 accel_slope_noise = Vec3::Zero();  ///< m/s^3/sqrt(Hz)
  std::array<bool, 3> gyro_clipped{};     ///< axes of the gyro at their full scale
  bool held = false;                      ///< for want of newer readings, for longer than jitter

  [[nodiscard]] double dt_s() const { return to_seconds(end - begin); }
  [[nodiscard]] Vec3 mean_gyro() const { return 0.5 * (gyro_begin + gyro_end); }
  [[nodiscard]] Vec3 mean_accel() const { return 0.5 * (accel_begin + accel_end); }
};

/// The intervals between the samples that cover [from, to], the first and the last cut to fit.
/// Readings are interpolated; beyond the first and the last sample they are held. Specific force is
/// multiplied by `accel_scale`.
/// @param delay_s that the readings lie behind their stamps
/// @pre samples are in order of time and not empty.
std::vector<ImuInterval> imu_intervals(std::span<const ImuSample> samples, Stamp from, Stamp to,
                                       double accel_scale, double delay_s = 0);

/// Integrates one interval by the midpoint (paper, eqs. (6)-(9)).
NavigationState propagate(const NavigationState& x, const ImuInterval& imu);

/// Jacobians of propagate() by the error state and by the noise [gyro, accel, gyro walk, accel
/// walk]: the exact form of the paper's eq. (3) for the midpoint. The paper's A(u)^T is the right
/// Jacobian of SO(3). Its rows keep first order in dt; the midpoint adds the dt^2/2 of eq. (9).
struct PropagationJacobians {
  ErrorMatrix F;
  NoiseJacobian G;
};
PropagationJacobians propagation_jacobians(const NavigationState& x, const ImuInterval& imu);

}  // namespace arex
