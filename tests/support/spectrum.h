#pragma once

#include <cmath>
#include <complex>
#include <numbers>
#include <stdexcept>
#include <vector>

/// Power spectra of measured series, for tests.
namespace arex::test {

/// One-sided power spectral density: values at k * resolution_hz, in unit^2/Hz.
struct Spectrum {
  double resolution_hz = 0;
  std::vector<double> density;

  /// Over bins whose frequency f has low < f < high.
  template <class Use>
  void between(double low_hz, double high_hz, const Use& use) const {
    for (std::size_t k = 0; k < density.size(); ++k) {
      const double f = resolution_hz * static_cast<double>(k);
      if (f > low_hz && f < high_hz) use(density[k]);
    }
  }
  [[nodiscard]] double rms(double low_hz, double high_hz) const {
    double sum = 0;
    between(low_hz, high_hz, [&](double d) { sum += d * resolution_hz; });
    return std::sqrt(sum);
  }
  /// Root of the mean density, unit/sqrt(Hz).
  [[nodiscard]] double level(double low_hz, double high_hz) const {
    double sum = 0;
    int count = 0;
    between(low_hz, high_hz, [&](double d) {
      sum += d;
      ++count;
    });
    return std::sqrt(sum / count);
  }
  /// Root of the least mean density over any 10 Hz between: what lies between lines.
  [[nodiscard]] double floor(double low_hz, double high_hz) const {
    double least = level(low_hz, low_hz + 10);
    for (double f = low_hz; f + 10 <= high_hz; f += 2) least = std::min(least, level(f, f + 10));
    return least;
  }
};

inline void fast_fourier_transform(std::vector<std::complex<double>>& x) {
  const std::size_t n = x.size();
  if (n == 1) return;
  std::vector<std::complex<double>> even(n / 2), odd(n / 2);
  for (std::size_t i = 0; i < n / 2; ++i) {
    even[i] = x[2 * i];
    odd[i] = x[2 * i + 1];
  }
  fast_fourier_transform(even);
  fast_fourier_transform(odd);
  for (std::size_t k = 0; k < n / 2; ++k) {
    const double angle = -2 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(n);
    const std::complex<double> turned = std::polar(1.0, angle) * odd[k];
    x[k] = even[k] + turned;
    x[k + n / 2] = even[k] - turned;
  }
}

/// Welch's method: Hann windows of `window` samples (a power of two) that overlap by half, each
/// without its linear trend.
inline Spectrum welch(const std::vector<double>& series, double rate_hz, std::size_t window = 256) {
  if (series.size() < window) throw std::invalid_argument("a series shorter than its window");
  const auto n = static_cast<double>(window);
  std::vector<double> hann(window);
  double power = 0;
  for (std::size_t i = 0; i < window; ++i) {
    hann[i] = 0.5 - 0.5 * std::cos(2 * std::numbers::pi * static_cast<double>(i) / n);
    power += hann[i] * hann[i];
  }
  Spectrum spectrum{rate_hz / n, std::vector<double>(window / 2 + 1, 0)};
  int windows = 0;
  for (std::size_t first = 0; first + window <= series.size(); first += window / 2) {
    double mean = 0, slope = 0;
    for (std::size_t i = 0; i < window; ++i) {
      mean += series[first + i] / n;
      slope += series[first + i] * (static_cast<double>(i) - (n - 1) / 2) * 12 / (n * (n * n - 1));
    }
    std::vector<std::complex<double>> x(window);
    for (std::size_t i = 0; i < window; ++i) {
      x[i] = hann[i] * (series[first + i] - mean - slope * (static_cast<double>(i) - (n - 1) / 2));
    }
    fast_fourier_transform(x);
    for (std::size_t k = 0; k <= window / 2; ++k) {
      const double sides = k == 0 || k == window / 2 ? 1 : 2;
      spectrum.density[k] += sides * std::norm(x[k]) / (rate_hz * power);
    }
    ++windows;
  }
  for (double& density : spectrum.density) density /= windows;
  return spectrum;
}

}  // namespace arex::test
