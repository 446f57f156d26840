#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "math/random.h"
#include "sensors/mid360_pattern.h"

namespace arex::sim {
namespace {

// The series that the pattern was fitted with, written out in long double.
Vec3 printed_formula(PatternMode mode, std::int64_t firing) {
  using Real = long double;
  const Real n = static_cast<Real>(firing / 4), s = static_cast<Real>(2 * (firing % 4) - 3);
  const bool table = mode == PatternMode::kTable;
  const Real degree = std::numbers::pi_v<Real> / 180;
  const Real phi = std::fmod((table ? 0.07199879L : 0.0712760L) * n - 0.5811L, Real{360}) * degree;
  const Real psi = std::fmod((table ? -1.31341L : -1.3037986L) * n + 269.3687L, Real{360}) * degree;
  const Real c1 = std::cos(phi), c2 = std::cos(2 * phi), c3 = std::cos(3 * phi);
  const Real s1 = std::sin(phi), s2 = std::sin(2 * phi), s3 = std::sin(3 * phi);
  const Real X = .841105L - .149469L * c1 - .006457L * c2 - .013360L * c3 +
                 s * std::sin(psi) * (-.006298L - .008555L * c1 - .001854L * c2) -
                 s * std::cos(psi) * (.008757L * s1 + .001364L * s2);
  const Real Y = .441196L * s1 - .000309L * s2 + .029662L * s3 +
                 s * std::sin(psi) * (-.000009L * s1 + .002280L * s2) -
                 s * std::cos(psi) * (-.015054L + .000084L * c1 + .002295L * c2);
  const Real Z = .334269L + .373870L * c1 + .000328L * c2 + .031313L * c3 +
                 s * std::sin(psi) * (.014109L - .000554L * c1 + .002253L * c2) -
                 s * std::cos(psi) * (.000678L * s1 - .002274L * s2);
  const Real norm = std::sqrt(X * X + Y * Y + Z * Z);
  const Real x = (std::cos(psi) * X - std::sin(psi) * Y) / norm;
  const Real y = (std::sin(psi) * X + std::cos(psi) * Y) / norm;
  return {static_cast<double>(x), static_cast<double>(table ? y : -y),
          static_cast<double>(Z / norm)};
}

class PatternTest : public testing::TestWithParam<PatternMode> {};

TEST_P(PatternTest, IsThePrintedFormulaThroughoutALongMission) {
  const Mid360Pattern pattern(GetParam());
  RandomStream stream(7, "pattern");
  constexpr int kHalfHour = 1800 * 200'000;
  for (int i = 0; i < 20'000; ++i) {
    const std::int64_t firing = i < 8'000 ? i : stream.uniform_int(0, kHalfHour);
    const Vec3 direction = pattern.direction(firing);
    ASSERT_LT((direction - printed_formula(GetParam(), firing)).norm(), 1e-10) << firing;
    ASSERT_NEAR(direction.norm(), 1, 1e-14);
  }
}

TEST_P(PatternTest, WholeTickEqualsSingleFirings) {
  const Mid360Pattern pattern(GetParam());
  std::array<Mid360Pattern::Shot, Mid360Pattern::kShotsPerTick> shots;
  for (const std::int64_t first : {0, 50, 123'450, 89'999'950}) {
    pattern.directions(first, shots);
    for (std::size_t i = 0; i < shots.size(); ++i) {
      for (int k = 0; k < 4; ++k) {
        const Vec3 expected = pattern.direction(4 * (first + static_cast<std::int64_t>(i)) + k);
        ASSERT_LT((Vec3(shots[i].x[k], shots[i].y[k], shots[i].z[k]) - expected).norm(), 1e-13);
      }
    }
  }
}

// Share of the cells of the field of view, 360 x 59 degrees in 0.5-degree steps of azimuth and
// elevation (720 x 118 cells from -7 to 52 degrees), that hold at least one firing.
TEST_P(PatternTest, CoversTheFieldOfViewAsMeasured) {
  constexpr int kColumns = 720, kRows = 118;
  const Mid360Pattern pattern(GetParam());
  const std::array<double, 6> times_s{0.1, 0.2, 0.5, 1, 2, 4};
  const std::array<double, 6> expected =
      GetParam() == PatternMode::kDevice
          ? std::array<double, 6>{.212, .381, .702, .886, .952, .958}
          : std::array<double, 6>{.213, .373, .655, .821, .937, .959};
  std::vector<bool> seen(kColumns * kRows, false);
  int cells = 0;
  std::int64_t firing = 0;
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    for (; firing < static_cast<std::int64_t>(times_s[i] * 200'000 + 0.5); ++firing) {
      const Vec3 d = pattern.direction(firing);
      const double azimuth = std::atan2(d.y(), d.x()) * 180 / std::numbers::pi + 180;
      const double elevation = std::asin(d.z()) * 180 / std::numbers::pi + 7;
      ASSERT_GE(elevation, 0);
      ASSERT_LT(elevation, 59);
      const auto cell = static_cast<std::size_t>(static_cast<int>(elevation * 2) * kColumns +
                                                 static_cast<int>(azimuth * 2) % kColumns);
      cells += seen[cell] ? 0 : 1;
      seen[cell] = true;
    }
    EXPECT_NEAR(static_cast<double>(cells) / (kColumns * kRows), expected[i], 0.001)
        << "after " << times_s[i] << " s";
  }
}

INSTANTIATE_TEST_SUITE_P(Modes, PatternTest,
                         testing::Values(PatternMode::kDevice, PatternMode::kTable),
                         [](const auto& mode) {
                           return std::string(
                               enum_names(mode.param)[static_cast<std::size_t>(mode.param)]);
                         });

TEST(Mid360Pattern, DeviceTurnsAtTheMeasuredSpeeds) {
  // Ten seconds of line 1 seen from outside: whole turns of the azimuth, and passages of the
  // elevation through its middle, two a turn of the slow rotation.
  constexpr int kSeconds = 10, kShots = 50'000 * kSeconds;
  const Mid360Pattern pattern(PatternMode::kDevice);
  double turned = 0;
  int passages = 0;
  Vec3 previous = pattern.direction(1);
  for (std::int64_t n = 1; n <= kShots; ++n) {
    const Vec3 d = pattern.direction(4 * n + 1);
    turned += std::atan2(previous.x() * d.y() - previous.y() * d.x(),
                         previous.x() * d.x() + previous.y() * d.y());
    passages += (previous.z() < 0.35) != (d.z() < 0.35) ? 1 : 0;
    previous = d;
  }
  // Counter-clockwise seen from above; the azimuth is modulated by 27 degrees, 0.08 turns.
  EXPECT_NEAR(turned / (2 * std::numbers::pi * kSeconds), 181.08313, 2 * 0.08 / kSeconds);
  EXPECT_NEAR(passages / (2.0 * kSeconds), 9.89944, 1.0 / kSeconds);
}

}  // namespace
}  // namespace arex::sim
