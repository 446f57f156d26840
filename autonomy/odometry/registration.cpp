#include "odometry/registration.h"

#include <tsl/robin_map.h>
#include <tsl/robin_set.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "math/mix.h"
#include "math/so3.h"

namespace arex {
namespace {

constexpr double kLeastInformation = 1e-9;  // keeps the algebra regular
constexpr double kLeastFeigned = 1e-3;      // likewise: 30 m, 30 rad
constexpr double kFeignedMargin = 1.2;      // what the normals' errors add scatters by a fifth

using PoseVector = Eigen::Matrix<double, 6, 1>;

struct Linearisation {
  PoseCovariance A = PoseCovariance::Zero();  ///< H^T V^-1 H by the pose
  PoseVector b = PoseVector::Zero();          ///< H^T V^-1 r
  /// What the errors of the normals alone are expected to add to A and to b.
  PoseCovariance feigned = PoseCovariance::Zero();
  PoseVector pull = PoseVector::Zero();
  int matched = 0;
  double sum_squared_sigma = 0;
  std::vector<int> born;  ///< of the matched surfels
};

/// A point that has a surfel and passed the gate.
struct Correspondence {
  Vec3 p_L;
  SurfelMatch surfel;
  PlaneResidual residual;
  std::size_t met = 0;  ///< which of the surfels that the scan meets
};
struct Correspondences {
  std::vector<Correspondence> all;  ///< in the order of the points
  std::vector<int> sharers;         ///< of each surfel that the scan meets
};

Correspondences correspondences(const std::vector<ScanPoint>& points, const SurfelMap& map,
                                const LidarInertialConfig& config, const NavigationState& x,
                                const PoseInformation::Matrix& P_pose) {
  const double gate2 = config.registration.gate_sigma * config.registration.gate_sigma;
  const Pose X_OL = x.X_OB() * x.X_BL;
  std::vector<Vec3> points_O;
  points_O.reserve(points.size());
  for (const ScanPoint& point : points) points_O.push_back(X_OL * point.p_L.cast<double>());
  Correspondences found;
  found.all.reserve(points.size());
  found.sharers.reserve(points.size());
  tsl::robin_map<std::uint64_t, std::size_t, CellKeyHash> met;
  met.reserve(points.size());
  map.find_each(points_O, [&](std::size_t i, const std::optional<SurfelMatch>& surfel) {
    if (!surfel) return;
    const PlaneResidual residual = plane_residual(x, points[i], *surfel, config.lidar);
    const double pose_variance = residual.h.dot(P_pose * residual.h);
    if (residual.r * residual.r > gate2 * (residual.variance_m2 + pose_variance)) return;
    const std::uint64_t key = static_cast<std::uint64_t>(surfel->level) << 32 | surfel->cell;
    const auto [at, first] = met.try_emplace(key, found.sharers.size());
    if (first) found.sharers.push_back(0);
    ++found.sharers[at->second];
    found.all.push_back({points[i].p_L.cast<double>(), *surfel, residual, at->second});
  });
  return found;
}

/// Sums the residuals of all points at the iterate `x`, in the order of the points.
///
/// What is wrong with a surfel is the same for the n points that share it, however many they are:
/// the mean of their residuals has the variance v / n + s, v of each alone and s in common, and
/// each counts for an n-th of its inverse, 1 / (v + n s). Else trunks nearby, which hundreds of
/// points meet and which are no planes, outvote what stands farther away, and turn the vehicle a
/// little at every passing.
Linearisation linearise(const std::vector<ScanPoint>& points, const SurfelMap& map,
                        const LidarInertialConfig& config, const NavigationState& x,
                        const PoseInformation::Matrix& P_pose) {
  const RegistrationConfig& rc = config.registration;
  const double robust2 = rc.robust_sigma * rc.robust_sigma;
  const double surface_variance = rc.surface_std_m * rc.surface_std_m;
  const Pose X_OL = x.X_OB() * x.X_BL;
  const Mat3 R_BO = x.R_OB.transpose();
  const Correspondences found = correspondences(points, map, config, x, P_pose);
  Linearisation sum;
  sum.matched = static_cast<int>(found.all.size());
  sum.born.reserve(found.all.size());
  for (const auto& [p_L, surfel, residual, met] : found.all) {
    sum.born.push_back(surfel.born);
    const double sigma2 = residual.r * residual.r / residual.variance_m2;
    sum.sum_squared_sigma += sigma2;
    const double in_common = (found.sharers[met] - 1) * (surfel.variance_m2 + surface_variance);
    const double weight =
        1 / ((1 + sigma2 / robust2) * rc.variance_inflation * (residual.variance_m2 + in_common));
    const PoseVector h = residual.h.head<6>();
    const PoseVector weighted = weight * h;
    sum.A.noalias() += weighted * h.transpose();
    sum.b += residual.r * weighted;
    // h = G n and r = n . (p_O - mean) share the normal, and with it its error.
    Eigen::Matrix<double, 6, 3> G;
    G.topRows<3>() = so3::hat(x.X_BL * p_L) * R_BO;
    G.bottomRows<3>().setIdentity();
    const Eigen::Matrix<double, 6, 3> GS = G * (weight * surfel.normal_covariance);
    sum.feigned.noalias() += GS * G.transpose();
    sum.pull.noalias() += GS * (X_OL * p_L - surfel.mean);
  }
  return sum;
}

/// Takes off what the errors of the normals feign. A surface holds the pose along its normal n; of
/// a normal that errs by e, the sum w h h^T also gets w G e e^T G^T, which does not average out:
/// over thousands of points it grows into a hold in directions that no surface faces, and r into a
/// pull towards where the points of the map lay in their cells. With A = M + N, N of the errors
/// alone, what is left to solve is M x = -(b - pull). Its solution has the covariance M^-1 A M^-1:
/// the information is M A^-1 M = T A T^T and its right side T (b - pull), with T = M A^-1 = I - N
/// A^-1, taken for nil in the directions where A is not more than N.
///
/// Source: Fuller, Measurement Error Models, 1987, 2.2: least squares corrected for the attenuation
/// that errors in the regressors cause.
void take_off_feigned(Linearisation& sum) {
  const PoseCovariance N =
      kFeignedMargin * sum.feigned + kLeastFeigned * PoseCovariance::Identity();
  const PoseCovariance L = N.llt().matrixL();
  const PoseCovariance L_inverse = L.inverse();
  // A in units of N: the eigenvalue 1 is nothing but error.
  const PoseCovariance ratio = L_inverse * sum.A * L_inverse.transpose();
  const Eigen::SelfAdjointEigenSolver<PoseCovariance> solver(0.5 * (ratio + ratio.transpose()));
  const PoseVector lambda = solver.eigenvalues().cwiseMax(1);
  const PoseVector kept = (1 - lambda.cwiseInverse().array()).matrix();
  const PoseCovariance LV = L * solver.eigenvectors();
  const PoseVector along = solver.eigenvectors().transpose() * L_inverse * (sum.b - sum.pull);
  const PoseCovariance root = LV * kept.cwiseProduct(lambda.cwiseSqrt()).asDiagonal();
  sum.A = root * root.transpose();
  sum.b = LV * kept.cwiseProduct(along);
}

/// What is known of the pose, as information on it and the extrinsics. All that a scan says is how
/// the LiDAR stands to the map, so a residual's derivative by the extrinsics follows from that by
/// the pose: p_L x n_L = R_BL^T (p_B x n_B - p_BL x n_B) and n_B = R_OB^T n.
PoseInformation with_extrinsics(const Linearisation& sum, const NavigationState& x) {
  const Mat3 R_BO = x.R_OB.transpose(), R_LB = x.X_BL.R.transpose();
  Eigen::Matrix<double, PoseInformation::kDim, 6> K;
  K.topRows<6>().setIdentity();
  K.block<3, 3>(6, 0) = R_LB;
  K.block<3, 3>(6, 3) = -R_LB * so3::hat(x.X_BL.p) * R_BO;
  K.block<3, 3>(9, 0).setZero();
  K.block<3, 3>(9, 3) = R_BO;
  PoseInformation information;
  information.A = K * sum.A * K.transpose();
  information.b = K * sum.b;
  return information;
}

/// Adds the variance of an angle between IMU and LiDAR to that of the residuals' rotation, A^-1:
/// (A^-1 + J)^-1 = (I + A J)^-1 A, for which A need not be regular.
PoseInformation with_shaking(const PoseInformation& information, double std_rad) {
  PoseInformation::Matrix I_AJ = PoseInformation::Matrix::Identity();
  I_AJ.leftCols<3>() += std_rad * std_rad * information.A.leftCols<3>();
  const PoseInformation::Matrix inverse = I_AJ.partialPivLu().inverse();
  PoseInformation shaken;
  shaken.A = inverse * information.A;
  shaken.A = (0.5 * (shaken.A + shaken.A.transpose())).eval();
  shaken.b = inverse * information.b;
  return shaken;
}

/// The pose that a scan and the prior make most likely, where the prior's attitude is that of an
/// IMU which is shaken against the LiDAR: its variance counts for the prior, not for the scan.
/// The extrinsics are taken as they stand.
/// @param x where the scan was linearised
Pose without_shaking(const Linearisation& sum, const NavigationState& x,
                     const NavigationState& prior, PoseCovariance P, double shaken_rad) {
  P.diagonal().head<3>().array() += shaken_rad * shaken_rad;
  const PoseVector from_x = local(x, prior).head<6>();
  const PoseCovariance I_AP = PoseCovariance::Identity() + sum.A * P;
  ErrorVector d = ErrorVector::Zero();
  d.head<6>() = from_x - P * I_AP.partialPivLu().solve(PoseVector(sum.b + sum.A * from_x));
  return retract(x, d).X_OB();
}

/// What is left of a block's information once the other block is unknown too, as deviations. Of
/// that one a radian or a metre is known, or in what a scan leaves open the least coupling would
/// hide all.
void block_deviations(const Mat3& own, const Mat3& cross, const Mat3& other, Vec3& deviations,
                      Vec3& worst_axis) {
  const Mat3 regular = other + Mat3::Identity();
  const Mat3 schur = own - cross * regular.inverse() * cross.transpose();
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(0.5 * (schur + schur.transpose()));
  deviations = solver.eigenvalues().cwiseMax(kLeastInformation).cwiseInverse().cwiseSqrt();
  worst_axis = solver.eigenvectors().col(0);
}

}  // namespace

std::vector<ScanPoint> voxel_downsample(const std::vector<ScanPoint>& points, double voxel_m,
                                        int max_points) {
  constexpr std::size_t kMost = 1U << 15;
  tsl::robin_set<std::uint64_t, CellKeyHash> seen;
  seen.reserve(std::min(points.size(), kMost));
  std::vector<ScanPoint> kept;
  const float inverse = static_cast<float>(1 / voxel_m);
  for (const ScanPoint& point : points) {
    if (kept.size() >= kMost) break;
    const auto at = [&](int axis) {
      return static_cast<std::int64_t>(std::floor(point.p_L[axis] * inverse));
    };
    if (seen.insert(cell_key(at(0), at(1), at(2))).second) kept.push_back(point);
  }
  const auto limit = static_cast<std::size_t>(max_points);
  if (kept.size() <= limit) return kept;
  std::vector<ScanPoint> downsampled;
  downsampled.reserve(limit);
  for (std::size_t i = 0; i < limit; ++i) downsampled.push_back(kept[i * kept.size() / limit]);
  return downsampled;
}

PlaneResidual plane_residual(const NavigationState& x, const ScanPoint& point,
                             const SurfelMatch& match, const LidarNoiseConfig& noise) {
  const Vec3 p_L = point.p_L.cast<double>();
  const Vec3 p_B = x.X_BL * p_L;
  const Vec3 n_B = x.R_OB.transpose() * match.normal;
  const Vec3 n_L = x.X_BL.R.transpose() * n_B;
  PlaneResidual out;
  out.r = match.normal.dot(x.R_OB * p_B + x.p_OB - match.mean);
  out.h.segment<3>(0) = p_B.cross(n_B);  // -n^T R hat(p_B)
  out.h.segment<3>(3) = match.normal;
  out.h.segment<3>(6) = p_L.cross(n_L);
  out.h.segment<3>(9) = n_B;
  const double range = point.range_m;
  const double along = n_L.dot(p_L) / p_L.norm();
  const double along2 = along * along;
  out.variance_m2 = match.variance_m2 + along2 * noise.range_variance(range) +
                    (1 - along2) * noise.lateral_variance(range);
  return out;
}

RegistrationReport register_scan(const std::vector<ScanPoint>& points, const SurfelMap& map,
                                 const LidarInertialConfig& config, double shaken_rad,
                                 ErrorStateFilter& filter) {
  RegistrationReport report;
  report.points = static_cast<int>(points.size());
  const PoseInformation::Matrix P_pose = filter.pose_covariance();
  NavigationState x = filter.state(), linearised = x;
  Linearisation at_x;
  PoseInformation seen;
  for (int i = 0; i < config.registration.max_iterations; ++i) {
    at_x = linearise(points, map, config, x, P_pose);
    ++report.iterations;
    if (at_x.matched < config.health.min_matches) break;
    take_off_feigned(at_x);
    seen = with_shaking(with_extrinsics(at_x, x), shaken_rad);
    const NavigationState next = filter.iterate(x, seen);
    linearised = x;
    const ErrorVector step = local(x, next);
    x = next;
    if (step.segment<3>(kRotation).norm() < config.registration.converged_rad &&
        step.segment<3>(kPosition).norm() < config.registration.converged_m) {
      break;
    }
  }
  report.matched = at_x.matched;
  if (at_x.matched > 0) {
    report.residual_rms_sigma = std::sqrt(at_x.sum_squared_sigma / at_x.matched);
    const PoseCovariance& A = at_x.A;
    const Mat3 rr = A.block<3, 3>(0, 0), rp = A.block<3, 3>(0, 3), pp = A.block<3, 3>(3, 3);
    block_deviations(pp, rp.transpose(), rr, report.position_std_m, report.worst_position_axis_O);
    block_deviations(rr, rp, pp, report.rotation_std_rad, report.worst_rotation_axis_B);
    report.born = std::move(at_x.born);
  }
  report.accepted =
      at_x.matched >= config.health.min_matches &&
      at_x.matched >= config.health.min_match_fraction * static_cast<double>(points.size());
  if (report.accepted) {
    const PoseVector d = local(filter.state(), x).head<6>();
    const PoseCovariance P = P_pose.topLeftCorner<6, 6>();
    report.innovation = std::sqrt(d.dot(P.ldlt().solve(d)) / 6);
    report.X_OB = without_shaking(at_x, linearised, filter.state(), P, shaken_rad);
    filter.finish(x, seen);
    // The gain M gives this scan's noise the covariance M A' M, M being the posterior covariance.
    const PoseCovariance posterior = filter.pose_covariance().topLeftCorner<6, 6>();
    report.covariance = posterior * at_x.A * posterior;
    report.carried = posterior - report.covariance;
  }
  return report;
}

}  // namespace arex
