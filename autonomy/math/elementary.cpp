// The elementary functions of C, under their own names: whatever is linked with this file, and
// every shared library of its process, MuJoCo's and PCL's too, takes them from here.
//
// glibc picks an implementation by the CPU that it finds, with fused multiplications or without,
// and their last bits differ; so would a flight. These are sums, products, quotients, square roots
// and fused multiplications in one fixed order, each of which IEEE 754 defines to the last bit.
// Errors stay below one unit in the last place (elementary_test). They set no errno and round to
// nearest.
//
// The method is the same everywhere: reduce the argument to a small interval, sum the Taylor series
// there, and carry what would be rounded away along as the low part of a pair.
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

double fused(double a, double b, double c) { return __builtin_fma(a, b, c); }  // a b + c
double nearest(double x) { return __builtin_nearbyint(x); }
double magnitude(double x) { return __builtin_fabs(x); }
bool negative(double x) { return __builtin_signbit(x) != 0; }
bool is_finite(double x) { return magnitude(x) < kInfinity; }

/// The exact sum of two numbers, the second less than an ulp of the first: 106 bits.
/// Source: Dekker, A floating-point technique for extending the available precision, 1971.
struct Pair {
  double hi = 0, lo = 0;
};

constexpr Pair kLn2{0x1.62e42fefa39efp-1, 0x1.abc9e3b39803fp-56};
constexpr Pair kPerLn2{0x1.71547652b82fep+0, 0x1.777d0ffda0d24p-56};
constexpr Pair kPerLn10{0x1.bcb7b1526e50ep-2, 0x1.95355baaafad3p-57};
constexpr Pair kPi{0x1.921fb54442d18p+1, 0x1.1a62633145c07p-53};
constexpr Pair kHalfPi{0x1.921fb54442d18p+0, 0x1.1a62633145c07p-54};
constexpr double kHalfPiRest = -0x1.f1976b7ed8fbcp-110;  // what kHalfPi leaves
constexpr Pair kThird{0x1.5555555555555p-2, 0x1.5555555555555p-56};

/// Exact if |a| >= |b|.
Pair ordered_sum(double a, double b) {
  const double s = a + b;
  return {s, b - (s - a)};
}
Pair exact_sum(double a, double b) {
  const double s = a + b, t = s - a;
  return {s, (a - (s - t)) + (b - t)};
}
Pair exact_product(double a, double b) {
  const double p = a * b;
  return {p, fused(a, b, -p)};
}

Pair operator-(Pair a) { return {-a.hi, -a.lo}; }
Pair operator+(Pair a, Pair b) {
  const Pair s = exact_sum(a.hi, b.hi);
  return ordered_sum(s.hi, s.lo + (a.lo + b.lo));
}
Pair operator-(Pair a, Pair b) { return a + -b; }
Pair operator*(Pair a, Pair b) {
  const Pair p = exact_product(a.hi, b.hi);
  return ordered_sum(p.hi, p.lo + (a.hi * b.lo + a.lo * b.hi));
}
Pair operator/(Pair a, Pair b) {
  const double q = a.hi / b.hi;
  return ordered_sum(q, (fused(-q, b.hi, a.hi) + (a.lo - q * b.lo)) / b.hi);
}
Pair square_root(Pair a) {
  if (a.hi <= 0) return {};
  const double s = __builtin_sqrt(a.hi);
  return ordered_sum(s, (fused(-s, s, a.hi) + a.lo) / (2 * s));
}

/// c[0] + c[1] z + c[2] z^2 + ...
template <std::size_t N>
double polynomial(double z, const std::array<double, N>& c) {
  double sum = c[N - 1];
  for (std::size_t i = N - 1; i-- > 0;) sum = sum * z + c[i];
  return sum;
}

constexpr double inverse_factorial(int n) {
  double product = 1;
  for (int i = 2; i <= n; ++i) product *= i;
  return 1 / product;
}

/// 1 / first!, 1 / (first + step)!, ..., with alternating signs where asked.
template <std::size_t N>
constexpr std::array<double, N> taylor(int first, int step, bool alternating) {
  std::array<double, N> c{};
  for (std::size_t i = 0; i < N; ++i) {
    const double sign = alternating && i % 2 == 1 ? -1 : 1;
    c[i] = sign * inverse_factorial(first + step * static_cast<int>(i));
  }
  return c;
}

// ---- sine and cosine ----------------------------------------------------------------------------

