// The functions of C that elementary.cpp defines, against libquadmath's 113 bits.
#include <dlfcn.h>
#include <gtest/gtest.h>
#include <quadmath.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <vector>

#include "math/random.h"

namespace arex {
namespace {

using Quad = __float128;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr int kSamples = 20'000;

/// Where arguments are drawn from.
struct Range {
  double low, high;  ///< with logarithmic: of the magnitude
  bool logarithmic = false;
  bool both_signs = false;
  double about = 0;  ///< added to the draw
};

double draw(const Range& range, RandomStream& random) {
  if (!range.logarithmic) return range.about + random.uniform(range.low, range.high);
  const double exponent = random.uniform(std::log2(range.low), std::log2(range.high));
  const double magnitude = std::exp2(exponent);
  return range.about + (range.both_signs && random.uniform() < 0.5 ? -magnitude : magnitude);
}

/// Any finite number: all exponents alike.
const Range kAny{0x1p-1022, 0x1.8p1023, true, true};
const Range kPositive{0x1p-1022, 0x1.8p1023, true};

/// How far a result lies from the exact one, in units of the last place.
double error_ulp(double result, Quad exact) {
  const double rounded = static_cast<double>(exact);
  if (!std::isfinite(rounded)) return result == rounded ? 0 : kInfinity;
  const double magnitude = std::max(std::abs(rounded), std::numeric_limits<double>::min());
  const double ulp = std::nextafter(magnitude, kInfinity) - magnitude;
  return static_cast<double>(fabsq(static_cast<Quad>(result) - exact) / static_cast<Quad>(ulp));
}

template <class Function, class Reference>
double worst_ulp(Function f, Reference exact, const std::vector<Range>& ranges) {
  RandomStream random(1, "arguments");
  double worst = 0;
  for (const Range& range : ranges) {
    for (int i = 0; i < kSamples; ++i) {
      const double x = draw(range, random);
      worst = std::max(worst, error_ulp(f(x), exact(static_cast<Quad>(x))));
    }
  }
  return worst;
}

template <class Function, class Reference>
double worst_ulp(Function f, Reference exact, const Range& first, const Range& second) {
  RandomStream random(2, "arguments");
  double worst = 0;
  for (int i = 0; i < kSamples; ++i) {
    const double x = draw(first, random), y = draw(second, random);
    worst = std::max(worst, error_ulp(f(x, y), exact(static_cast<Quad>(x), static_cast<Quad>(y))));
  }
  return worst;
}

#define EXPECT_ACCURATE(function, ...)                                                        \
  EXPECT_LT(worst_ulp([](double x) { return std::function(x); },                              \
                      [](Quad x) { return function##q(x); }, std::vector<Range> __VA_ARGS__), \
            1)                                                                                \
      << #function

TEST(Elementary, ErrorsStayBelowOneUnitInTheLastPlace) {
  const Range turns{-10, 10}, unit{-1, 1}, near_one{1e-12, 0.3, true, true, 1.0};
  EXPECT_ACCURATE(sin, {turns, kAny});
  EXPECT_ACCURATE(cos, {turns, kAny});
  EXPECT_ACCURATE(tan, {turns, kAny});
  EXPECT_ACCURATE(asin, {unit, {1e-20, 1, true, true}, {-1e-3, 0, false, false, 1.0}});
  EXPECT_ACCURATE(acos, {unit, {1e-20, 1, true, true}, {-1e-3, 0, false, false, 1.0}});
  EXPECT_ACCURATE(atan, {turns, kAny});
  EXPECT_ACCURATE(exp, {{-744, 709.7}, {1e-18, 30, true, true}});
  EXPECT_ACCURATE(exp2, {{-1073, 1023}, unit});
  EXPECT_ACCURATE(expm1, {{-40, 709.7}, {1e-18, 30, true, true}});
  EXPECT_ACCURATE(log, {kPositive, near_one});
  EXPECT_ACCURATE(log2, {kPositive, near_one});
  EXPECT_ACCURATE(log10, {kPositive, near_one});
  EXPECT_ACCURATE(log1p, {{1e-18, 1e300, true}, {-0.999, 1}});
  EXPECT_ACCURATE(cbrt, {kAny, turns});
}

TEST(Elementary, ThoseOfTwoArgumentsToo) {
  const auto pow = [](double x, double y) { return std::pow(x, y); };
  const auto exact_pow = [](Quad x, Quad y) { return powq(x, y); };
  EXPECT_LT(worst_ulp(pow, exact_pow, {1e-3, 1e3, true}, {-100, 100}), 1);
  EXPECT_LT(worst_ulp(pow, exact_pow, {1e-6, 1e-2, true, true, 1.0}, {-70'000, 70'000}), 1);
  EXPECT_LT(worst_ulp(pow, exact_pow, kPositive, {-2, 2}), 1);
  const auto atan2 = [](double y, double x) { return std::atan2(y, x); };
  const auto exact_atan2 = [](Quad y, Quad x) { return atan2q(y, x); };
  EXPECT_LT(worst_ulp(atan2, exact_atan2, {-10, 10}, {-10, 10}), 1);
  EXPECT_LT(worst_ulp(atan2, exact_atan2, kAny, kAny), 1);
  const auto hypot = [](double x, double y) { return std::hypot(x, y); };
  const auto exact_hypot = [](Quad x, Quad y) { return hypotq(x, y); };
  EXPECT_LT(worst_ulp(hypot, exact_hypot, {-10, 10}, {-10, 10}), 1);
  EXPECT_LT(worst_ulp(hypot, exact_hypot, kAny, kAny), 1);
}

// Next to multiples of pi/2 all digits of the argument cancel; the last one is the worst of all
// doubles (Muller, Elementary Functions, 2006, table 11.1).
TEST(Elementary, SineAndTangentHoldWhereTheArgumentCancels) {
  for (const double x :
       {3.141592653589793, 1.5707963267948966, 6.283185307179586, 355.0, 0x1.921fb54442d18p+19,
        0x1.921fb54442d18p+30, 0x1p20, 1e22, 0x1.6ac5b262ca1ffp+849}) {
    const auto exact = static_cast<Quad>(x);
    EXPECT_LT(error_ulp(std::sin(x), sinq(exact)), 1) << x;
    EXPECT_LT(error_ulp(std::cos(-x), cosq(exact)), 1) << x;
    EXPECT_LT(error_ulp(std::tan(x), tanq(exact)), 1) << x;
  }
}

TEST(Elementary, ExactResultsAreExact) {
  for (int n = -1022; n <= 1023; ++n) {
    const double power = std::ldexp(1.0, n);
    EXPECT_EQ(std::exp2(static_cast<double>(n)), power);
    EXPECT_EQ(std::log2(power), n);
    EXPECT_EQ(std::pow(2.0, static_cast<double>(n)), power);
  }
  for (int n = 0; n <= 22; ++n) EXPECT_EQ(std::log10(std::pow(10.0, static_cast<double>(n))), n);
  for (double n = -1000; n <= 1000; ++n) {
    EXPECT_EQ(std::cbrt(n * n * n), n);
    EXPECT_EQ(std::pow(n, 3.0), n * n * n);
    EXPECT_EQ(std::hypot(3 * n, 4 * n), 5 * std::abs(n));
  }
  EXPECT_EQ(std::exp(0.0), 1);
  EXPECT_EQ(std::cos(0.0), 1);
}

bool same(double a, double b) {
  return std::isnan(a) ? std::isnan(b)
                       : std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

// ISO C, annex F: zeros with their signs, infinities, NaN, arguments out of the domain.
TEST(Elementary, SpecialArgumentsAreThoseOfTheStandard) {
  const double tiny = std::numeric_limits<double>::denorm_min();
  for (const double x : {0.0, -0.0, tiny, -tiny}) {
    for (double (*f)(double) :
         {+[](double a) { return std::sin(a); }, +[](double a) { return std::tan(a); },
          +[](double a) { return std::asin(a); }, +[](double a) { return std::atan(a); },
          +[](double a) { return std::expm1(a); }, +[](double a) { return std::log1p(a); }}) {
      EXPECT_TRUE(same(f(x), x)) << x;
    }
  }
  volatile double inf = kInfinity, zero = 0, one = 1, two = 2, three = 3, half = 0.5, nan = kNan;
  EXPECT_TRUE(same(std::sin(inf), kNan) && same(std::cos(-inf), kNan) && same(std::tan(inf), kNan));
  EXPECT_TRUE(same(std::asin(two), kNan) && same(std::acos(-two), kNan));
  EXPECT_EQ(std::exp(inf), kInfinity);
  EXPECT_EQ(std::exp(-inf), 0);
  EXPECT_EQ(std::exp(710 * one), kInfinity);
  EXPECT_EQ(std::expm1(-inf), -1);
  EXPECT_EQ(std::log(zero), -kInfinity);
  EXPECT_EQ(std::log(-zero), -kInfinity);
  EXPECT_EQ(std::log1p(-one), -kInfinity);
  EXPECT_EQ(std::log(inf), kInfinity);
  EXPECT_TRUE(same(std::log(-one), kNan) && same(std::log(nan), kNan));
  EXPECT_EQ(std::pow(nan, zero), 1);
  EXPECT_EQ(std::pow(one, nan), 1);
  EXPECT_TRUE(same(std::pow(-two, half), kNan));
  EXPECT_EQ(std::pow(-two, three), -8);
  EXPECT_TRUE(same(std::pow(-zero, three), -0.0) && same(std::pow(-zero, two), 0.0));
  EXPECT_EQ(std::pow(-zero, -three), -kInfinity);
  EXPECT_EQ(std::pow(-inf, three), -kInfinity);
  EXPECT_EQ(std::pow(-inf, -two), 0);
  EXPECT_EQ(std::pow(half, -inf), kInfinity);
  EXPECT_EQ(std::pow(-one, inf), 1);
  EXPECT_EQ(std::hypot(nan, inf), kInfinity);
  const double pi = 3.141592653589793;
  EXPECT_TRUE(same(std::atan2(zero, one), 0.0) && same(std::atan2(-zero, one), -0.0));
  EXPECT_TRUE(same(std::atan2(zero, -zero), pi) && same(std::atan2(-zero, -one), -pi));
  EXPECT_EQ(std::atan2(one, zero), pi / 2);
  EXPECT_EQ(std::atan2(inf, -inf), 3 * pi / 4);
  EXPECT_EQ(std::atan2(-one, inf), 0);
  EXPECT_EQ(std::acos(-one), pi);
}

TEST(Elementary, SinglePrecisionIsTheDoubleOneRounded) {
  RandomStream random(3, "arguments");
  for (int i = 0; i < kSamples; ++i) {
    const auto x = static_cast<float>(random.uniform(-20, 20)), y = std::abs(x);
    const double wide = x, wide_y = y;
    EXPECT_EQ(std::sin(x), static_cast<float>(std::sin(wide)));
    EXPECT_EQ(std::cos(x), static_cast<float>(std::cos(wide)));
    EXPECT_EQ(std::atan(x), static_cast<float>(std::atan(wide)));
    EXPECT_EQ(std::exp(x), static_cast<float>(std::exp(wide)));
    EXPECT_EQ(std::log(y), static_cast<float>(std::log(wide_y)));
    EXPECT_EQ(std::pow(y, 0.3F), static_cast<float>(std::pow(wide_y, static_cast<double>(0.3F))));
  }
}

// Who asks the process for a function by its name, as every shared library does, gets this one.
TEST(Elementary, AreTheProcessesOwn) {
  Dl_info here{}, found{};
  static const int kInThisProgram = 0;
  ASSERT_NE(dladdr(&kInThisProgram, &here), 0);
  for (const char* name : {"sin", "cosf", "sincos", "exp", "log", "pow", "powf", "atan2", "acos"}) {
    void* function = dlsym(RTLD_DEFAULT, name);
    ASSERT_NE(function, nullptr) << name;
    ASSERT_NE(dladdr(function, &found), 0) << name;
    EXPECT_STREQ(found.dli_fname, here.dli_fname) << name;
  }
}

}  // namespace
}  // namespace arex
