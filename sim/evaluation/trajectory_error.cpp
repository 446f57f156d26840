#include "evaluation/trajectory_error.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <string>

#include "config/config.h"

namespace arex::sim {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr double kDeltaTolerance = 0.1;  // of a sub-path's length, as in evo
constexpr std::size_t kFewestPoses = 3;  // that determine a rotation

// Of the longest extent: what the rounding of positions of a million metres (UTM) still exceeds.
constexpr double kNoWidth = 1e-6;
constexpr double kNoExtent = 1e-9;  // m, and of the distance from the origin

/// The first index in [begin, end) whose value comes nearest to the wanted one. @pre the values
/// never fall; begin < end
template <class Value>
std::size_t nearest(std::size_t begin, std::size_t end, double wanted, const Value& value) {
  const auto first_where = [](std::size_t low, std::size_t high, const auto& holds) {
    while (low < high) {
      const std::size_t middle = low + (high - low) / 2;
      if (holds(middle)) {
        high = middle;
      } else {
        low = middle + 1;
      }
    }
    return low;
  };
  const auto distance = [&](std::size_t i) { return std::abs(value(i) - wanted); };
  const std::size_t above = first_where(begin, end, [&](auto i) { return value(i) >= wanted; });
  if (above == begin) return above;
  const double below = distance(above - 1);
  if (above < end && distance(above) < below) return above;
  return first_where(begin, above, [&](auto i) { return distance(i) <= below; });
}

/// Two sets of points about their means.
struct Centred {
  Vec3 mean_W = Vec3::Zero();
  Vec3 mean_O = Vec3::Zero();
  Eigen::Matrix3Xd W, O;

  explicit Centred(const std::vector<PosePair>& pairs)
      : W(3, static_cast<Eigen::Index>(pairs.size())), O(W.rows(), W.cols()) {
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      W.col(static_cast<Eigen::Index>(i)) = pairs[i].X_WB.p;
      O.col(static_cast<Eigen::Index>(i)) = pairs[i].X_OB.p;
    }
    mean_W = W.rowwise().mean();
    mean_O = O.rowwise().mean();
    W.colwise() -= mean_W;
    O.colwise() -= mean_O;
  }
  [[nodiscard]] bool stands_still() const {
    const auto still = [](const Eigen::Matrix3Xd& points, const Vec3& mean) {
      const double extent = points.norm() / std::sqrt(static_cast<double>(points.cols()));
      return extent <= kNoExtent * (1 + mean.norm());
    };
    return still(W, mean_W) || still(O, mean_O);
  }
  [[nodiscard]] bool lie_on_a_line() const {
    const Eigen::JacobiSVD<Mat3> svd(W * O.transpose());
    return svd.singularValues()[1] <= kNoWidth * kNoWidth * svd.singularValues()[0];
  }
  /// Scale of O that fits best once it is turned.
  [[nodiscard]] double scale(const Mat3& R) const {
    return W.cwiseProduct(R * O).sum() / O.squaredNorm();
  }
  [[nodiscard]] Similarity with(const Mat3& R, double scale) const {
    return {{R, mean_W - scale * (R * mean_O)}, scale};
  }
};

std::optional<Similarity> align_yaw(const Centred& points) {
  const double sine = points.W.row(1).dot(points.O.row(0)) - points.W.row(0).dot(points.O.row(1));
  const double cosine = points.W.topRows<2>().cwiseProduct(points.O.topRows<2>()).sum();
  const double most = points.W.norm() * points.O.norm();
  if (std::hypot(sine, cosine) <= kNoWidth * kNoWidth * most) return std::nullopt;
  return points.with(so3::from_yaw(std::atan2(sine, cosine)), 1);
}

std::vector<Vec3> positions_of(const std::vector<PosePair>& pairs, Pose PosePair::*which) {
  std::vector<Vec3> positions;
  positions.reserve(pairs.size());
  for (const PosePair& pair : pairs) positions.push_back((pair.*which).p);
  return positions;
}

RelativeError relative_error_over(const std::vector<PosePair>& pairs,
                                  const std::vector<Vec3>& positions, double delta_m,
                                  SubPaths which) {
  std::vector<double> translation_m;
  std::vector<double> rotation_deg;
  for (const auto& [i, j] : sub_paths(positions, delta_m, which)) {
    const Pose true_step = pairs[i].X_WB.inverse() * pairs[j].X_WB;
    const Pose estimated_step = pairs[i].X_OB.inverse() * pairs[j].X_OB;
    const Pose error = true_step.inverse() * estimated_step;
    translation_m.push_back(error.p.norm());
    rotation_deg.push_back(kDegrees * so3::angle(error.R));
  }
  return {delta_m, which, translation_m.size(), statistics_of(translation_m),
          statistics_of(rotation_deg)};
}