/// x less a multiple of pi/2, at most pi/4, and that multiple modulo 4.
struct Reduced {
  Pair rest;
  unsigned quadrant = 0;
};

/// For large x, whose multiple of pi/2 takes more bits than a pair has: in integers, of 2/pi only
/// the bits that count. Source: Payne and Hanek, Radian reduction for trigonometric functions,
/// 1983.
__extension__ using Wide = unsigned __int128;
__extension__ using SignedWide = __int128;
Reduced reduce_large(double x) {
  static constexpr std::array<std::uint64_t, 20> kTwoPerPi{
      0xa2f9836e4e441529, 0xfc2757d1f534ddc0, 0xdb6295993c439041, 0xfe5163abdebbc561,
      0xb7246e3a424dd2e0, 0x06492eea09d1921c, 0xfe1deb1cb129a73e, 0xe88235f52ebb4484,
      0xe99c7026b45f7e41, 0x3991d639835339f4, 0x9c845f8bbdf9283b, 0x1ff897ffde05980f,
      0xef2f118b5a0a6d1f, 0x6d367ecf27cb09b7, 0x4f463f669e5fea2d, 0x7527bac7ebe5f17b,
      0x3d0739f78a5292ea, 0x6bfb5fb11f8d5d08, 0x56033046fc7b6bab, 0xf0cfbc209af4361d};
  const auto bits = __builtin_bit_cast(std::uint64_t, x);
  const int exponent = static_cast<int>(bits >> 52 & 0x7FF) - 1075;  // x = mantissa 2^exponent
  const std::uint64_t mantissa = (bits & 0xFFFFFFFFFFFFF) | 1ULL << 52;
  // Words before the first make multiples of 4 of the product.
  const int first = exponent > 2 ? (exponent - 2) / 64 : 0;
  std::array<std::uint64_t, 6> product{};  // least significant word first; product[0] stays 0
  std::uint64_t carry = 0;
  for (int i = 0; i < 4; ++i) {
    const Wide sum = Wide{mantissa} * kTwoPerPi[static_cast<std::size_t>(first + 3 - i)] + carry;
    product[static_cast<std::size_t>(1 + i)] = static_cast<std::uint64_t>(sum);
    carry = static_cast<std::uint64_t>(sum >> 64);
  }
  product[5] = carry;
  // The product's unit is 2^(exponent - 64 (first + 4)); the quadrant's two bits go to the top.
  const int shift = 318 - (64 * (first + 4) - exponent);
  const auto word = [&](int i) {  // of the shifted product, i = 5 the top one
    const auto at = static_cast<std::size_t>(i - shift / 64);
    const int rest = shift % 64;
    return rest == 0 ? product[at] : product[at] << rest | product[at - 1] >> (64 - rest);
  };
  const std::uint64_t top = word(5);
  const Wide fraction = (Wide{top} << 64 | word(4)) << 2 | word(3) >> 62;
  const auto centred =
      static_cast<SignedWide>(fraction);  // the upper half is negative: nearer above
  const auto hi = static_cast<double>(centred);
  const auto lo = static_cast<double>(centred - static_cast<SignedWide>(hi));
  const unsigned quadrant = static_cast<unsigned>(top >> 62) + (centred < 0 ? 1 : 0);
  return {Pair{hi * 0x1p-128, lo * 0x1p-128} * kHalfPi, quadrant & 3};
}

Reduced reduce(double x) {
  if (magnitude(x) <= kHalfPi.hi / 2) return {{x, 0}, 0};
  if (magnitude(x) >= 0x1p20) {
    const Reduced positive = reduce_large(magnitude(x));
    return x > 0 ? positive : Reduced{-positive.rest, (4 - positive.quadrant) & 3};
  }
  // The first difference is exact, for fma does not round the product.
  const double n = nearest(x * (1 / kHalfPi.hi));
  const Pair small = exact_product(n, kHalfPi.lo);
  const Pair rest = exact_sum(fused(-n, kHalfPi.hi, x), -small.hi);
  return {ordered_sum(rest.hi, rest.lo - small.lo - n * kHalfPiRest),
          static_cast<unsigned>(static_cast<int>(n)) & 3};
}

Pair small_sine(Pair r) {  // |r| <= pi/4
  static constexpr auto kSeries = taylor<9>(3, 2, true);
  const double z = r.hi * r.hi;
  return ordered_sum(r.hi, r.lo * (1 - z / 2) - r.hi * z * polynomial(z, kSeries));
}

