#pragma once

#include <cmath>

#include "autopilot/autopilot_config.h"
#include "messages/vehicle.h"

namespace arex {

/// Touchdown from inside: the rotors carry only part of the weight, yet the accelerometer still
/// reads gravity, so something else carries the rest. In free flight low thrust means falling.
class LandDetector {
 public:
  LandDetector(const LandDetectorConfig& config, const VehicleConfig& vehicle)
      : config_(config), weight_n_(vehicle.mass_kg * kGravity), mass_kg_(vehicle.mass_kg) {}

  /// What it looks at, at one moment.
  struct Evidence {
    double thrust_n = 0;             ///< collective, of the rotors as they turn
    double specific_force_mps2 = 0;  ///< along B's z, without vibration
    double vertical_speed_mps = 0;
    double rate_radps = 0;  ///< norm of the body rate
  };

  /// True once the evidence has held for the persistence.
  bool update(Stamp now, const Evidence& evidence) {
    const bool contact = evidence.thrust_n < config_.low_thrust_fraction * weight_n_ &&
                         mass_kg_ * evidence.specific_force_mps2 - evidence.thrust_n >
                             config_.support_fraction * weight_n_ &&
                         std::abs(evidence.vertical_speed_mps) < config_.still_speed_mps &&
                         evidence.rate_radps < config_.still_rate_radps;
    if (!contact) since_ = now;
    return to_seconds(now - since_) >= config_.persistence_s;
  }
  void reset(Stamp now) { since_ = now; }
  /// Whether the newest evidence speaks for contact.
  [[nodiscard]] bool contact(Stamp now) const { return now > since_; }

 private:
  LandDetectorConfig config_;
  double weight_n_;
  double mass_kg_;
  Stamp since_ = 0;  ///< the newest moment without contact
};

}  // namespace arex
