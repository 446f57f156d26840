#include "sensors/mid360_pattern.h"

#include <cmath>
#include <numbers>
#include <stdexcept>

namespace arex::sim {
namespace {

constexpr std::int64_t kUnitsPerDegree = 100'000'000;
constexpr std::int64_t kUnitsPerTurn = 360 * kUnitsPerDegree;

// Where the table begins, in both modes.
constexpr std::int64_t kPsiStart = 26'934'650'000;
constexpr std::int64_t kPhiStart = -55'130'000;

// Per shot of 20 us. The table: 182.4167 Hz and 10 Hz; any other step of 1e-6 deg in psi or of
// 1e-7 in phi shows after its 200,000 shots.
constexpr std::int64_t kPsiRateTable = -131'340'000;
constexpr std::int64_t kPhiRateTable = 7'200'000;
// The measured unit: 180.99 Hz and 9.94 Hz.
constexpr std::int64_t kPsiRateDevice = -130'312'800;
constexpr std::int64_t kPhiRateDevice = 7'156'800;

}  // namespace

Mid360Pattern::Mid360Pattern(PatternMode mode, double turn_deg)
    : handedness_(mode == PatternMode::kDevice ? -1 : 1),
      turn_(mode == PatternMode::kDevice ? turn_by(turn_deg) : Turn{}),
      phi_(make_phase(kPhiStart, mode == PatternMode::kDevice ? kPhiRateDevice : kPhiRateTable)),
      psi_(make_phase(kPsiStart, mode == PatternMode::kDevice ? kPsiRateDevice : kPsiRateTable)) {}

Mid360Pattern::Turn Mid360Pattern::turn_by(double angle_deg) {
  const double angle = angle_deg / 180 * std::numbers::pi;
  return {std::cos(angle), std::sin(angle)};
}

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

// The beam's direction (X, Y, Z) in the frame that turns with psi. A line leaves beside the middle
// of the four by s = 2 k - 3 half spacings; what that does is expanded to second order in s, and
// its p-th order holds harmonics of psi up to p. Coefficients below 5e-5 at the outer lines are
// left out.
Mid360Pattern::Shot Mid360Pattern::shot_at(const Turn& phi, const Turn& psi) const {
  const Turn phi2 = phi * phi, phi3 = phi2 * phi, phi4 = phi2 * phi2, phi5 = phi3 * phi2;
  const auto [c1, s1] = phi;
  const auto [c2, s2] = phi2;
  const auto [c3, s3] = phi3;
  const auto [c4, s4] = phi4;
  const auto [c5, s5] = phi5;
  const double c6 = 2 * c3 * c3 - 1;
  const auto [cp, sp] = psi;
  const auto [c2p, s2p] = psi * psi;
  const double X0 = .842081 - .148890 * c1 - .000289 * s1 - .006245 * c2 - .013213 * c3 +
                    .000264 * s3 - .001022 * c4 - .000594 * c5 - .000095 * c6;
  const double X1 =
      sp * (-.006274 - .008599 * c1 - .001727 * c2 - .000916 * c3 - .000288 * c4 - .000074 * c5) -
      cp * (.008783 * s1 + .001523 * s2 + .000756 * s3 + .000260 * s4 + .000065 * s5);
  const double X2 = -.000200 - .000091 * c1 - .000021 * c2 + c2p * (.000043 * c1 + .000094 * c2) -
                    s2p * (.000040 * s1 + .000090 * s2);
  const double Y0 = .000492 * c1 + .441109 * s1 + .000574 * c3 + .029716 * s3 + .001187 * s5;
  const double Y1 =
      cp * (.015059 - .002322 * c2 - .000347 * c4) + sp * (.002269 * s2 + .000349 * s4);
  const double Y2 = .000069 * s1 + s2p * .000023 * c1 + c2p * .000027 * s1;
  const double Z0 =
      .334181 + .373646 * c1 + .000795 * s1 + .031546 * c3 - .000659 * s3 + .001112 * c5;
  const double Z1 = sp * (.014145 - .000585 * c1 + .002286 * c2 - .000049 * c3 + .000342 * c4) +
                    cp * (-.000680 * s1 + .002235 * s2 - .000046 * s3 + .000344 * s4);
  const double Z2 = -.000013 + .000059 * c1 - c2p * .000015 * c1 + s2p * .000017 * s1;
  const Eigen::Array4d s(-3, -1, 1, 3);
  const Eigen::Array4d X = X0 + s * (X1 + s * X2), Y = Y0 + s * (Y1 + s * Y2),
                       Z = Z0 + s * (Z1 + s * Z2);
  const Eigen::Array4d scale = (X * X + Y * Y + Z * Z).sqrt().inverse();
  const Eigen::Array4d x = scale * (cp * X - sp * Y);
  const Eigen::Array4d y = handedness_ * scale * (sp * X + cp * Y);
  return {turn_.c * x - turn_.s * y, turn_.s * x + turn_.c * y, scale * Z};
}

}  // namespace arex::sim