Pair small_cosine(Pair r) {  // |r| <= pi/4
  static constexpr auto kSeries = taylor<9>(4, 2, true);
  const Pair z = exact_product(r.hi, r.hi);
  const Pair head = ordered_sum(1, -z.hi / 2);
  return ordered_sum(head.hi,
                     head.lo - z.lo / 2 - r.hi * r.lo + z.hi * z.hi * polynomial(z.hi, kSeries));
}

/// sin(rest + quadrant pi/2).
Pair sine(const Reduced& r) {
  const Pair value = r.quadrant & 1 ? small_cosine(r.rest) : small_sine(r.rest);
  return r.quadrant & 2 ? -value : value;
}
Pair cosine(const Reduced& r) { return sine({r.rest, r.quadrant + 1}); }

// ---- exponential and logarithm ------------------------------------------------------------------

/// (1 + rest) 2^exponent.
struct Power {
  Pair rest;
  int exponent = 0;
};

/// e^x for |x| < 800.
Power power_of_e(Pair x) {
  static constexpr auto kSeries = taylor<14>(2, 1, false);
  const double n = nearest(x.hi * kPerLn2.hi);
  const Pair small = exact_product(n, kLn2.lo);
  const Pair r = exact_sum(fused(-n, kLn2.hi, x.hi), -small.hi) + Pair{x.lo - small.lo, 0};
  const double series = r.hi * r.hi * polynomial(r.hi, kSeries);
  return {ordered_sum(r.hi, series + (r.lo + r.lo * r.hi)), static_cast<int>(n)};
}

double times_power_of_2(double x, int n) {
  const auto power = [](int k) {
    return __builtin_bit_cast(double, static_cast<std::uint64_t>(1023 + k) << 52);
  };
  if (n > 1023) return x * power(1023) * power(n - 1023);
  if (n < -1022) return x * power(n + 200) * power(-200);
  return x * power(n);
}

double exponential(Pair x) {
  if (x.hi > 710) return kInfinity;
  if (x.hi < -746) return 0;
  const Power power = power_of_e(x);
  const Pair head = ordered_sum(1, power.rest.hi);
  return times_power_of_2(head.hi + (head.lo + power.rest.lo), power.exponent);
}

/// For finite positive x.
Pair logarithm(Pair x) {
  static constexpr std::array<double, 13> kSeries{1.0 / 5,  1.0 / 7,  1.0 / 9,  1.0 / 11, 1.0 / 13,
                                                  1.0 / 15, 1.0 / 17, 1.0 / 19, 1.0 / 21, 1.0 / 23,
                                                  1.0 / 25, 1.0 / 27, 1.0 / 29};
  const bool subnormal = x.hi < std::numeric_limits<double>::min();
  const double scaled = subnormal ? x.hi * 0x1p54 : x.hi;
  // x = 2^exponent m, with sqrt(1/2) <= m < sqrt(2) but for a bit.
  const auto bits = __builtin_bit_cast(std::int64_t, scaled);
  const auto power = (bits - 0x3fe6a09e00000000) >> 52;
  const double m = __builtin_bit_cast(double, bits - (power << 52));
  const double m_lo = x.lo == 0 ? 0 : times_power_of_2(x.lo, -static_cast<int>(power));
  const auto exponent = static_cast<double>(subnormal ? power - 54 : power);
  // log(m) = 2 atanh(s), s = (m - 1) / (m + 1).
  const Pair f = exact_sum(m - 1, m_lo);
  const Pair s = f / (exact_sum(2, f.hi) + Pair{f.lo, 0});
  const Pair z = s * s;
  const Pair series = z * (kThird + Pair{z.hi * polynomial(z.hi, kSeries), 0});
  const Pair half = s + s * series;
  return Pair{exponent, 0} * kLn2 + Pair{2 * half.hi, 2 * half.lo};
}

/// What log() and its likes return where there is no logarithm to compute.
bool without_logarithm(double x, double& result) {
  if (x > 0 && is_finite(x)) return false;
  result = x == 0 ? -kInfinity : x < 0 ? kNan : x;  // infinity and NaN are their own
  return true;
}

// ---- arc tangent --------------------------------------------------------------------------------

