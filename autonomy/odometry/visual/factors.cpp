#include "odometry/visual/factors.h"

#include <Eigen/Cholesky>
#include <algorithm>

namespace arex {
namespace {

// Rows of the IMU's residual below those of the preintegration's error.
constexpr int kImuGyroWalk = 9, kImuAccelWalk = 12;
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
  return {imu.dR() * so3::Exp(d.segment<3>(kImuTurn)), imu.dv() + d.segment<3>(kImuSpeed),
          imu.dp() + d.segment<3>(kImuWay), d.segment<3>(kImuTurn)};
}

/// A landmark on its way from the anchor's ray to an eye, all times its inverse depth, so that a
/// point at infinity is none to divide by.
struct Path {
  Vec3 ray;    ///< anchor's, in its C
  Vec3 in_Bi;  ///< in the anchor's B
  Vec3 in_Bj;  ///< in the observer's B
  Vec3 in_Cj;  ///< in the observer's C
};

Path path_of(const Exposure& i, const Exposure& j, const CameraState& camera,
             const LandmarkState& landmark) {
  const double rho = landmark.inverse_depth;
  Path path;
  path.ray = landmark.ray.homogeneous();
  path.in_Bi = camera.X_BC.R * path.ray + rho * camera.X_BC.p;
  path.in_Bj = j.R_OB.transpose() * (i.R_OB * path.in_Bi + rho * (i.p_OB - j.p_OB));
  path.in_Cj = camera.X_BC.R.transpose() * (path.in_Bj - rho * camera.X_BC.p);
  return path;
}

}  // namespace

