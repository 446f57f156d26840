#include "exploration/consumption_model.h"

#include <algorithm>
#include <cmath>

namespace arex {

void ConsumptionModel::add(const BatterySample& sample, double speed_mps, bool flying) {
  const double dt = last_ < 0 ? 0.0 : to_seconds(sample.stamp - last_);
  last_ = sample.stamp;
  const double current = sample.current_a;
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
