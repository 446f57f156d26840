#include "sensors/infrared_exposure.h"

#include <algorithm>
#include <cmath>

namespace arex::sim {
namespace {

// A frame that is all black or all white says no more than that it is wrong by this much.
constexpr double kMostChange = 6;
constexpr double kDeadBand = 0.04;  // relative error of the mean that is let stand

}  // namespace

double central_mean(const std::vector<std::uint8_t>& grey, int width, int height) {
  std::int64_t sum = 0, count = 0;
  for (int v = height / 4; v < height - height / 4; ++v) {
    for (int u = width / 4; u < width - width / 4; ++u, ++count) {
      sum += grey[static_cast<std::size_t>(v) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(u)];
    }
  }
  return count > 0 ? static_cast<double>(sum) / static_cast<double>(count) : 0;
}

AutoExposure::AutoExposure(const InfraredSensorConfig& config)
    : config_(config), next_{config.exposure_s, config.gain} {}

void AutoExposure::add(double mean, const InfraredExposure& taken) {
  if (!config_.auto_exposure) return;
  const double error = config_.mean_target / std::max(mean, 1.0);
  if (std::abs(error - 1) < kDeadBand) return;
  const double change =
      std::pow(std::clamp(error, 1 / kMostChange, kMostChange), config_.exposure_gain);
  const double wanted = taken.exposure_s * taken.gain * change;  // s at gain 1
  // The device counts exposure in microseconds.
  const double exposure =
      std::clamp(std::round(wanted * 1e6) * 1e-6, config_.min_exposure_s, config_.exposure_limit_s);
  next_ = {exposure, std::clamp(wanted / exposure, 1.0, config_.gain_limit)};
}

}  // namespace arex::sim
