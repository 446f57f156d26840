#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <numbers>
#include <string>

#ifdef AREX_REAL_DATA
#include <zlib.h>
#endif

#include "math/random.h"
#include "sensors/mid360_pattern.h"

namespace arex::sim {
namespace {

/// A term of the series: s^power trig_psi(m psi) trig_phi(j phi) times a value, on one axis.
struct Term {
  int axis, power, m;
  char trig_psi;
  int j;
  char trig_phi;
  long double value;
};
constexpr Term kTerms[] = {
    {0, 0, 0, 'c', 0, 'c', 0.842081L},  {0, 0, 0, 'c', 1, 'c', -0.148890L},
    {0, 0, 0, 'c', 1, 's', -0.000289L}, {0, 0, 0, 'c', 2, 'c', -0.006245L},
    {0, 0, 0, 'c', 3, 'c', -0.013213L}, {0, 0, 0, 'c', 3, 's', 0.000264L},
    {0, 0, 0, 'c', 4, 'c', -0.001022L}, {0, 0, 0, 'c', 5, 'c', -0.000594L},
    {0, 0, 0, 'c', 6, 'c', -0.000095L}, {0, 1, 1, 's', 0, 'c', -0.006274L},
    {0, 1, 1, 's', 1, 'c', -0.008599L}, {0, 1, 1, 'c', 1, 's', -0.008783L},
    {0, 1, 1, 's', 2, 'c', -0.001727L}, {0, 1, 1, 'c', 2, 's', -0.001523L},
    {0, 1, 1, 's', 3, 'c', -0.000916L}, {0, 1, 1, 'c', 3, 's', -0.000756L},
    {0, 1, 1, 's', 4, 'c', -0.000288L}, {0, 1, 1, 'c', 4, 's', -0.000260L},
    {0, 1, 1, 's', 5, 'c', -0.000074L}, {0, 1, 1, 'c', 5, 's', -0.000065L},
    {0, 2, 0, 'c', 0, 'c', -0.000200L}, {0, 2, 0, 'c', 1, 'c', -0.000091L},
    {0, 2, 0, 'c', 2, 'c', -0.000021L}, {0, 2, 2, 'c', 1, 'c', 0.000043L},
    {0, 2, 2, 's', 1, 's', -0.000040L}, {0, 2, 2, 'c', 2, 'c', 0.000094L},
    {0, 2, 2, 's', 2, 's', -0.000090L}, {1, 0, 0, 'c', 1, 'c', 0.000492L},
    {1, 0, 0, 'c', 1, 's', 0.441109L},  {1, 0, 0, 'c', 3, 'c', 0.000574L},
    {1, 0, 0, 'c', 3, 's', 0.029716L},  {1, 0, 0, 'c', 5, 's', 0.001187L},
    {1, 1, 1, 'c', 0, 'c', 0.015059L},  {1, 1, 1, 'c', 2, 'c', -0.002322L},
    {1, 1, 1, 's', 2, 's', 0.002269L},  {1, 1, 1, 'c', 4, 'c', -0.000347L},
    {1, 1, 1, 's', 4, 's', 0.000349L},  {1, 2, 0, 'c', 1, 's', 0.000069L},
    {1, 2, 2, 's', 1, 'c', 0.000023L},  {1, 2, 2, 'c', 1, 's', 0.000027L},
    {2, 0, 0, 'c', 0, 'c', 0.334181L},  {2, 0, 0, 'c', 1, 'c', 0.373646L},
    {2, 0, 0, 'c', 1, 's', 0.000795L},  {2, 0, 0, 'c', 3, 'c', 0.031546L},
    {2, 0, 0, 'c', 3, 's', -0.000659L}, {2, 0, 0, 'c', 5, 'c', 0.001112L},
    {2, 1, 1, 's', 0, 'c', 0.014145L},  {2, 1, 1, 's', 1, 'c', -0.000585L},
    {2, 1, 1, 'c', 1, 's', -0.000680L}, {2, 1, 1, 's', 2, 'c', 0.002286L},
    {2, 1, 1, 'c', 2, 's', 0.002235L},  {2, 1, 1, 's', 3, 'c', -0.000049L},
    {2, 1, 1, 'c', 3, 's', -0.000046L}, {2, 1, 1, 's', 4, 'c', 0.000342L},
    {2, 1, 1, 'c', 4, 's', 0.000344L},  {2, 2, 0, 'c', 0, 'c', -0.000013L},
    {2, 2, 0, 'c', 1, 'c', 0.000059L},  {2, 2, 2, 'c', 1, 'c', -0.000015L},
    {2, 2, 2, 's', 1, 's', 0.000017L},
};

/// The series summed term by term in long double from the angles, without the device's turn.
Vec3 printed_series(PatternMode mode, std::int64_t firing) {
  using Real = long double;
  const Real n = static_cast<Real>(firing / 4), s = static_cast<Real>(2 * (firing % 4) - 3);
  const bool table = mode == PatternMode::kTable;
  const Real degree = std::numbers::pi_v<Real> / 180;
  const Real phi = std::fmod((table ? 0.072L : 0.071568L) * n - 0.5513L, Real{360}) * degree;
  const Real psi = std::fmod((table ? -1.3134L : -1.303128L) * n + 269.3465L, Real{360}) * degree;
  const auto trig = [](char which, Real angle) {
    return which == 'c' ? std::cos(angle) : std::sin(angle);
  };
  std::array<Real, 3> v{};
  for (const Term& term : kTerms) {
    v[static_cast<std::size_t>(term.axis)] += term.value * std::pow(s, Real(term.power)) *
                                              trig(term.trig_psi, Real(term.m) * psi) *
                                              trig(term.trig_phi, Real(term.j) * phi);
  }
  const Real norm = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  const Real x = (std::cos(psi) * v[0] - std::sin(psi) * v[1]) / norm;
  const Real y = (std::sin(psi) * v[0] + std::cos(psi) * v[1]) / norm;
  return {static_cast<double>(x), static_cast<double>(table ? y : -y),
          static_cast<double>(v[2] / norm)};
}

class PatternTest : public testing::TestWithParam<PatternMode> {};

TEST_P(PatternTest, IsItsSeriesThroughoutALongMission) {
  const Mid360Pattern pattern(GetParam(), 0);
  RandomStream stream(7, "pattern");
  constexpr int kHalfHour = 1800 * 200'000;
  for (int i = 0; i < 20'000; ++i) {
    const std::int64_t firing = i < 8'000 ? i : stream.uniform_int(0, kHalfHour);
    const Vec3 direction = pattern.direction(firing);
    ASSERT_LT((direction - printed_series(GetParam(), firing)).norm(), 1e-10) << firing;
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

// The table's shares are the maker's own rows', the device's are pinned. Share of the cells of the
// field of view, 360 x 59 degrees in 0.5-degree steps of azimuth and elevation (720 x 118 cells
// from -7 to 52 degrees), that hold at least one firing.
TEST_P(PatternTest, CoversTheFieldOfViewAsMeasured) {
  constexpr int kColumns = 720, kRows = 118;
  const Mid360Pattern pattern(GetParam());
  const std::array<double, 6> times_s{0.1, 0.2, 0.5, 1, 2, 4};
  const std::array<double, 6> expected =
      GetParam() == PatternMode::kDevice
          ? std::array<double, 6>{.2134, .3697, .6954, .8799, .952, .958}
          : std::array<double, 6>{.2120, .3728, .6622, .8368, .9479, .9640};
  std::vector<bool> seen(kColumns * kRows, false);
  int cells = 0;
  std::int64_t firing = 0;
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    for (; firing < static_cast<std::int64_t>(times_s[i] * 200'000 + 0.5); ++firing) {
      const Vec3 d = pattern.direction(firing);
      const double azimuth = std::atan2(d.y(), d.x()) * 180 / std::numbers::pi + 180;
      const double elevation = std::asin(d.z()) * 180 / std::numbers::pi + 7;
      ASSERT_GE(elevation, -0.25);
      ASSERT_LT(elevation, 59.25);
      if (elevation < 0 || elevation >= 59) continue;  // beyond what the datasheet promises
      const auto cell = static_cast<std::size_t>(static_cast<int>(elevation * 2) * kColumns +
                                                 static_cast<int>(azimuth * 2) % kColumns);
      cells += seen[cell] ? 0 : 1;
      seen[cell] = true;
    }
    EXPECT_NEAR(static_cast<double>(cells) / (kColumns * kRows), expected[i], 0.0015)
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
  EXPECT_NEAR(turned / (2 * std::numbers::pi * kSeconds), 180.99, 2 * 0.08 / kSeconds);
  EXPECT_NEAR(passages / (2.0 * kSeconds), 9.94, 1.0 / kSeconds);
}

/// By how much the outer lines differ in elevation against azimuth, in shots whose azimuth lies
/// within 3 degrees of `azimuth_deg`: above 1 they are stacked, below 1 they lie side by side.
double stacking(const Mid360Pattern& pattern, double azimuth_deg) {
  double elevation = 0, azimuth = 0;
  for (std::int64_t n = 0; n < 100'000; ++n) {
    const Vec3 a = pattern.direction(4 * n), b = pattern.direction(4 * n + 3);
    const Vec3 middle = (a + b).normalized();
    const double at = std::atan2(middle.y(), middle.x()) * 180 / std::numbers::pi;
    if (std::abs(std::remainder(at - azimuth_deg, 360)) > 3) continue;
    const double across = std::hypot(middle.x(), middle.y());
    elevation += std::abs((b - a).z()) / across;
    azimuth += std::abs((b - a).x() * middle.y() - (b - a).y() * middle.x()) / across;
  }
  return elevation / azimuth;
}

TEST(Mid360Pattern, LinesStackWhereTheDeviceIsTurnedTo) {
  const Mid360Pattern device(PatternMode::kDevice), turned(PatternMode::kDevice, -59.5);
  const Mid360Pattern table(PatternMode::kTable);
  for (const double side : {0.0, 180.0}) {
    EXPECT_GT(stacking(device, side), 1.8);
    EXPECT_LT(stacking(device, side + 90), 0.5);
    EXPECT_LT(stacking(table, side), 0.5);
    EXPECT_GT(stacking(table, side + 90), 1.8);
    EXPECT_GT(stacking(turned, side + 30), 1.8);
  }
}

// Elevations know neither mirror nor turn, so the device's points per elevation are the table's:
// what a recording differs by is its scene.
TEST(Mid360Pattern, DeviceAndTableSpreadTheSameOverElevation) {
  constexpr int kBands = 15;
  const auto shares = [](PatternMode mode) {
    const Mid360Pattern pattern(mode);
    std::array<double, kBands> share{};
    constexpr int kFirings = 800'000;
    for (int i = 0; i < kFirings; ++i) {
      const double elevation = std::asin(pattern.direction(i).z()) * 180 / std::numbers::pi;
      share[static_cast<std::size_t>(std::clamp((elevation + 8) / 4, 0.0, kBands - 1.0))] +=
          1.0 / kFirings;
    }
    return share;
  };
  const auto device = shares(PatternMode::kDevice), table = shares(PatternMode::kTable);
  for (std::size_t i = 0; i < kBands; ++i) EXPECT_NEAR(device[i] / table[i], 1, 0.015) << i;
}

#ifdef AREX_REAL_DATA
std::string inflated(const std::string& file, std::size_t bytes) {
  std::ifstream in(file, std::ios::binary);
  const std::string packed{std::istreambuf_iterator<char>(in), {}};
  std::string out(bytes, 0);
  uLongf length = bytes;
  EXPECT_EQ(uncompress(reinterpret_cast<Bytef*>(out.data()), &length,
                       reinterpret_cast<const Bytef*>(packed.data()), packed.size()),
            Z_OK);
  EXPECT_EQ(length, bytes);
  return out;
}

TEST(Mid360Pattern, FollowsTheMakersTableToItsEnd) {
  constexpr std::size_t kRows = 800'000;
  const std::string bytes =
      inflated(AREX_REAL_DATA "/lidar/mid360_maker_pattern_800000.u16le.zlib", 4 * kRows);
  const Mid360Pattern pattern(PatternMode::kTable);
  double azimuth2 = 0, elevation2 = 0, low = 90, high = -90, table_low = 90, table_high = -90;
  for (std::size_t i = 0; i < kRows; ++i) {
    std::array<std::uint16_t, 2> row{};
    std::memcpy(row.data(), bytes.data() + 4 * i, 4);
    const Vec3 d = pattern.direction(static_cast<std::int64_t>(i));
    const double azimuth = std::atan2(d.y(), d.x()) * 180 / std::numbers::pi;
    const double elevation = std::asin(d.z()) * 180 / std::numbers::pi;
    const double expected = row[1] / 100.0 - 10;
    const double off = std::remainder(azimuth - row[0] / 100.0, 360);
    azimuth2 += std::pow(off * std::cos(expected * std::numbers::pi / 180), 2) / kRows;
    elevation2 += std::pow(elevation - expected, 2) / kRows;
    low = std::min(low, elevation);
    high = std::max(high, elevation);
    table_low = std::min(table_low, expected);
    table_high = std::max(table_high, expected);
  }
  EXPECT_LT(std::sqrt(azimuth2), 0.0075);  // as fitted; the table is rounded to 0.003 RMS
  EXPECT_LT(std::sqrt(elevation2), 0.011);
  EXPECT_NEAR(low, table_low, 0.03);
  EXPECT_NEAR(high, table_high, 0.06);
}
#endif

}  // namespace
}  // namespace arex::sim
