#include "exploration/consumption_model.h"

#include <algorithm>
#include <cmath>

namespace arex {

double energy_fraction(const ConsumptionConfig& config, double rest_v) {
  const double knee = config.middle_charge;
  const double below = 0.5 * (config.empty_v + config.middle_v) * knee;  // V times charge
  const double all = below + 0.5 * (config.middle_v + config.full_v) * (1 - knee);
  const double v = std::clamp(rest_v, config.empty_v, config.full_v);
  if (v <= config.middle_v) {
    const double charge = knee * (v - config.empty_v) / (config.middle_v - config.empty_v);
    return 0.5 * (config.empty_v + v) * charge / all;
  }
  const double charge = (1 - knee) * (v - config.middle_v) / (config.full_v - config.middle_v);
  return (below + 0.5 * (config.middle_v + v) * charge) / all;
}

void ConsumptionModel::add(const BatterySample& sample, double speed_mps, bool flying) {
  const double current = sample.current_a;
  if (last_ < 0) {
    const double rest_v = sample.voltage_v + config_.internal_resistance * current;
    stored_wh_ = config_.capacity_wh * energy_fraction(config_, rest_v);
  }
  const double dt = last_ < 0 ? 0.0 : to_seconds(sample.stamp - last_);
  last_ = sample.stamp;
  const double power = sample.voltage_v * current + config_.internal_resistance * current * current;
  used_ws_ += power * dt;
  if (!flying) return;
  const auto index = static_cast<std::size_t>(std::max(0.0, speed_mps) / config_.speed_bin_mps);
  for (Bin* bin : {&bins_[std::min(index, kBins - 1)], &flight_}) {
    bin->energy_ws += power * dt;
    bin->time_s += dt;
  }
}

double ConsumptionModel::power_w(double speed_mps) const {
  const double flown = (config_.prior_power_w * config_.prior_weight_s + flight_.energy_ws) /
                       (config_.prior_weight_s + flight_.time_s);
  const double prior = std::max(config_.prior_power_w, flown);
  const auto mean = [&](std::size_t i) {
    return (prior * config_.prior_weight_s + bins_[i].energy_ws) /
           (config_.prior_weight_s + bins_[i].time_s);
  };
  const double at =
      std::clamp(speed_mps / config_.speed_bin_mps - 0.5, 0.0, static_cast<double>(kBins - 1));
  const auto low = static_cast<std::size_t>(at);
  const std::size_t high = std::min(low + 1, kBins - 1);
  return mean(low) + (at - static_cast<double>(low)) * (mean(high) - mean(low));
}

}  // namespace arex
