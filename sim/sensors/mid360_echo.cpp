#include "sensors/mid360_echo.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace arex::sim {
namespace {

// Incidence beyond which the range noise grows no further (measured unit).
constexpr double kLeastCosine = 0.05;
// The device's scale: 150 is a perfect diffuse reflector, above it retro-reflectors.
constexpr float kDiffuseFullScale = 150;
constexpr float kFullScale = 255;
// Times a perfect diffuse reflector.
constexpr double kBrightestRetroReflector = 1000;

}  // namespace

EchoModel::EchoModel(const EchoConfig& config) : config_(config) {
  if (config.return_incidence_deg.empty() ||
      config.return_incidence_deg.size() != config.return_probability.size()) {
    throw std::invalid_argument("return_incidence_deg must be as long as return_probability");
  }
  for (std::size_t i = 0; i < sigma_factor_.size(); ++i) {
    const double fraction = std::min(static_cast<double>(i) / kSteps, 1.0);
    sigma_factor_[i] = static_cast<float>(
        std::pow(std::max(fraction, kLeastCosine), -config_.range_noise_exponent));
    probability_[i] =
        static_cast<float>(return_probability(fraction) * (1 - config_.dropout_probability));
    const double range = fraction * config_.max_range_m;
    needed_[i] = static_cast<float>(
        0.1 * std::pow(range / config_.range_at_tenth_m, 1 / config_.range_reflectivity_exponent));
  }
}

double EchoModel::range_sigma(double range_m, double cos_incidence) const {
  const double growth =
      std::pow(std::max(cos_incidence, kLeastCosine), -config_.range_noise_exponent);
  return std::max(std::hypot(config_.range_noise_m, config_.range_noise_per_m * range_m) * growth,
                  config_.range_noise_floor_m);
}

double EchoModel::return_probability(double cos_incidence) const {
  const std::vector<double>& angles = config_.return_incidence_deg;
  const std::vector<double>& values = config_.return_probability;
  const double angle = std::acos(std::min(cos_incidence, 1.0)) * 180 / std::numbers::pi;
  if (angle <= angles.front()) return values.front();
  for (std::size_t i = 1; i < angles.size(); ++i) {
    if (angle > angles[i]) continue;
    const double fraction = (angle - angles[i - 1]) / (angles[i] - angles[i - 1]);
    return values[i - 1] + fraction * (values[i] - values[i - 1]);
  }
  return values.back();
}

double EchoModel::max_range(double reflectivity, double cos_incidence) const {
  const double range = config_.range_at_tenth_m * std::pow(reflectivity * cos_incidence / 0.1,
                                                           config_.range_reflectivity_exponent);
  return std::min(range, config_.max_range_m);
}

float EchoModel::fast_range_sigma(float range_m, float cos_incidence) const {
  const auto constant = static_cast<float>(config_.range_noise_m);
  const float linear = static_cast<float>(config_.range_noise_per_m) * range_m;
  return std::max(std::sqrt(constant * constant + linear * linear) *
                      look_up(sigma_factor_, std::min(cos_incidence, 1.0F)),
                  static_cast<float>(config_.range_noise_floor_m));
}

float EchoModel::fast_return_probability(float cos_incidence) const {
  return look_up(probability_, std::min(cos_incidence, 1.0F));
}

bool EchoModel::bright_enough(float range_m, float reflectivity, float cos_incidence) const {
  const float fraction = range_m / static_cast<float>(config_.max_range_m);
  return fraction <= 1 && reflectivity * cos_incidence >= look_up(needed_, fraction);
}

float EchoModel::margin(float range_m, float reflectivity, float cos_incidence) const {
  const float needed = look_up(needed_, range_m / static_cast<float>(config_.max_range_m));
  return reflectivity * cos_incidence / std::max(needed, 1e-9F);
}

float EchoModel::intensity(float reflectivity, float cos_incidence) {
  if (reflectivity > 1) {
    const double light = std::max(1.0, static_cast<double>(reflectivity * cos_incidence));
    const double decades = std::log(light) / std::log(kBrightestRetroReflector);
    return static_cast<float>(
        kDiffuseFullScale + 1 +
        std::round((kFullScale - kDiffuseFullScale - 1) * std::min(decades, 1.0)));
  }
  return std::round(kDiffuseFullScale * std::clamp(reflectivity * cos_incidence, 0.0F, 1.0F));
}

}  // namespace arex::sim
