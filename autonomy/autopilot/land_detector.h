#pragma once

#include <cmath>
#include <optional>

#include "autopilot/autopilot_config.h"
#include "messages/vehicle.h"

namespace arex {

/// Touchdown from inside. What the accelerometer reads beyond the rotors' thrust is carried by
/// something else: with no vertical motion, by the ground. That is contact. The vehicle has landed
/// when, moreover, so little thrust is demanded for so long that in the air it would fall: half the
/// weight for half a second is 2.5 m/s, whatever the thrust model's errors.
class LandDetector {
 public:
  enum class Stage { kAirborne, kContact, kLanded };

  /// What it looks at, at one moment.
  struct Evidence {
    double support_n = 0;  ///< specific force along B's z times mass, less the rotors' thrust
    double demanded_thrust_n = 0;
    /// None where nothing measures it. A falling vehicle's drag would have to pass for the support
    /// then: 0.2 of this one's weight at 11 m/s.
    std::optional<double> vertical_speed_mps;
    double rate_radps = 0;  ///< norm of the body rate
  };

  LandDetector(const LandDetectorConfig& config, const VehicleConfig& vehicle)
      : config_(config), weight_n_(vehicle.mass_kg * kGravity) {}

  Stage update(Stamp now, const Evidence& evidence) {
    const bool contact =
        evidence.support_n > config_.contact_fraction * weight_n_ &&
        std::abs(evidence.vertical_speed_mps.value_or(0)) < config_.still_speed_mps;
    const bool resting = contact && evidence.support_n > config_.support_fraction * weight_n_ &&
                         evidence.demanded_thrust_n < config_.low_thrust_fraction * weight_n_ &&
                         evidence.rate_radps < config_.still_rate_radps;
    if (!contact) airborne_ = now;
    if (!resting) restless_ = now;
    if (to_seconds(now - restless_) >= config_.persistence_s) return Stage::kLanded;
    return to_seconds(now - airborne_) >= config_.contact_s ? Stage::kContact : Stage::kAirborne;
  }
  void reset(Stamp now) { airborne_ = restless_ = now; }

 private:
  LandDetectorConfig config_;
  double weight_n_;
  Stamp airborne_ = 0;  ///< the newest moment without contact
  Stamp restless_ = 0;  ///< the newest moment that does not look landed
};

}  // namespace arex
