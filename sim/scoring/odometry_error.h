#pragma once

#include <Eigen/Core>
#include <limits>
#include <vector>

#include "math/pose.h"
#include "math/types.h"
#include "scoring/figures.h"

namespace arex::sim {

/// Truth and estimate at one moment. W and O need not coincide.
struct PosePair {
  Stamp stamp = 0;
  Pose X_WB;  ///< true
  Pose X_OB;  ///< estimated
};

/// How far an odometry is from the truth over one run. Definitions as in Zhang and Scaramuzza, A
/// tutorial on quantitative trajectory evaluation, IROS 2018, and as `evo` computes them. Not a
/// number: there was nothing to measure.
struct OdometryScore {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  double ate_rmse_m = kUnknown;         ///< absolute position error, aligned at the first pose only
  double ate_max_m = kUnknown;          ///< its largest value
  double ate_se3_rmse_m = kUnknown;     ///< after the best rigid alignment of the whole run
  double yaw_error_max_deg = kUnknown;  ///< heading error, aligned at the first pose
  double start_tilt_deg = kUnknown;     ///< of O's z axis from the vertical: gravity at start-up
  double rpe_1m_m = kUnknown;           ///< relative position error over 1 m of path, RMS
  double rpe_10m_m = kUnknown;          ///< the same over 10 m
  double end_error_m = kUnknown;        ///< of the last position, aligned at the first pose
  double drift_percent = kUnknown;      ///< the same, of the length of the true path
  double nees_rotation = kUnknown;      ///< Nees, mean
  double nees_position = kUnknown;
};

/// The pose of O in W that makes the first pair agree.
Pose align_at_start(const std::vector<PosePair>& pairs);

/// The rigid transform X_WO that minimises the squared position error (Umeyama without scale).
Pose align_rigid(const std::vector<PosePair>& pairs);

/// What places a map: align_rigid(), unless the flight hardly left its place or kept to one line,
/// so that its positions tell no rotation; then align_at_start().
Pose align_map(const std::vector<PosePair>& pairs);

/// RMS of the relative position error over all sub-paths of true length `path_m`; not a number if
/// the path is shorter.
/// @param stride every stride-th pose starts a sub-path.
double relative_error(const std::vector<PosePair>& pairs, double path_m, std::size_t stride = 10);

/// @pre pairs are in order of time. An empty run has no score.
OdometryScore score_odometry(const std::vector<PosePair>& pairs);

/// Normalised estimation error squared, per dimension: e^T P^-1 e / 3 of attitude and of position,
/// aligned at the first pose. One in the mean, if the errors are as large as their covariance says
/// (Bar-Shalom, Li and Kirubarajan, Estimation with applications to tracking and navigation, 5.4).
/// From where it first moves, and only away from there: where it stands it is right by definition.
class Nees {
 public:
  /// @param covariance of [rotation in B, position in O]; one of zeros is passed over
  void add(const PosePair& first, const PosePair& now,
           const Eigen::Matrix<double, 6, 6>& covariance);
  [[nodiscard]] double rotation() const { return rotation_sum_ / count_; }
  [[nodiscard]] double position() const { return position_sum_ / count_; }

 private:
  double rotation_sum_ = 0, position_sum_ = 0;
  double count_ = 0;
};

/// Sets the figures of the section that the poses tell.
/// @param section "odometry", or "odometries.NAME"
void add_figures(const OdometryScore& score, const std::string& section, Figures& figures);

}  // namespace arex::sim