ImuResidual imu_residual(const Preintegration& imu, const FrameState& from, const FrameState& to) {
  const double dt = imu.dt_s();
  const Corrected c = corrected(imu, from);
  const Mat3 to_body = from.R_OB.transpose();
  ImuResidual r;
  r.segment<3>(kImuTurn) = so3::Log(c.dR.transpose() * to_body * to.R_OB);
  r.segment<3>(kImuSpeed) = to_body * (to.v_OB - from.v_OB - dt * gravity()) - c.dv;
  r.segment<3>(kImuWay) =
      to_body * (to.p_OB - from.p_OB - dt * from.v_OB - 0.5 * dt * dt * gravity()) - c.dp;
  r.segment<3>(kImuGyroWalk) = to.b_g - from.b_g;
  r.segment<3>(kImuAccelWalk) = to.b_a - from.b_a;
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

  out.from.block<3, 3>(kImuTurn, kRotation) = -inverse * to.R_OB.transpose() * from.R_OB;
  out.from.block<3, 3>(kImuTurn, kGyroBias) =
      -inverse * so3::Exp(-r) * so3::right_jacobian(c.turn) * J.block<3, 3>(kImuTurn, 0);
  out.to.block<3, 3>(kImuTurn, kRotation) = inverse;

  out.from.block<3, 3>(kImuSpeed, kRotation) =
      so3::hat(to_body * (to.v_OB - from.v_OB - dt * gravity()));
  out.from.block<3, 3>(kImuSpeed, kVelocity) = -to_body;
  out.from.block<3, 6>(kImuSpeed, kGyroBias) = -J.block<3, 6>(kImuSpeed, 0);
  out.to.block<3, 3>(kImuSpeed, kVelocity) = to_body;

  out.from.block<3, 3>(kImuWay, kRotation) =
      so3::hat(to_body * (to.p_OB - from.p_OB - dt * from.v_OB - 0.5 * dt * dt * gravity()));
  out.from.block<3, 3>(kImuWay, kPosition) = -to_body;
  out.from.block<3, 3>(kImuWay, kVelocity) = -dt * to_body;
  out.from.block<3, 6>(kImuWay, kGyroBias) = -J.block<3, 6>(kImuWay, 0);
  out.to.block<3, 3>(kImuWay, kPosition) = to_body;

  for (const auto& [row, column] :
       {std::pair{kImuGyroWalk, +kGyroBias}, {kImuAccelWalk, +kAccelBias}}) {
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
  W.diagonal()
      .segment<3>(kImuGyroWalk)
      .setConstant(1 / std::max(imu.noise().gyro_walk_density * root_s, 1e-9));
  W.diagonal()
      .segment<3>(kImuAccelWalk)
      .setConstant(1 / std::max(imu.noise().accel_walk_density * root_s, 1e-9));
  return W;
}

Exposure::Exposure(const FrameState& x, const FrameTiming& timing, double t_d)
    : R_OB(x.R_OB), p_OB(x.p_OB), v_OB(x.v_OB), rate(timing.rate), turn(Mat3::Identity()) {
  const double late_s = t_d - timing.placed_by;
  if (late_s == 0) return;
  turn = so3::Exp(-late_s * rate);
  R_OB = x.R_OB * turn.transpose();
  p_OB += late_s * v_OB;
}

std::optional<Vec2> sight_residual(const Sight& sight, const Exposure& anchor, const Exposure& seen,
                                   const CameraState& camera, const LandmarkState& landmark) {
  const Vec2& left = sight.seen.left;
  const Vec2 shift = sight.right ? Vec2(left - *sight.seen.right) : Vec2(Vec2::Zero());
  if (sight.own) {
    if (!sight.right) return Vec2(landmark.ray - left);
    return Vec2(landmark.inverse_depth * sight.baseline_m * Vec2::UnitX() - shift);
  }
  const Path path = path_of(anchor, seen, camera, landmark);
  const Vec3& p = path.in_Cj;
  if (p.z() < kLeastForward * p.norm()) return std::nullopt;
  if (!sight.right) return Vec2(p.head<2>() / p.z() - left);
  return Vec2(landmark.inverse_depth * sight.baseline_m / p.z() * Vec2::UnitX() - shift);
}

SightJacobians sight_jacobians(const Sight& sight, const Exposure& anchor, const Exposure& seen,
                               const CameraState& camera, const LandmarkState& landmark) {
  SightJacobians J;
  if (sight.own) {
    J.landmark.setZero();
    if (sight.right) {
      J.landmark(0, 2) = sight.baseline_m;
    } else {
      J.landmark.leftCols<2>().setIdentity();
    }
    return J;
  }
  const double rho = landmark.inverse_depth;
  const Path path = path_of(anchor, seen, camera, landmark);
  const Vec3& p = path.in_Cj;
  Eigen::Matrix<double, 2, 3> D;  // of the projection, or of the disparity
  if (sight.right) {
    D << 0, 0, -rho * sight.baseline_m / (p.z() * p.z()), 0, 0, 0;
  } else {
    D << 1 / p.z(), 0, -p.x() / (p.z() * p.z()), 0, 1 / p.z(), -p.y() / (p.z() * p.z());
  }

  const Mat3& R_BC = camera.X_BC.R;
  const Eigen::Matrix<double, 2, 3> by_Bj = D * R_BC.transpose();
  const Eigen::Matrix<double, 2, 3> by_O = by_Bj * seen.R_OB.transpose();
  const Eigen::Matrix<double, 2, 3> by_Bi = by_O * anchor.R_OB;
  const Eigen::Matrix<double, 2, 3> by_ray = by_Bi * R_BC;
  const Eigen::Matrix<double, 2, 3> by_anchor = -by_Bi * so3::hat(path.in_Bi);
  const Eigen::Matrix<double, 2, 3> by_seen = by_Bj * so3::hat(path.in_Bj);
  J.anchor << by_anchor * anchor.turn, rho * by_O;
  J.seen << by_seen * seen.turn, -rho * by_O;
  J.camera << D * so3::hat(path.in_Cj) - by_ray * so3::hat(path.ray), rho * (by_Bi - by_Bj),
      by_anchor * anchor.rate + by_seen * seen.rate + rho * by_O * (anchor.v_OB - seen.v_OB);
  J.landmark << by_ray.leftCols<2>(),
      by_Bi * camera.X_BC.p + by_O * (anchor.p_OB - seen.p_OB) - by_Bj * camera.X_BC.p;
  if (sight.right) J.landmark(0, 2) += sight.baseline_m / p.z();
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
