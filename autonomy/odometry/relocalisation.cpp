#include "odometry/relocalisation.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "math/so3.h"

namespace arex {
namespace {

constexpr std::size_t kRefined = 6;           // best guesses that are refined
constexpr int kRefinements = 6;               // updates of each
constexpr double kScoredDistance = 0.3;       // a point this near its surfel counts, m
constexpr double kRecoveryVelocityStd = 2.0;  // m/s
constexpr double kSamePlace = 0.5;            // m
constexpr double kSameAttitude = 0.3;         // rad

struct Guess {
  Pose X_OB;
  int score = 0;
};

int score_of(const Pose& X_OL, const std::vector<Vec3>& sample_L, const SurfelMap& map) {
  std::vector<Vec3> sample_O;
  sample_O.reserve(sample_L.size());
  for (const Vec3& p_L : sample_L) sample_O.push_back(X_OL * p_L);
  int score = 0;
  map.find_each(sample_O, [&](std::size_t i, const std::optional<SurfelMatch>& match) {
    if (!match) return;
    if (std::abs(match->normal.dot(sample_O[i] - match->mean)) < kScoredDistance) ++score;
  });
  return score;
}

std::vector<Vec3> sample(const std::vector<ScanPoint>& points, int count) {
  std::vector<Vec3> out;
  const auto n = std::min(points.size(), static_cast<std::size_t>(count));
  for (std::size_t i = 0; i < n; ++i) {
    out.push_back(points[i * points.size() / n].p_L.cast<double>());
  }
  return out;
}

/// All guesses, best first; equal scores keep the order of the search.
std::vector<Guess> search(const std::vector<ScanPoint>& points, const SurfelMap& map,
                          const OdometryHealthConfig& hc, const NavigationState& state,
                          const Vec3& centre) {
  const std::vector<Vec3> sample_L = sample(points, hc.recovery_points);
  const int reach = static_cast<int>(std::floor(hc.recovery_radius_m / hc.recovery_step_m));
  std::vector<Guess> guesses;
  for (int k = 0; k < hc.recovery_yaw_steps; ++k) {
    const Mat3 turn = so3::from_yaw(2 * std::numbers::pi * k / hc.recovery_yaw_steps);
    for (int i = -reach; i <= reach; ++i) {
      for (int j = -reach; j <= reach; ++j) {
        Guess guess;
        guess.X_OB = {turn * state.R_OB, centre + hc.recovery_step_m * Vec3(i, j, 0)};
        guess.score = score_of(guess.X_OB * state.X_BL, sample_L, map);
        guesses.push_back(guess);
      }
    }
  }
  std::stable_sort(guesses.begin(), guesses.end(),
                   [](const Guess& a, const Guess& b) { return a.score > b.score; });
  return guesses;
}

/// Refines a pose by repeated updates from a covariance that shrinks. Nothing if it does not fit.
std::optional<Relocalisation> refine(const Pose& X_OB, const std::vector<ScanPoint>& points,
                                     const SurfelMap& map, const LidarInertialConfig& config,
                                     const NavigationState& state, const ErrorMatrix& covariance) {
  const OdometryHealthConfig& hc = config.health;
  NavigationState x = state;
  x.R_OB = X_OB.R;
  x.p_OB = X_OB.p;
  x.v_OB = Vec3::Zero();
  ErrorStateFilter filter(config.imu);
  filter.reset(x, covariance);
  RegistrationReport report;
  for (int i = 0; i < kRefinements; ++i) {
    const double scale = 1.0 / (1 << i);
    filter.inflate_pose_covariance(0.5 * std::numbers::pi * scale / hc.recovery_yaw_steps,
                                   hc.recovery_step_m * scale, kRecoveryVelocityStd);
    report = register_scan(points, map, config, 0, filter);
    if (!report.accepted) return std::nullopt;
  }
  if (report.matched < hc.recovery_fraction * report.points) return std::nullopt;
  return Relocalisation{filter, report};
}

bool same_place(const NavigationState& a, const NavigationState& b) {
  return (a.p_OB - b.p_OB).norm() < kSamePlace &&
         so3::angle(a.R_OB.transpose() * b.R_OB) < kSameAttitude;
}

}  // namespace

std::optional<Relocalisation> relocalise(const std::vector<ScanPoint>& points, const SurfelMap& map,
                                         const LidarInertialConfig& config,
                                         const NavigationState& state, const Vec3& last_position_O,
                                         const ErrorMatrix& covariance) {
  const OdometryHealthConfig& hc = config.health;
  if (static_cast<int>(points.size()) < hc.min_matches) return std::nullopt;

  // Where the IMU says it is comes first: a symmetric place has other poses that fit as well.
  const bool prediction_near = (state.p_OB - last_position_O).norm() < hc.recovery_radius_m;
  if (prediction_near) {
    auto near = refine(state.X_OB(), points, map, config, state, covariance);
    if (near) return near;
  }

  std::vector<Guess> guesses =
      search(points, map, hc, state, prediction_near ? state.p_OB : last_position_O);
  guesses.resize(std::min(guesses.size(), kRefined));
  std::optional<Relocalisation> best;
  int rival = 0;  // matches of the best that stands elsewhere
  for (const Guess& guess : guesses) {
    auto found = refine(guess.X_OB, points, map, config, state, covariance);
    if (!found) continue;
    if (!best || found->report.matched > best->report.matched) std::swap(found, best);
    if (found && !same_place(found->filter.state(), best->filter.state())) {
      rival = std::max(rival, found->report.matched);
    }
  }
  if (best && best->report.matched < hc.recovery_margin * rival) return std::nullopt;
  return best;
}

}  // namespace arex
