#include "scoring/odometry_error.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace arex::sim {

Pose align_at_start(const std::vector<PosePair>& pairs) {
  if (pairs.empty()) return {};
  return pairs.front().X_WB * pairs.front().X_OB.inverse();
}

Pose align_rigid(const std::vector<PosePair>& pairs) {
  if (pairs.size() < 3) return align_at_start(pairs);
  const auto count = static_cast<Eigen::Index>(pairs.size());
  Eigen::Matrix3Xd estimated(3, count);
  Eigen::Matrix3Xd truth(3, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    estimated.col(i) = pairs[static_cast<std::size_t>(i)].X_OB.p;
    truth.col(i) = pairs[static_cast<std::size_t>(i)].X_WB.p;
  }
  const Eigen::Matrix4d T = Eigen::umeyama(estimated, truth, /*with_scaling=*/false);
  return {T.topLeftCorner<3, 3>(), T.topRightCorner<3, 1>()};
}

Pose align_map(const std::vector<PosePair>& pairs) {
  constexpr double kSpread = 2.0;  // m, 1 sigma, along the second axis: 1 cm off turns it by 5 mrad
  Vec3 mean = Vec3::Zero();
  for (const PosePair& pair : pairs) mean += pair.X_WB.p / static_cast<double>(pairs.size());
  Mat3 covariance = Mat3::Zero();
  for (const PosePair& pair : pairs) {
    const Vec3 d = pair.X_WB.p - mean;
    covariance += d * d.transpose() / static_cast<double>(pairs.size());
  }
  const Vec3 spread = Eigen::SelfAdjointEigenSolver<Mat3>(covariance).eigenvalues();
  return spread[1] < kSpread * kSpread ? align_at_start(pairs) : align_rigid(pairs);
}

double relative_error(const std::vector<PosePair>& pairs, double path_m, std::size_t stride) {
  std::vector<double> travelled(pairs.size(), 0.0);
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    travelled[i] = travelled[i - 1] + (pairs[i].X_WB.p - pairs[i - 1].X_WB.p).norm();
  }
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t i = 0, j = 0; i < pairs.size(); i += stride) {
    while (j < pairs.size() && travelled[j] < travelled[i] + path_m) ++j;
    if (j == pairs.size()) break;
    const Pose true_step = pairs[i].X_WB.inverse() * pairs[j].X_WB;
    const Pose estimated_step = pairs[i].X_OB.inverse() * pairs[j].X_OB;
    sum += (true_step.inverse() * estimated_step).p.squaredNorm();
    ++count;
  }
  return count ? std::sqrt(sum / static_cast<double>(count)) : OdometryScore::kUnknown;
}

OdometryScore score_odometry(const std::vector<PosePair>& pairs) {
  OdometryScore score;
  if (pairs.empty()) return score;
  const Pose X_WO_start = align_at_start(pairs);
  const Pose X_WO_best = align_rigid(pairs);
  double sum_start = 0;
  double sum_best = 0;
  double yaw_max = 0;
  double error2_max = 0;
  for (const PosePair& pair : pairs) {
    const Pose aligned = X_WO_start * pair.X_OB;
    const double error2 = (aligned.p - pair.X_WB.p).squaredNorm();
    sum_start += error2;
    sum_best += (X_WO_best * pair.X_OB.p - pair.X_WB.p).squaredNorm();
    error2_max = std::max(error2_max, error2);
    yaw_max = std::max(yaw_max, std::abs(so3::wrap(so3::yaw(aligned.R) - so3::yaw(pair.X_WB.R))));
  }
  const auto count = static_cast<double>(pairs.size());
  score.ate_rmse_m = std::sqrt(sum_start / count);
  score.ate_max_m = std::sqrt(error2_max);
  score.ate_se3_rmse_m = std::sqrt(sum_best / count);
  score.yaw_error_max_deg = yaw_max * 180 / std::numbers::pi;
  score.start_tilt_deg =
      std::acos(std::clamp(X_WO_start.R(2, 2), -1.0, 1.0)) * 180 / std::numbers::pi;
  score.rpe_1m_m = relative_error(pairs, 1.0);
  score.rpe_10m_m = relative_error(pairs, 10.0);
  score.end_error_m = (X_WO_start * pairs.back().X_OB.p - pairs.back().X_WB.p).norm();
  double path = 0;
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    path += (pairs[i].X_WB.p - pairs[i - 1].X_WB.p).norm();
  }
  if (path > 0) score.drift_percent = 100 * score.end_error_m / path;
  return score;
}

void Nees::add(const PosePair& first, const PosePair& now,
               const Eigen::Matrix<double, 6, 6>& covariance) {
  constexpr double kMoved = 0.1;  // m
  if (covariance.isZero(0) || (now.X_WB.p - first.X_WB.p).norm() <= kMoved) return;
  const Pose X_OB = first.X_OB * (first.X_WB.inverse() * now.X_WB);  // the truth's
  const Vec3 rotation = so3::Log(X_OB.R.transpose() * now.X_OB.R);
  const Vec3 position = now.X_OB.p - X_OB.p;
  rotation_sum_ += rotation.dot(covariance.topLeftCorner<3, 3>().ldlt().solve(rotation)) / 3;
  position_sum_ += position.dot(covariance.bottomRightCorner<3, 3>().ldlt().solve(position)) / 3;
  count_ += 1;
}

void add_figures(const OdometryScore& score, const std::string& section, Figures& figures) {
  figures.set(section + ".ate_rmse_m", score.ate_rmse_m);
  figures.set(section + ".ate_max_m", score.ate_max_m);
  figures.set(section + ".ate_se3_rmse_m", score.ate_se3_rmse_m);
  figures.set(section + ".yaw_error_max_deg", score.yaw_error_max_deg);
  figures.set(section + ".start_tilt_deg", score.start_tilt_deg);
  figures.set(section + ".rpe_1m_m", score.rpe_1m_m);
  figures.set(section + ".rpe_10m_m", score.rpe_10m_m);
  figures.set(section + ".end_error_m", score.end_error_m);
  figures.set(section + ".drift_percent", score.drift_percent);
  figures.set(section + ".nees_rotation", score.nees_rotation);
  figures.set(section + ".nees_position", score.nees_position);
}

}  // namespace arex::sim
