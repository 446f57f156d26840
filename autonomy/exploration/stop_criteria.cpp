#include "exploration/stop_criteria.h"

namespace arex {

EnergyBalance balance_energy(const ConsumptionModel& model, double home_distance_m,
                             const StopConfig& config) {
  constexpr double kSecondsPerHour = 3600;
  double needed_ws = model.power_w(0) * config.landing_s;
  if (config.return_home) {
    needed_ws += model.power_w(config.return_speed_mps) * home_distance_m / config.return_speed_mps;
  }
  return {model.left_wh(), config.energy_margin * needed_ws / kSecondsPerHour,
          config.reserve_fraction * model.config().capacity_wh};
}

}  // namespace arex
