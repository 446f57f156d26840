#include "odometry/inertial/navigation_state.h"

#include <algorithm>
#include <iterator>

#include "math/so3.h"

namespace arex {

NavigationState retract(const NavigationState& x, const ErrorVector& d) {
  NavigationState y;
  y.R_OB = x.R_OB * so3::Exp(d.segment<3>(kRotation));
  y.p_OB = x.p_OB + d.segment<3>(kPosition);
  y.v_OB = x.v_OB + d.segment<3>(kVelocity);
  y.b_g = x.b_g + d.segment<3>(kGyroBias);
  y.b_a = x.b_a + d.segment<3>(kAccelBias);
  y.g_O = x.g_O + d.segment<3>(kGravityBlock);
  y.X_BL.R = x.X_BL.R * so3::Exp(d.segment<3>(kExtrinsicRotation));
  y.X_BL.p = x.X_BL.p + d.segment<3>(kExtrinsicPosition);
  y.s_g = x.s_g + d.segment<3>(kGyroScale);
  y.t_d = x.t_d + d[kTimeOffset];
  return y;
}

ErrorVector local(const NavigationState& x, const NavigationState& y) {
  ErrorVector d;
  d.segment<3>(kRotation) = so3::Log(x.R_OB.transpose() * y.R_OB);
  d.segment<3>(kPosition) = y.p_OB - x.p_OB;
  d.segment<3>(kVelocity) = y.v_OB - x.v_OB;
  d.segment<3>(kGyroBias) = y.b_g - x.b_g;
  d.segment<3>(kAccelBias) = y.b_a - x.b_a;
  d.segment<3>(kGravityBlock) = y.g_O - x.g_O;
  d.segment<3>(kExtrinsicRotation) = so3::Log(x.X_BL.R.transpose() * y.X_BL.R);
  d.segment<3>(kExtrinsicPosition) = y.X_BL.p - x.X_BL.p;
  d.segment<3>(kGyroScale) = y.s_g - x.s_g;
  d[kTimeOffset] = y.t_d - x.t_d;
  return d;
}

ErrorMatrix local_jacobian(const NavigationState& x, const NavigationState& y) {
  ErrorMatrix J = ErrorMatrix::Identity();
  J.block<3, 3>(kRotation, kRotation) =
      so3::right_jacobian_inverse(so3::Log(x.R_OB.transpose() * y.R_OB));
  J.block<3, 3>(kExtrinsicRotation, kExtrinsicRotation) =
      so3::right_jacobian_inverse(so3::Log(x.X_BL.R.transpose() * y.X_BL.R));
  return J;
}

ErrorMatrix local_jacobian_inverse(const NavigationState& x, const NavigationState& y) {
  ErrorMatrix J = ErrorMatrix::Identity();
  J.block<3, 3>(kRotation, kRotation) = so3::right_jacobian(so3::Log(x.R_OB.transpose() * y.R_OB));
  J.block<3, 3>(kExtrinsicRotation, kExtrinsicRotation) =
      so3::right_jacobian(so3::Log(x.X_BL.R.transpose() * y.X_BL.R));
  return J;
}

namespace {

/// The reading at `stamp`, interpolated between the samples around it.
void read_imu(std::span<const ImuSample> samples, Stamp stamp, double accel_scale, Vec3& gyro,
              Vec3& accel, Vec3& field) {
  const auto after =
      std::lower_bound(samples.begin(), samples.end(), stamp,
                       [](const ImuSample& sample, Stamp t) { return sample.stamp < t; });
  if (after == samples.begin() || after == samples.end()) {
    const ImuSample& held = after == samples.end() ? samples.back() : *after;
    gyro = held.gyro_radps;
    accel = accel_scale * held.accel_mps2;
    field = held.field_gauss;
    return;
  }
  const ImuSample& a = *(after - 1);
  const ImuSample& b = *after;
  const double s = static_cast<double>(stamp - a.stamp) / static_cast<double>(b.stamp - a.stamp);
  gyro = a.gyro_radps + s * (b.gyro_radps - a.gyro_radps);
  accel = accel_scale * (a.accel_mps2 + s * (b.accel_mps2 - a.accel_mps2));
  field = a.field_gauss + s * (b.field_gauss - a.field_gauss);
}

}  // namespace

std::vector<ImuInterval> imu_intervals(std::span<const ImuSample> samples, Stamp from, Stamp to,
                                       double accel_scale, double delay_s) {
  constexpr Stamp kJitter = kNanosecondsPerSecond / 200;
  std::vector<ImuInterval> intervals;
  if (to <= from) return intervals;
  const Stamp delay = from_seconds(delay_s);
  from += delay;
  to += delay;
  ImuInterval interval;
  interval.begin = from;
  Vec3 field_end = Vec3::Zero();
  read_imu(samples, from, accel_scale, interval.gyro_begin, interval.accel_begin,
           interval.field_begin);
  auto next = std::upper_bound(samples.begin(), samples.end(), from,
                               [](Stamp t, const ImuSample& sample) { return t < sample.stamp; });
  while (interval.begin < to) {
    interval.end = next == samples.end() ? to : std::min(next->stamp, to);
    read_imu(samples, interval.end, accel_scale, interval.gyro_end, interval.accel_end, field_end);
    interval.held = interval.begin >= samples.back().stamp && to - samples.back().stamp > kJitter;
    intervals.push_back(interval);
    interval.begin = interval.end;
    interval.gyro_begin = interval.gyro_end;
    interval.accel_begin = interval.accel_end;
    interval.field_begin = field_end;
    if (next != samples.end()) ++next;
  }
  for (ImuInterval& covered : intervals) {
    covered.begin -= delay;
    covered.end -= delay;
  }
  return intervals;
}

NavigationState propagate(const NavigationState& x, const ImuInterval& imu) {
  const double dt = imu.dt_s();
  NavigationState y = x;
  y.R_OB = x.R_OB * so3::Exp(x.rate(imu.mean_gyro()) * dt);         // eq. (7)
  const Vec3 a_begin = x.R_OB * (imu.accel_begin - x.b_a) + x.g_O;  // eq. (6)
  const Vec3 a_end = y.R_OB * (imu.accel_end - x.b_a) + x.g_O;
  const Vec3 a = 0.5 * (a_begin + a_end);             // eq. (8)
  y.p_OB = x.p_OB + x.v_OB * dt + 0.5 * dt * dt * a;  // eq. (9)
  y.v_OB = x.v_OB + a * dt;                           // eq. (9)
  return y;
}

PropagationJacobians propagation_jacobians(const NavigationState& x, const ImuInterval& imu) {
  const double dt = imu.dt_s();
  const Vec3 phi = x.rate(imu.mean_gyro()) * dt;
  const Mat3 turn = so3::Exp(-phi);
  const Mat3 A_T_dt = so3::right_jacobian(phi) * dt;  // the paper's A(phi)^T dt
  const Mat3 R_end = x.R_OB * turn.transpose();
  const Mat3 lever_begin = x.R_OB * so3::hat(imu.accel_begin - x.b_a);
  const Mat3 lever_end = R_end * so3::hat(imu.accel_end - x.b_a);

  // How the interval's mean acceleration answers to each error.
  const Mat3 a_by_rotation = -0.5 * (lever_begin + lever_end * turn);
  const Mat3 a_by_turn = -0.5 * lever_end;  // of the attitude at the end
  const Mat3 a_by_accel_bias = -0.5 * (x.R_OB + R_end);

  // How the turn answers to the gyro's errors. A later reading is another one by its slope.
  const Vec3 scale = Vec3::Ones() + x.s_g;
  const Mat3 turn_by_gyro_bias = -A_T_dt * scale.asDiagonal();
  const Mat3 turn_by_gyro_scale = A_T_dt * (imu.gyro_level - x.b_g).asDiagonal();
  const Vec3 turn_by_time = A_T_dt * scale.cwiseProduct(imu.gyro_slope);
  const Vec3 a_by_time = a_by_turn * turn_by_time - a_by_accel_bias * imu.accel_slope;

  PropagationJacobians out;
  ErrorMatrix& F = out.F;
  F.setIdentity();
  F.block<3, 3>(kRotation, kRotation) = turn;
  F.block<3, 3>(kRotation, kGyroBias) = turn_by_gyro_bias;
  F.block<3, 3>(kRotation, kGyroScale) = turn_by_gyro_scale;
  F.block<3, 1>(kRotation, kTimeOffset) = turn_by_time;
  const auto add_acceleration = [&](int row, double factor) {
    F.block<3, 3>(row, kRotation) = factor * a_by_rotation;
    F.block<3, 3>(row, kGyroBias) = factor * a_by_turn * turn_by_gyro_bias;
    F.block<3, 3>(row, kGyroScale) = factor * a_by_turn * turn_by_gyro_scale;
    F.block<3, 1>(row, kTimeOffset) = factor * a_by_time;
    F.block<3, 3>(row, kAccelBias) = factor * a_by_accel_bias;
    F.block<3, 3>(row, kGravityBlock) = factor * Mat3::Identity();
  };
  add_acceleration(kVelocity, dt);
  add_acceleration(kPosition, 0.5 * dt * dt);
  F.block<3, 3>(kPosition, kVelocity) = dt * Mat3::Identity();

  // A measured rate or force errs as a bias would, for one interval.
  NoiseJacobian& G = out.G;
  G.setZero();
  G.block<kErrorDim, 3>(0, 0) = F.block<kErrorDim, 3>(0, kGyroBias);
  G.block<3, 3>(kGyroBias, 0).setZero();
  G.block<kErrorDim, 3>(0, 3) = F.block<kErrorDim, 3>(0, kAccelBias);
  G.block<3, 3>(kAccelBias, 3).setZero();
  G.block<3, 3>(kGyroBias, 6) = dt * Mat3::Identity();
  G.block<3, 3>(kAccelBias, 9) = dt * Mat3::Identity();
  return out;
}

}  // namespace arex
