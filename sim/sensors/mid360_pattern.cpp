#include "sensors/mid360_pattern.h"

#include <cmath>
#include <numbers>
#include <stdexcept>

namespace arex::sim {
namespace {

constexpr std::int64_t kUnitsPerDegree = 100'000'000;
constexpr std::int64_t kUnitsPerTurn = 360 * kUnitsPerDegree;

// 269.3687 deg and -0.5811 deg at shot 0, in both modes.
constexpr std::int64_t kPsiStart = 26'936'870'000;
constexpr std::int64_t kPhiStart = -58'110'000;

// Per shot of 20 us. Device: a measured unit, 181.08313 Hz and 9.89944 Hz.
constexpr std::int64_t kPsiRateDevice = -130'379'860;
constexpr std::int64_t kPhiRateDevice = 7'127'600;
constexpr std::int64_t kPsiRateTable = -131'341'000;
constexpr std::int64_t kPhiRateTable = 7'199'879;

}  // namespace

Mid360Pattern::Mid360Pattern(PatternMode mode)
    : handedness_(mode == PatternMode::kDevice ? -1 : 1),
      phi_(make_phase(kPhiStart, mode == PatternMode::kDevice ? kPhiRateDevice : kPhiRateTable)),
      psi_(make_phase(kPsiStart, mode == PatternMode::kDevice ? kPsiRateDevice : kPsiRateTable)) {}

Mid360Pattern::Turn Mid360Pattern::Phase::at(std::int64_t shot) const {
  const std::int64_t units = (start + rate * shot) % kUnitsPerTurn;
  const double angle = static_cast<double>(units) / (180.0 * kUnitsPerDegree) * std::numbers::pi;
  return {std::cos(angle), std::sin(angle)};
}

Mid360Pattern::Phase Mid360Pattern::make_phase(std::int64_t start, std::int64_t rate) {
  Phase phase;
  phase.rate = rate;
  for (std::size_t i = 0; i < phase.steps.size(); ++i) {
    phase.steps[i] = phase.at(static_cast<std::int64_t>(i));
  }
  phase.start = start;
  return phase;
}

Vec3 Mid360Pattern::direction(std::int64_t firing) const {
  const std::int64_t n = firing / kLines;
  const Shot shot = shot_at(phi_.at(n), psi_.at(n));
  const auto k = static_cast<Eigen::Index>(firing % kLines);
  return {shot.x[k], shot.y[k], shot.z[k]};
}

void Mid360Pattern::directions(std::int64_t first_shot, std::span<Shot> shots) const {
  if (shots.size() > phi_.steps.size()) throw std::invalid_argument("at most one tick of shots");
  // Two sines a call; the shots follow by the addition theorem, each in one step from the first.
  const Turn phi = phi_.at(first_shot), psi = psi_.at(first_shot);
  for (std::size_t i = 0; i < shots.size(); ++i) {
    shots[i] = shot_at(phi * phi_.steps[i], psi * psi_.steps[i]);
  }
}

Mid360Pattern::Shot Mid360Pattern::shot_at(const Turn& phi, const Turn& psi) const {
  const Turn phi2 = phi * phi, phi3 = phi2 * phi;
  const auto [c1, s1] = phi;
  const auto [c2, s2] = phi2;
  const auto [c3, s3] = phi3;
  const auto [cp, sp] = psi;
  // The beam's mean direction in the rotating frame, and how a line's offset s moves it.
  const double X0 = .841105 - .149469 * c1 - .006457 * c2 - .013360 * c3;
  const double Y0 = .441196 * s1 - .000309 * s2 + .029662 * s3;
  const double Z0 = .334269 + .373870 * c1 + .000328 * c2 + .031313 * c3;
  const double X1 =
      sp * (-.006298 - .008555 * c1 - .001854 * c2) - cp * (.008757 * s1 + .001364 * s2);
  const double Y1 =
      sp * (-.000009 * s1 + .002280 * s2) - cp * (-.015054 + .000084 * c1 + .002295 * c2);
  const double Z1 =
      sp * (.014109 - .000554 * c1 + .002253 * c2) - cp * (.000678 * s1 - .002274 * s2);
  const Eigen::Array4d s(-3, -1, 1, 3);  // 2 k - 3
  const Eigen::Array4d X = X0 + X1 * s, Y = Y0 + Y1 * s, Z = Z0 + Z1 * s;
  const Eigen::Array4d scale = (X * X + Y * Y + Z * Z).sqrt().inverse();
  return {scale * (cp * X - sp * Y), handedness_ * scale * (sp * X + cp * Y), scale * Z};
}

}  // namespace arex::sim
