#pragma once

#include <array>
#include <optional>
#include <span>
#include <string_view>

#include "exploration/candidate.h"

namespace arex {

enum class DistanceKind { kEuclidean, kPath };
inline constexpr std::array<std::string_view, 2> kDistanceNames{"euclidean", "path"};
constexpr const std::array<std::string_view, 2>& enum_names(DistanceKind) { return kDistanceNames; }

struct RevenueConfig {
  bool direction_aware = true;
  double weight_information = 3.0;  ///< lambda_I: rrt_exploration's gain multiplier
  double weight_distance = 1.0;     ///< lambda_N
  double weight_direction = 1.0;    ///< lambda_D; the paper prints no value
  DistanceKind distance = DistanceKind::kPath;
  double hysteresis_radius_m = 3.0;  ///< rrt_exploration
  double hysteresis_gain = 1.0;      ///< 1: as the paper prints R; rrt_exploration takes 2

  void fields(auto& f) {
    f("direction_aware", direction_aware, "R_d with the direction term (paper), or the plain R");
    f("weight_information", weight_information, "lambda_I, per m^2 of unknown area");
    f("weight_distance", weight_distance, "lambda_N, per m");
    f("weight_direction", weight_direction, "lambda_D, per rad, inside the exponential");
    f("distance", distance, "f_N: straight, or along the known-free path");
    f("hysteresis_radius_m", hysteresis_radius_m,
      "candidates nearer than this have f_I times hysteresis_gain (rrt_exploration)");
    f("hysteresis_gain", hysteresis_gain, "1: as the paper prints R; rrt_exploration takes 2");
    f.check(weight_information >= 0, "weight_information >= 0");
    f.check(weight_distance >= 0, "weight_distance >= 0");
    f.check(weight_direction >= 0, "weight_direction >= 0");
    f.check(hysteresis_radius_m >= 0, "hysteresis_radius_m >= 0");
    f.check(hysteresis_gain >= 1, "hysteresis_gain >= 1");
  }
};

/// The last two targets, newest first.
struct TargetHistory {
  std::optional<Vec2> last;         ///< T_{t-1}
  std::optional<Vec2> before_last;  ///< T_{t-2}

  void push(const Vec2& target) {
    before_last = last;
    last = target;
  }
};

/// A: the angle (rad, in [0, pi]) between T_{t-2}T_{t-1} and T_{t-1}CG; none while there are fewer
/// than two targets or where one of the vectors has no length.
[[nodiscard]] std::optional<double> direction_angle(const TargetHistory& history,
                                                    const Vec2& point);

/// Fills f_D and R_d (or R) of a candidate whose f_I, f_N and A are known:
/// R = lambda_I f_I - lambda_N f_N and R_d = R - exp(lambda_D A), with f_D = 1 where there is no A
/// (paper, eqs. (24)-(25)).
void evaluate_revenue(Candidate& candidate, const RevenueConfig& config);

/// Index of the kept candidate with the largest revenue, the first of equals; none without any.
[[nodiscard]] std::optional<std::size_t> best_candidate(std::span<const Candidate> candidates);

/// The same by R alone, where the candidates have their R_d.
[[nodiscard]] std::optional<std::size_t> best_undirected(std::span<const Candidate> candidates);

}  // namespace arex