std::string span_text(const Trajectory& trajectory) {
  return fmt::format("{:.13g} to {:.13g} s", trajectory.poses.front().time_s,
                     trajectory.poses.back().time_s);
}

std::vector<PosePair> matched(const Trajectory& reference, const Trajectory& estimate,
                              const EvaluationOptions& options) {
  if (reference.has_time() != estimate.has_time()) {
    throw ConfigError(fmt::format(
        "{}: is of format {}, {} of {}; KITTI's has no stamps, expected both or none of it",
        estimate.file, format_name(estimate.format), reference.file,
        format_name(reference.format)));
  }
  if (!reference.has_time() && reference.poses.size() != estimate.poses.size()) {
    throw ConfigError(fmt::format("{}: holds {} poses, expected the {} of {}: they have no stamps",
                                  estimate.file, estimate.poses.size(), reference.poses.size(),
                                  reference.file));
  }
  auto pairs = associate(reference, estimate, options.max_time_difference_s, options.time_offset_s);
  if (pairs.size() < kFewestPoses) {
    std::string message =
        fmt::format("{}: {} of {} poses have a partner in {}, expected {} at least", estimate.file,
                    pairs.size(), estimate.poses.size(), reference.file, kFewestPoses);
    if (reference.has_time()) {
      message += fmt::format("; stamps run from {}, there from {}", span_text(estimate),
                             span_text(reference));
    }
    throw ConfigError(message);
  }
  return pairs;
}

void measure_poses(Evaluation& evaluation, bool with_yaw) {
  for (const PosePair& pair : evaluation.pairs) {
    evaluation.position_error_m.push_back((pair.X_OB.p - pair.X_WB.p).norm());
    evaluation.rotation_error_deg.push_back(kDegrees *
                                            so3::angle(pair.X_WB.R.transpose() * pair.X_OB.R));
    if (!with_yaw) continue;
    evaluation.yaw_error_deg.push_back(
        kDegrees * std::abs(so3::wrap(so3::yaw(pair.X_OB.R) - so3::yaw(pair.X_WB.R))));
  }
  evaluation.position_m = statistics_of(evaluation.position_error_m);
  evaluation.rotation_deg = statistics_of(evaluation.rotation_error_deg);
  evaluation.yaw_deg = statistics_of(evaluation.yaw_error_deg);
}

}  // namespace

Statistics statistics_of(const std::vector<double>& errors) {
  Statistics s;
  if (errors.empty()) return s;
  const auto count = static_cast<double>(errors.size());
  s.mean = std::accumulate(errors.begin(), errors.end(), 0.0) / count;
  s.sse = 0;
  double spread = 0;
  for (const double error : errors) {
    s.sse += error * error;
    spread += (error - s.mean) * (error - s.mean);
  }
  s.rmse = std::sqrt(s.sse / count);
  s.std = std::sqrt(spread / count);
  std::vector<double> sorted = errors;
  std::sort(sorted.begin(), sorted.end());
  s.min = sorted.front();
  s.max = sorted.back();
  s.median = (sorted[(sorted.size() - 1) / 2] + sorted[sorted.size() / 2]) / 2;
  return s;
}

std::vector<PosePair> associate(const Trajectory& reference, const Trajectory& estimate,
                                double max_difference_s, double offset_s) {
  std::vector<PosePair> pairs;
  const auto add = [&](const TimedPose& r, const TimedPose& e) {
    pairs.push_back({reference.has_time() ? from_seconds(r.time_s) : 0, r.X, e.X});
  };
  if (!reference.has_time()) {
    for (std::size_t i = 0; i < reference.poses.size(); ++i) {
      add(reference.poses[i], estimate.poses[i]);
    }
    return pairs;
  }
  // Stamps are compared in seconds and not as integers, and the longer one's are the ones moved, as
  // evo does: which of two poses is the nearer one may hang on the last bit.
  const bool estimate_longer = estimate.poses.size() > reference.poses.size();
  const auto& shorter = (estimate_longer ? reference : estimate).poses;
  const auto& longer = (estimate_longer ? estimate : reference).poses;
  const double shift = estimate_longer ? offset_s : -offset_s;
  if (longer.empty()) return pairs;
  const auto stamp = [&](std::size_t i) { return longer[i].time_s + shift; };
  for (const TimedPose& pose : shorter) {
    const std::size_t i = nearest(0, longer.size(), pose.time_s, stamp);
    if (std::abs(stamp(i) - pose.time_s) > max_difference_s) continue;
    if (estimate_longer) {
      add(pose, longer[i]);
    } else {
      add(longer[i], pose);
    }
  }
  return pairs;
}

