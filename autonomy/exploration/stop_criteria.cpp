#include "exploration/stop_criteria.h"

namespace arex {

EnergyBalance balance_energy(const ConsumptionModel& model, double home_distance_m,
                             const StopConfig& config) {
  constexpr double kSecondsPerHour = 3600;
  const double landing_ws = model.power_w(0) * config.landing_s;
  const double home_ws = landing_ws + model.power_w(config.return_speed_mps) * home_distance_m /
                                          config.return_speed_mps;
  const auto with_margin = [&](double ws) { return config.energy_margin * ws / kSecondsPerHour; };
  return {model.left_wh(), with_margin(config.return_home ? home_ws : landing_ws),
          config.reserve_fraction * model.config().capacity_wh, with_margin(home_ws)};
}

}  // namespace arex