/// The angle of the point (x, y) in the first quadrant, not both 0.
Pair angle(Pair y, Pair x) {
  static constexpr std::array<Pair, 9> kAtanOfEighths{
      {{0, 0},
       {0x1.fd5ba9aac2f6ep-4, -0x1.cd37686760c17p-59},
       {0x1.f5b75f92c80ddp-3, 0x1.8ab6e3cf7afbdp-57},
       {0x1.6f61941e4def1p-2, -0x1.c63aae6f6e918p-56},
       {0x1.dac670561bb4fp-2, 0x1.a2b7f222f65e2p-56},
       {0x1.1e00babdefeb4p-1, -0x1.928df287a668fp-58},
       {0x1.4978fa3269ee1p-1, 0x1.2419a87f2a458p-56},
       {0x1.700a7c5784634p-1, -0x1.8c34d25aadef6p-56},
       {0x1.921fb54442d18p-1, 0x1.1a62633145c07p-55}}};
  static constexpr std::array<double, 8> kSeries{-1.0 / 3,  1.0 / 5,  -1.0 / 7,  1.0 / 9,
                                                 -1.0 / 11, 1.0 / 13, -1.0 / 15, 1.0 / 17};
  const bool steep = y.hi > x.hi;
  if (steep) std::swap(x, y);
  // atan(y / x) = atan(k / 8) + atan(t) with a small t.
  const double k = nearest(8 * (y.hi / x.hi));
  const Pair eighths{k / 8, 0};
  const Pair t = k == 0 ? y / x : (y - eighths * x) / (x + eighths * y);
  const double z = t.hi * t.hi;
  const Pair small = ordered_sum(t.hi, t.lo + t.hi * z * polynomial(z, kSeries));
  const Pair flat = kAtanOfEighths[static_cast<std::size_t>(k)] + small;
  return steep ? kHalfPi - flat : flat;
}

/// sqrt(1 - x^2) for |x| <= 1.
Pair cosine_of_arcsine(double x) {
  const Pair square = exact_product(x, x);
  return square_root(exact_sum(1, -square.hi) + Pair{-square.lo, 0});
}

bool is_integer(double y) { return magnitude(y) >= 0x1p53 || nearest(y) == y; }
bool is_odd(double y) {
  return magnitude(y) < 0x1p53 && is_integer(y) && (static_cast<std::int64_t>(y) & 1) != 0;
}

}  // namespace