std::optional<Similarity> align(const std::vector<PosePair>& pairs, Alignment alignment) {
  if (alignment == Alignment::kNone) return Similarity{};
  if (alignment == Alignment::kOrigin) return Similarity{align_at_start(pairs), 1};
  const Centred points(pairs);
  if (points.stands_still()) return std::nullopt;
  if (alignment == Alignment::kYaw) return align_yaw(points);
  // On a line only the rotation about it is open, which the scale does not need.
  if (alignment != Alignment::kScale && points.lie_on_a_line()) return std::nullopt;
  // The best rotation does not depend on the scale.
  const Pose X_WO = align_rigid(pairs);
  if (alignment == Alignment::kSe3) return Similarity{X_WO, 1};
  const double scale = points.scale(X_WO.R);
  if (alignment == Alignment::kScale) return Similarity{{}, scale};
  return points.with(X_WO.R, scale);
}

double width_across(const std::vector<PosePair>& pairs) {
  const Centred points(pairs);
  const Mat3 covariance = points.W * points.W.transpose() / static_cast<double>(pairs.size());
  const Vec3 variances = Eigen::SelfAdjointEigenSolver<Mat3>(covariance).eigenvalues();
  return std::sqrt(std::max(0.0, variances[1]));
}

std::vector<double> distances_along(const std::vector<Vec3>& positions) {
  std::vector<double> distances(positions.size(), 0.0);
  for (std::size_t i = 1; i < positions.size(); ++i) {
    distances[i] = distances[i - 1] + (positions[i] - positions[i - 1]).norm();
  }
  return distances;
}

std::vector<std::pair<std::size_t, std::size_t>> sub_paths(const std::vector<Vec3>& positions,
                                                           double delta_m, SubPaths which) {
  std::vector<std::pair<std::size_t, std::size_t>> found;
  if (which == SubPaths::kConsecutive) {
    double length = 0;  // summed anew for each, as in evo: where one ends may hang on the last bit
    for (std::size_t start = 0, i = 1; i < positions.size(); ++i) {
      length += (positions[i] - positions[i - 1]).norm();
      if (length < delta_m) continue;
      found.emplace_back(start, i);
      start = i;
      length = 0;
    }
    return found;
  }
  const std::vector<double> distances = distances_along(positions);
  for (std::size_t i = 0; i + 1 < positions.size(); ++i) {
    const auto length = [&](std::size_t j) { return distances[j] - distances[i]; };
    const std::size_t j = nearest(i + 1, positions.size(), delta_m, length);
    if (std::abs(length(j) - delta_m) <= kDeltaTolerance * delta_m) found.emplace_back(i, j);
  }
  return found;
}

Evaluation evaluate(const Trajectory& reference, const Trajectory& estimate,
                    const EvaluationOptions& options) {
  Evaluation evaluation;
  evaluation.pairs = matched(reference, estimate, options);
  std::vector<PosePair>& pairs = evaluation.pairs;
  std::vector<PosePair> to_align = pairs;
  if (options.poses_to_align > 0 && options.poses_to_align < pairs.size()) {
    to_align.resize(options.poses_to_align);
  }
  const std::optional<Similarity> alignment = align(to_align, options.alignment);
  if (!alignment) {
    throw ConfigError(fmt::format(
        "{}: the {} matched positions stand still or lie on a line, which determines no alignment; "
        "expected --align none or origin",
        estimate.file, to_align.size()));
  }
  evaluation.alignment = *alignment;
  for (PosePair& pair : pairs) pair.X_OB = *alignment * pair.X_OB;
  measure_poses(evaluation, reference.has_time());
  evaluation.width_m = width_across(to_align);
  evaluation.duration_s = reference.has_time()
                              ? to_seconds(pairs.back().stamp - pairs.front().stamp)
                              : Statistics::kUnknown;
  const auto reference_positions = positions_of(pairs, &PosePair::X_WB);
  const auto estimate_positions = positions_of(pairs, &PosePair::X_OB);
  evaluation.distance_m = distances_along(reference_positions);
  evaluation.reference_length_m = evaluation.distance_m.back();
  evaluation.estimate_length_m = distances_along(estimate_positions).back();
  evaluation.end_error_m =
      (align_at_start(pairs) * pairs.back().X_OB.p - pairs.back().X_WB.p).norm();
  if (evaluation.reference_length_m > 0) {
    evaluation.drift_percent = 100 * evaluation.end_error_m / evaluation.reference_length_m;
  }
  for (const double delta : options.deltas_m) {
    for (const SubPaths which : {SubPaths::kAll, SubPaths::kConsecutive}) {
      evaluation.relative.push_back(relative_error_over(
          pairs, options.pairs_from_reference ? reference_positions : estimate_positions, delta,
          which));
    }
  }
  return evaluation;
}

}  // namespace arex::sim
