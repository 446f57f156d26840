#pragma once

#include <array>

#include "messages/sensors.h"

namespace arex {

struct ConsumptionConfig {
  double capacity_wh = 59.2;           ///< 4S 4000 mAh (models/arex/README.md)
  double internal_resistance = 0.028;  ///< ohm, with wiring (likewise)
  // At rest (likewise): linear from full to middle and from middle to empty.
  double full_v = 16.8;
  double middle_v = 14.8;
  double empty_v = 13.2;
  double middle_charge = 5.0 / 9.0;
  double prior_power_w = 258;  ///< hover (likewise)
  double prior_weight_s = 20;
  double speed_bin_mps = 0.5;

  void fields(auto& f) {
    f("capacity_wh", capacity_wh, "energy of the full battery");
    f("internal_resistance", internal_resistance, "of the battery with its wiring, ohm");
    f("full_v", full_v, "voltage at rest of the full battery");
    f("middle_v", middle_v, "voltage at rest at middle_charge");
    f("empty_v", empty_v, "voltage at rest of the empty battery");
    f("middle_charge", middle_charge, "state of charge of the curve's knee");
    f("prior_power_w", prior_power_w, "power at any speed until it has been measured");
    f("prior_weight_s", prior_weight_s, "seconds of flight that the prior counts for");
    f("speed_bin_mps", speed_bin_mps, "width of the speed classes");
    f.check(capacity_wh > 0, "capacity_wh > 0");
    f.check(internal_resistance >= 0, "internal_resistance >= 0");
    f.check(full_v > middle_v && middle_v > empty_v && empty_v > 0,
            "full_v > middle_v > empty_v > 0");
    f.check(middle_charge > 0 && middle_charge < 1, "0 < middle_charge < 1");
    f.check(prior_power_w > 0, "prior_power_w > 0");
    f.check(prior_weight_s > 0, "prior_weight_s > 0");
    f.check(speed_bin_mps >= 0.01, "speed_bin_mps >= 0.01");
  }
};

/// Share of the full battery's energy that is left at a voltage at rest: the integral of the
/// curve's voltage over charge.
[[nodiscard]] double energy_fraction(const ConsumptionConfig& config, double rest_v);

/// Power as a function of speed, learned from the measured battery power, and the energy used. All
/// powers are those inside the battery, its own loss included: U I + R I^2. A plain value: a job
/// may take a copy.
class ConsumptionModel {
 public:
  ConsumptionModel() = default;
  explicit ConsumptionModel(const ConsumptionConfig& config)
      : config_(config), stored_wh_(config.capacity_wh) {}

  /// Adds a reading taken at a speed (m/s); it stands for the time since the one before. The first
  /// tells how full the battery is. Readings on the ground count as energy used, but teach nothing
  /// about flying.
  /// @pre stamps ascend.
  void add(const BatterySample& sample, double speed_mps, bool flying);

  /// Mean power at a speed, W; linear between the middles of the speed classes. A class with little
  /// data leans on the prior, or on the flight so far where that was dearer.
  [[nodiscard]] double power_w(double speed_mps) const;
  [[nodiscard]] double used_wh() const { return used_ws_ / 3600; }
  [[nodiscard]] double left_wh() const { return stored_wh_ - used_wh(); }
  [[nodiscard]] const ConsumptionConfig& config() const { return config_; }

 private:
  static constexpr std::size_t kBins = 12;
  struct Bin {
    double energy_ws = 0;
    double time_s = 0;
  };

  ConsumptionConfig config_;
  double stored_wh_ = config_.capacity_wh;  ///< at the first reading; full until then
  std::array<Bin, kBins> bins_{};
  Bin flight_;
  double used_ws_ = 0;
  Stamp last_ = -1;
};

}  // namespace arex