// NOLINTBEGIN(readability-identifier-naming): C's own names
extern "C" {

double sin(double x) noexcept {
  if (!is_finite(x)) return x - x;
  return magnitude(x) < 0x1p-27 ? x : sine(reduce(x)).hi;
}

double cos(double x) noexcept { return is_finite(x) ? cosine(reduce(x)).hi : x - x; }

void sincos(double x, double* s, double* c) noexcept {
  *s = sin(x);
  *c = cos(x);
}

double tan(double x) noexcept {
  if (!is_finite(x)) return x - x;
  if (magnitude(x) < 0x1p-27) return x;
  const Reduced r = reduce(x);
  return (sine(r) / cosine(r)).hi;
}

double exp(double x) noexcept { return x != x ? x : exponential({x, 0}); }

double exp2(double x) noexcept {
  if (!(magnitude(x) < 0x1p12)) return x != x ? x : x > 0 ? kInfinity : 0;
  return exponential(Pair{x, 0} * kLn2);
}

double expm1(double x) noexcept {
  if (x != x || magnitude(x) < 0x1p-54) return x;
  if (x > 710) return kInfinity;
  if (x < -40) return -1;
  const Power power = power_of_e({x, 0});
  if (power.exponent == 0) return power.rest.hi;
  if (power.exponent > 60) return exp(x);
  const double scale = times_power_of_2(1, power.exponent);
  const Pair less_one = exact_sum(scale, -1) + Pair{scale * power.rest.hi, scale * power.rest.lo};
  return less_one.hi;
}

double log(double x) noexcept {
  double result = 0;
  return without_logarithm(x, result) ? result : logarithm({x, 0}).hi;
}

double log2(double x) noexcept {
  double result = 0;
  return without_logarithm(x, result) ? result : (logarithm({x, 0}) * kPerLn2).hi;
}

double log10(double x) noexcept {
  double result = 0;
  return without_logarithm(x, result) ? result : (logarithm({x, 0}) * kPerLn10).hi;
}

double log1p(double x) noexcept {
  if (magnitude(x) < 0x1p-54) return x;
  double result = 0;
  return without_logarithm(1 + x, result) ? result : logarithm(exact_sum(1, x)).hi;
}

double pow(double x, double y) noexcept {
  if (y == 0 || x == 1) return 1;
  if (x != x || y != y) return x + y;
  const double base = magnitude(x);
  const double sign = negative(x) && is_odd(y) ? -1 : 1;
  if (base == 0 || !is_finite(base)) return sign * ((base == 0) == (y < 0) ? kInfinity : 0);
  if (!is_finite(y)) return base == 1 ? 1 : (base > 1) == (y > 0) ? kInfinity : 0;
  if (x < 0 && !is_integer(y)) return kNan;
  const Pair log_base = logarithm({base, 0});
  const double estimate = y * log_base.hi;
  if (magnitude(estimate) > 800) return sign * (estimate > 0 ? kInfinity : 0);
  return sign * exponential(log_base * Pair{y, 0});
}

double cbrt(double x) noexcept {
  if (x == 0 || !is_finite(x)) return x;
  return __builtin_copysign(exponential(logarithm({magnitude(x), 0}) * kThird), x);
}

double hypot(double x, double y) noexcept {
  // Squares in x87's extended format neither overflow nor lose a bit that counts.
  if (magnitude(x) == kInfinity || magnitude(y) == kInfinity) return kInfinity;
  const long double a = x, b = y;
  return static_cast<double>(__builtin_sqrtl(a * a + b * b));
}

double atan2(double y, double x) noexcept {
  if (x != x || y != y) return x + y;
  double a = magnitude(x), b = magnitude(y);
  if (!is_finite(a) || !is_finite(b)) {
    a = is_finite(a) ? 0 : 1;
    b = is_finite(b) ? 0 : 1;
  }
  // Far from overflow and underflow.
  const double largest = a > b ? a : b;
  const double scale = largest > 0x1p900 ? 0x1p-200 : largest < 0x1p-700 ? 0x1p300 : 1;
  const Pair first = largest == 0 ? Pair{} : angle({b * scale, 0}, {a * scale, 0});
  return __builtin_copysign(negative(x) ? (kPi - first).hi : first.hi, y);
}

double atan(double x) noexcept {
  if (x != x || magnitude(x) < 0x1p-27) return x;
  return atan2(x, 1);
}

double asin(double x) noexcept {
  if (!(magnitude(x) <= 1)) return kNan;
  if (magnitude(x) < 0x1p-27) return x;
  return __builtin_copysign(angle({magnitude(x), 0}, cosine_of_arcsine(x)).hi, x);
}

double acos(double x) noexcept {
  if (!(magnitude(x) <= 1)) return kNan;
  const Pair first = angle(cosine_of_arcsine(x), {magnitude(x), 0});
  return (x < 0 ? kPi - first : first).hi;
}

// Single precision: rounded once more.
float sinf(float x) noexcept { return static_cast<float>(sin(static_cast<double>(x))); }
float cosf(float x) noexcept { return static_cast<float>(cos(static_cast<double>(x))); }
float tanf(float x) noexcept { return static_cast<float>(tan(static_cast<double>(x))); }
void sincosf(float x, float* s, float* c) noexcept {
  *s = sinf(x);
  *c = cosf(x);
}
float asinf(float x) noexcept { return static_cast<float>(asin(static_cast<double>(x))); }
float acosf(float x) noexcept { return static_cast<float>(acos(static_cast<double>(x))); }
float atanf(float x) noexcept { return static_cast<float>(atan(static_cast<double>(x))); }
float atan2f(float y, float x) noexcept {
  return static_cast<float>(atan2(static_cast<double>(y), static_cast<double>(x)));
}
float expf(float x) noexcept { return static_cast<float>(exp(static_cast<double>(x))); }
float exp2f(float x) noexcept { return static_cast<float>(exp2(static_cast<double>(x))); }
float expm1f(float x) noexcept { return static_cast<float>(expm1(static_cast<double>(x))); }
float logf(float x) noexcept { return static_cast<float>(log(static_cast<double>(x))); }
float log2f(float x) noexcept { return static_cast<float>(log2(static_cast<double>(x))); }
float log10f(float x) noexcept { return static_cast<float>(log10(static_cast<double>(x))); }
float log1pf(float x) noexcept { return static_cast<float>(log1p(static_cast<double>(x))); }
float powf(float x, float y) noexcept {
  return static_cast<float>(pow(static_cast<double>(x), static_cast<double>(y)));
}
float cbrtf(float x) noexcept { return static_cast<float>(cbrt(static_cast<double>(x))); }
float hypotf(float x, float y) noexcept {
  return static_cast<float>(hypot(static_cast<double>(x), static_cast<double>(y)));
}

}  // extern "C"
// NOLINTEND(readability-identifier-naming)
