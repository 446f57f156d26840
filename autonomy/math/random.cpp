#include "math/random.h"

#include <array>
#include <cmath>

#include "math/mix.h"

namespace arex {
namespace {

constexpr std::uint64_t kGolden = 0x9E3779B97F4A7C15ULL;

// FNV-1a, so that a stream's numbers depend on its name and not on the order of construction.
std::uint64_t hash(std::string_view text) {
  std::uint64_t h = 0xCBF29CE484222325ULL;
  for (const char c : text) h = (h ^ static_cast<unsigned char>(c)) * 0x100000001B3ULL;
  return h;
}

double to_unit(std::uint64_t bits) { return static_cast<double>(bits >> 11) * 0x1.0p-53; }

// Layers of equal area under exp(-x^2/2), 256 of them.
// Source: Marsaglia and Tsang, The ziggurat method, J. Stat. Software 5(8), 2000.
struct Ziggurat {
  static constexpr int kLayers = 256;
  static constexpr double kTail = 3.6541528853610088;
  static constexpr double kArea = 0.00492867323399;
  std::array<double, kLayers + 1> x{};
  std::array<double, kLayers + 1> f{};

  Ziggurat() {
    auto density = [](double v) { return std::exp(-0.5 * v * v); };
    x[0] = kArea / density(kTail);
    x[1] = kTail;
    for (std::size_t i = 2; i < kLayers; ++i) {
      x[i] = std::sqrt(-2 * std::log(kArea / x[i - 1] + density(x[i - 1])));
    }
    x[kLayers] = 0;
    for (std::size_t i = 0; i <= kLayers; ++i) f[i] = density(x[i]);
  }
};

}  // namespace

RandomStream::RandomStream(std::uint64_t seed, std::string_view name)
    : state_(mix_bits(mix_bits(seed + kGolden) ^ hash(name))) {}

RandomStream RandomStream::fork(std::uint64_t index) const {
  return RandomStream(mix_bits(state_ ^ mix_bits((index + 1) * kGolden)));
}

std::uint64_t RandomStream::bits() { return mix_bits(state_ += kGolden); }

double RandomStream::uniform() { return to_unit(bits()); }

double RandomStream::uniform(double low, double high) { return low + (high - low) * uniform(); }

int RandomStream::uniform_int(int low, int high) {
  const auto span = static_cast<std::uint64_t>(static_cast<std::int64_t>(high) - low + 1);
  return low + static_cast<int>(bits() % span);
}

double RandomStream::normal() {
  static const Ziggurat ziggurat;
  for (;;) {
    const std::uint64_t draw = bits();
    const auto layer = static_cast<std::size_t>(draw & 0xFF);  // not among the bits of to_unit
    const double u = 2 * to_unit(draw) - 1;
    const double value = u * ziggurat.x[layer];
    if (std::abs(value) < ziggurat.x[layer + 1]) return value;
    if (layer == 0) {
      for (;;) {
        const double x = -std::log(1 - uniform()) / Ziggurat::kTail;
        const double y = -std::log(1 - uniform());
        if (2 * y > x * x) return u > 0 ? Ziggurat::kTail + x : -(Ziggurat::kTail + x);
      }
    }
    const double height =
        ziggurat.f[layer + 1] + uniform() * (ziggurat.f[layer] - ziggurat.f[layer + 1]);
    if (height < std::exp(-0.5 * value * value)) return value;
  }
}

}  // namespace arex
