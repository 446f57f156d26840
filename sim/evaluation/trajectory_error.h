#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "evaluation/trajectory_file.h"
#include "scoring/odometry_error.h"

/// How far one trajectory is from another, as `evo` defines it (Grupp, evo: Python package for the
/// evaluation of odometry and SLAM; its metrics are those of Sturm et al., A benchmark for the
/// evaluation of RGB-D SLAM systems, IROS 2012). The poses of a PosePair are those of the reference
/// (X_WB) and of the estimate (X_OB).
namespace arex::sim {

/// What moves the estimate onto the reference before they are compared.
enum class Alignment {
  kNone,    ///< nothing
  kOrigin,  ///< the first poses agree (evo --align_origin)
  kYaw,     ///< best rotation about the vertical and translation: what an IMU leaves unobservable
  kSe3,     ///< best rotation and translation (evo --align)
  kSim3,    ///< and scale (evo --align --correct_scale)
  kScale,   ///< scale only (evo --correct_scale)
};

/// Moves the points of O into W, X_WO * (scale * p), and turns orientations.
struct Similarity {
  Pose X_WO;
  double scale = 1;

  Pose operator*(const Pose& X_OB) const { return {X_WO.R * X_OB.R, X_WO * Vec3(scale * X_OB.p)}; }
};

/// Statistics of an error; not a number where there was nothing to measure.
struct Statistics {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  double rmse = kUnknown;
  double mean = kUnknown;
  double median = kUnknown;
  double std = kUnknown;  ///< of the population
  double min = kUnknown;
  double max = kUnknown;
  double sse = kUnknown;  ///< sum of squared errors
};
Statistics statistics_of(const std::vector<double>& errors);

/// Poses of the same moment. To every pose of the shorter trajectory, in order, belongs that of the
/// longer one with the nearest stamp, of two as near the first, if it is near enough. Of equally
/// long ones the estimate counts as the shorter. Without stamps poses belong together by their
/// number.
/// @param offset_s added to the stamps of the estimate
/// @pre both have stamps, or none has and they are equally long
std::vector<PosePair> associate(const Trajectory& reference, const Trajectory& estimate,
                                double max_difference_s, double offset_s = 0);

/// @return nothing if the positions do not determine it: they stand still or, where a rotation is
/// sought, lie on a line. @pre pairs are not empty
/// Source: Umeyama, Least-squares estimation of transformation parameters between two point
/// patterns, PAMI 1991; yaw: Zhang and Scaramuzza, A tutorial on quantitative trajectory
/// evaluation, IROS 2018.
std::optional<Similarity> align(const std::vector<PosePair>& pairs, Alignment alignment);

/// Standard deviation across the line that the reference follows best, m: the lever by which its
/// positions tell the rotation about that line.
double width_across(const std::vector<PosePair>& pairs);

/// Length of the path through the positions up to each of them, m.
std::vector<double> distances_along(const std::vector<Vec3>& positions);

/// Which sub-paths of a length are compared.
enum class SubPaths {
  kAll,          ///< from every pose to the one nearest the length, if within a tenth of it
  kConsecutive,  ///< end to end from the first pose on, each as soon as it is long enough
};

/// Indices of the first and the last position of each sub-path of length `delta_m`.
std::vector<std::pair<std::size_t, std::size_t>> sub_paths(const std::vector<Vec3>& positions,
                                                           double delta_m, SubPaths which);

/// The relative pose error over sub-paths of one length.
struct RelativeError {
  double delta_m = 0;
  SubPaths which = SubPaths::kAll;
  std::size_t count = 0;  ///< of sub-paths
  Statistics translation_m;
  Statistics rotation_deg;
};

struct EvaluationOptions {
  Alignment alignment = Alignment::kNone;
  std::size_t poses_to_align = 0;       ///< the first so many matched ones; 0: all
  double max_time_difference_s = 0.01;  ///< between matched poses, as in evo
  double time_offset_s = 0;             ///< added to the estimate's stamps
  std::vector<double> deltas_m{1, 10};  ///< lengths of the sub-paths of the relative error
  bool pairs_from_reference = false;    ///< sub-paths measured there, not along the estimate
};

/// One estimate against its reference.
struct Evaluation {
  std::vector<PosePair> pairs;  ///< matched, the estimate aligned
  Similarity alignment;
  double duration_s = 0;  ///< from the first matched pose to the last; not a number without stamps
  double reference_length_m = 0;  ///< of the path through the matched poses
  double estimate_length_m = 0;   ///< likewise, aligned
  double end_error_m = 0;         ///< of the last position, the first poses made to agree
  double drift_percent = Statistics::kUnknown;  ///< the same, of the reference's length
  double width_m = 0;                           ///< width_across()

  // Of each pair.
  std::vector<double> distance_m;  ///< along the reference
  std::vector<double> position_error_m;
  std::vector<double> rotation_error_deg;
  std::vector<double> yaw_error_deg;  ///< empty for KITTI, whose z axis is none of up and down

  Statistics position_m;
  Statistics rotation_deg;
  Statistics yaw_deg;
  std::vector<RelativeError> relative;  ///< for each delta all sub-paths, then consecutive ones
};

/// @throws ConfigError for what cannot be compared: one with stamps and one without, fewer than
/// three matched poses, an alignment that they do not determine.
Evaluation evaluate(const Trajectory& reference, const Trajectory& estimate,
                    const EvaluationOptions& options);

}  // namespace arex::sim
