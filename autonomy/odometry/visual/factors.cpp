#include "odometry/visual/factors.h"

#include <Eigen/Cholesky>
#include <algorithm>

namespace arex {
namespace {

// Rows of the IMU's residual.
constexpr int kTurn = 0, kSpeed = 3, kWay = 6, kGyroWalk = 9, kAccelWalk = 12;
// Nearer than this share of its distance to the camera's plane, a point is behind it.
constexpr double kLeastForward = 0.05;

Vec3 gravity() { return {0, 0, -kGravity}; }

/// Turn, velocity and way that the IMU measured, by the biases of now.
struct Corrected {
  Mat3 dR;
  Vec3 dv, dp, turn;  ///< turn: what the gyro's bias adds, a rotation vector
};

Corrected corrected(const Preintegration& imu, const FrameState& from) {
  Eigen::Matrix<double, 6, 1> db;
  db << from.b_g - imu.b_g(), from.b_a - imu.b_a();
  const Eigen::Matrix<double, 9, 1> d = imu.bias_jacobian() * db;
  return {imu.dR() * so3::Exp(d.segment<3>(kTurn)), imu.dv() + d.segment<3>(kSpeed),
          imu.dp() + d.segment<3>(kWay), d.segment<3>(kTurn)};
}

/// A landmark on its way from the anchor's ray to an eye, all times its inverse depth, so that a
/// point at infinity is none to divide by.
struct Path {
  Vec3 ray;   ///< anchor's, in its C
  Vec3 in_Bi; ///< in the anchor's B
  Vec3 in_Bj; ///< in the observer's B
  Vec3 in_Cj; ///< in the observer's C
  Vec3 in_eye;
};

/// The frame's pose when it was exposed by this t_d.
FrameState exposed(const FrameState& x, const FrameTiming& timing, double t_d) {
  FrameState moved = x;
  const double late_s = t_d - timing.placed_by;
  moved.R_OB = x.R_OB * so3::Exp(late_s * timing.rate);
  moved.p_OB = x.p_OB + late_s * x.v_OB;
  return moved;
}

Path path_of(const Sight& s, const FrameState& i, const FrameState& j, const CameraState& camera,
             double rho) {
  Path path;
  path.ray = s.anchor.left.homogeneous();
  path.in_Bi = camera.X_BC.R * path.ray + rho * camera.X_BC.p;
  path.in_Bj = j.R_OB.transpose() * (i.R_OB * path.in_Bi + rho * (i.p_OB - j.p_OB));
  path.in_Cj = camera.X_BC.R.transpose() * (path.in_Bj - rho * camera.X_BC.p);
  path.in_eye = path.in_Cj - (s.right ? rho * s.baseline_m : 0.0) * Vec3::UnitX();
  return path;
}

bool own_right(const Sight& s) { return &s.anchor == &s.seen; }

}  // namespace

ImuResidual imu_residual(const Preintegration& imu, const FrameState& from, const FrameState& to) {
  const double dt = imu.dt_s();
  const Corrected c = corrected(imu, from);
  const Mat3 to_body = from.R_OB.transpose();
  ImuResidual r;
  r.segment<3>(kTurn) = so3::Log(c.dR.transpose() * to_body * to.R_OB);
  r.segment<3>(kSpeed) = to_body * (to.v_OB - from.v_OB - dt * gravity()) - c.dv;
  r.segment<3>(kWay) =
      to_body * (to.p_OB - from.p_OB - dt * from.v_OB - 0.5 * dt * dt * gravity()) - c.dp;
  r.segment<3>(kGyroWalk) = to.b_g - from.b_g;
  r.segment<3>(kAccelWalk) = to.b_a - from.b_a;
  return r;
}

ImuJacobians imu_jacobians(const Preintegration& imu, const FrameState& from,
                           const FrameState& to) {
  const double dt = imu.dt_s();
  const Corrected c = corrected(imu, from);
  const auto& J = imu.bias_jacobian();
  const Mat3 to_body = from.R_OB.transpose();
  const Vec3 r = so3::Log(c.dR.transpose() * to_body * to.R_OB);
  const Mat3 inverse = so3::right_jacobian_inverse(r);
  ImuJacobians out{ImuJacobian::Zero(), ImuJacobian::Zero()};

  out.from.block<3, 3>(kTurn, kRotation) = -inverse * to.R_OB.transpose() * from.R_OB;
  out.from.block<3, 3>(kTurn, kGyroBias) =
      -inverse * so3::Exp(-r) * so3::right_jacobian(c.turn) * J.block<3, 3>(kTurn, 0);
  out.to.block<3, 3>(kTurn, kRotation) = inverse;

  out.from.block<3, 3>(kSpeed, kRotation) =
      so3::hat(to_body * (to.v_OB - from.v_OB - dt * gravity()));
  out.from.block<3, 3>(kSpeed, kVelocity) = -to_body;
  out.from.block<3, 6>(kSpeed, kGyroBias) = -J.block<3, 6>(kSpeed, 0);
  out.to.block<3, 3>(kSpeed, kVelocity) = to_body;

  out.from.block<3, 3>(kWay, kRotation) = so3::hat(
      to_body * (to.p_OB - from.p_OB - dt * from.v_OB - 0.5 * dt * dt * gravity()));
  out.from.block<3, 3>(kWay, kPosition) = -to_body;
  out.from.block<3, 3>(kWay, kVelocity) = -dt * to_body;
  out.from.block<3, 6>(kWay, kGyroBias) = -J.block<3, 6>(kWay, 0);
  out.to.block<3, 3>(kWay, kPosition) = to_body;

  for (const auto& [row, column] : {std::pair{kGyroWalk, +kGyroBias}, {kAccelWalk, +kAccelBias}}) {
    out.from.block<3, 3>(row, column) = -Mat3::Identity();
    out.to.block<3, 3>(row, column) = Mat3::Identity();
  }
  return out;
}

ImuJacobian imu_whitening(const Preintegration& imu) {
  // A camera twice as fast as the IMU's rate has intervals of nothing; keep their information
  // finite: 1e-7 rad, m/s and m.
  constexpr double kLeastVariance = 1e-14;
  ImuJacobian W = ImuJacobian::Zero();
  Preintegration::Covariance P = imu.covariance();
  P.diagonal().array() += kLeastVariance;
  const Preintegration::Covariance L = P.llt().matrixL();
  W.topLeftCorner<9, 9>() =
      L.triangularView<Eigen::Lower>().solve(Preintegration::Covariance::Identity());
  const double root_s = std::sqrt(std::max(imu.dt_s(), 1e-6));
  W.diagonal().segment<3>(kGyroWalk).setConstant(
      1 / std::max(imu.noise().gyro_walk_density * root_s, 1e-9));
  W.diagonal().segment<3>(kAccelWalk).setConstant(
      1 / std::max(imu.noise().accel_walk_density * root_s, 1e-9));
  return W;
}

std::optional<Vec2> sight_residual(const Sight& sight, const FrameState& anchor,
                                   const FrameState& seen, const CameraState& camera,
                                   double inverse_depth) {
  if (own_right(sight)) {
    // Both eyes are exposed at once.
    return Vec2(sight.anchor.left - inverse_depth * sight.baseline_m * Vec2::UnitX() -
                *sight.anchor.right);
  }
  const Vec3 p = path_of(sight, exposed(anchor, sight.anchor_timing, camera.t_d),
                         exposed(seen, sight.seen_timing, camera.t_d), camera, inverse_depth)
                     .in_eye;
  if (p.z() < kLeastForward * p.norm()) return std::nullopt;
  const Vec2& z = sight.right ? *sight.seen.right : sight.seen.left;
  return Vec2(p.head<2>() / p.z() - z);
}

SightJacobians sight_jacobians(const Sight& sight, const FrameState& placed_anchor,
                               const FrameState& placed_seen, const CameraState& camera,
                               double inverse_depth) {
  SightJacobians J;
  if (own_right(sight)) {
    J.anchor.setZero();
    J.seen.setZero();
    J.camera.setZero();
    J.inverse_depth = -sight.baseline_m * Vec2::UnitX();
    return J;
  }
  const double rho = inverse_depth;
  const FrameTiming &at_anchor = sight.anchor_timing, &at_seen = sight.seen_timing;
  const FrameState anchor = exposed(placed_anchor, at_anchor, camera.t_d);
  const FrameState seen = exposed(placed_seen, at_seen, camera.t_d);
  const Path path = path_of(sight, anchor, seen, camera, rho);
  const Vec3& p = path.in_eye;
  Eigen::Matrix<double, 2, 3> D;  // of the projection
  D << 1 / p.z(), 0, -p.x() / (p.z() * p.z()), 0, 1 / p.z(), -p.y() / (p.z() * p.z());

  const Mat3& R_BC = camera.X_BC.R;
  const Eigen::Matrix<double, 2, 3> by_Bj = D * R_BC.transpose();
  const Eigen::Matrix<double, 2, 3> by_O = by_Bj * seen.R_OB.transpose();
  const Eigen::Matrix<double, 2, 3> by_Bi = by_O * anchor.R_OB;
  J.anchor.leftCols<3>() = -by_Bi * so3::hat(path.in_Bi);
  J.anchor.rightCols<3>() = rho * by_O;
  J.seen.leftCols<3>() = by_Bj * so3::hat(path.in_Bj);
  J.seen.rightCols<3>() = -rho * by_O;
  const Eigen::Matrix<double, 2, 3> by_ray = by_Bi * R_BC;
  J.camera.leftCols<3>() = -by_ray * so3::hat(path.ray) + D * so3::hat(path.in_Cj);
  J.camera.middleCols<3>(3) = rho * (by_Bi - by_Bj);
  J.camera.col(kCameraTime) =
      J.anchor.leftCols<3>() * at_anchor.rate + J.anchor.rightCols<3>() * anchor.v_OB +
      J.seen.leftCols<3>() * at_seen.rate + J.seen.rightCols<3>() * seen.v_OB;
  // An error of the placed attitude is one of the exposed, turned by what lies between.
  J.anchor.leftCols<3>() *= so3::Exp(-(camera.t_d - at_anchor.placed_by) * at_anchor.rate);
  J.seen.leftCols<3>() *= so3::Exp(-(camera.t_d - at_seen.placed_by) * at_seen.rate);
  J.inverse_depth = by_Bi * camera.X_BC.p + by_O * (anchor.p_OB - seen.p_OB) -
                    by_Bj * camera.X_BC.p - (sight.right ? sight.baseline_m : 0.0) * D.col(0);
  return J;
}

std::optional<double> triangulate(const Landmark& landmark,
                                  const std::vector<const FrameState*>& frames,
                                  const CameraState& camera, double baseline_m) {
  const FrameState& i = *frames.front();
  const Vec3 ray_B = camera.X_BC.R * landmark.seen.front().left.homogeneous();
  double weight = 0, sum = 0;
  // z x (at_infinity + rho nearer) = 0, two rows an eye.
  const auto add = [&](const Vec3& at_infinity, const Vec3& nearer, const Vec2& z) {
    const Vec2 slope = nearer.head<2>() - z * nearer.z();
    const Vec2 rest = at_infinity.head<2>() - z * at_infinity.z();
    weight += slope.squaredNorm();
    sum -= slope.dot(rest);
  };
  for (std::size_t k = 0; k < landmark.seen.size(); ++k) {
    const Observation& o = landmark.seen[k];
    const FrameState& j = *frames[k];
    const Mat3 to_C = (j.R_OB * camera.X_BC.R).transpose();
    const Vec3 far = to_C * i.R_OB * ray_B;
    const Vec3 near = to_C * (i.R_OB * camera.X_BC.p + i.p_OB - j.p_OB - j.R_OB * camera.X_BC.p);
    if (k > 0) add(far, near, o.left);
    if (o.right) add(far, near - baseline_m * Vec3::UnitX(), *o.right);
  }
  constexpr double kLeastBase = 0.01;  // m, across the rays
  if (weight < kLeastBase * kLeastBase) return std::nullopt;
  constexpr double kLeast = -0.1;  // 1/m: two pixels of the pair's disparity
  const double rho = sum / weight;
  if (!(rho > kLeast)) return std::nullopt;
  return std::max(rho, 1 / kBackdrop);
}

}  // namespace arex
